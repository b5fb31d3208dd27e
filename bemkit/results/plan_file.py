"""Plans and counts of work in result files."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING

import numpy as np

from bemkit.hdf5 import Reader, write_attributes, write_table, write_texts
from bemkit.operators.counts import Entries, Factorisation, FactorKind, Work
from bemkit.operators.linear.solvers import Automatic
from bemkit.plan import Plan, PlanItem, Sizes
from bemkit.scene.registry import LINEAR_SOLVERS
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    import h5py

_OPERATORS = ("single_layer", "double_layer", "hypersingular")
_COUNTS = ("element_pairs", "right_hand_sides", "contact_unknowns")
_SIZES = tuple(entry.name for entry in fields(Sizes))


def write_plan(group: h5py.Group, plan: Plan) -> None:
    """Write sizes, memory and time of a plan as attributes, its items as a table, its counts like those of a run."""
    linear_solver = LINEAR_SOLVERS.kind_of(plan.linear_solver)
    figures = {"linear_solver": linear_solver, "memory": plan.memory, "seconds": plan.seconds}
    write_attributes(group, {**figures, **asdict(plan.sizes)})
    needed = np.array([item.is_needed for item in plan.items], dtype=np.int64)
    texts = {name: [getattr(item, name) for item in plan.items] for name in ("name", "reason")}
    write_table(group, {**texts, "is_needed": needed})
    write_texts(group, "warnings", plan.warnings)
    write_work(group.create_group("work"), plan.work)


def read_plan(reader: Reader, scene: Scene) -> Plan:
    """Read what `write_plan` has written to the group ``plan``; the options of a linear solver are in the scene.

    Files of older versions have other sizes and costs: they hold no memory and no time, and the counts of the run.
    """
    attributes = reader.attributes("plan")
    taken = scene.linear_solver
    if isinstance(taken, Automatic):
        taken = LINEAR_SOLVERS.find(str(attributes["linear_solver"]))()
    sizes = Sizes(**{name: int(attributes[name]) for name in _SIZES})
    columns = reader.table("plan", texts=("name", "reason"), integers=("is_needed",))
    entries = zip(columns["name"], columns["is_needed"].tolist(), columns["reason"], strict=True)
    items = tuple(PlanItem(name, bool(is_needed), reason) for name, is_needed, reason in entries)
    work = read_work(reader, "plan/work" if reader.has("plan/work") else "work")
    memory, seconds = int(attributes.get("memory", 0)), float(attributes.get("seconds", 0.0))
    return Plan(taken, sizes, work, memory, seconds, items, reader.texts("plan/warnings"))


def write_work(group: h5py.Group, work: Work) -> None:
    """Write the counts as attributes, and the factorisations as a table."""
    counts = {name: getattr(work, name) for name in _COUNTS}
    for name in _OPERATORS:
        counts |= {f"{name}_{kind}": count for kind, count in asdict(getattr(work, name)).items()}
    write_attributes(group, counts)
    kinds = [one.kind.name for one in work.factorisations]
    write_table(group, {"kind": kinds, "order": np.array([one.order for one in work.factorisations], dtype=np.int64)})


def read_work(reader: Reader, group: str = "work") -> Work:
    """Read what `write_work` has written to a group."""
    counts = {name: int(value) for name, value in reader.attributes(group).items()}
    columns = reader.table(group, texts=("kind",), integers=("order",))
    pairs = zip(columns["kind"], columns["order"].tolist(), strict=True)
    single, double, hyper = (Entries(counts[f"{name}_computed"], counts[f"{name}_stored"]) for name in _OPERATORS)
    factorisations = tuple(Factorisation(FactorKind[kind], order) for kind, order in pairs)
    return Work(
        counts["element_pairs"],
        single,
        double,
        hyper,
        factorisations,
        counts["right_hand_sides"],
        counts["contact_unknowns"],
    )
