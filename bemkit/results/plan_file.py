"""Plans and counts of work in result files."""

from __future__ import annotations

from dataclasses import asdict, fields
from typing import TYPE_CHECKING

import numpy as np

from bemkit.hdf5 import Reader, write_attributes, write_table, write_texts
from bemkit.operators.counts import Entries, Factorisation, FactorKind, Work
from bemkit.operators.linear.solvers import Automatic
from bemkit.plan import Cost, Decisions, Formulation, Plan, PlanItem, Sizes, Stage
from bemkit.scene.registry import LINEAR_SOLVERS
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    import h5py

_OPERATORS = ("single_layer", "double_layer", "hypersingular")
_COUNTS = ("element_pairs", "right_hand_sides", "contact_unknowns")
_COSTS = ("evaluations", "flops", "calls")
_CHOSEN_NUMBERS = ("displacement_degree", "traction_degree", "takes_slopes", "n_load_steps", "has_contact")
_SIZES = tuple(entry.name for entry in fields(Sizes))


def write_plan(group: h5py.Group, plan: Plan) -> None:
    """Write the decisions and sizes of a plan as attributes, and its items as a table."""
    decisions = plan.decisions
    chosen = {
        "formulation": decisions.formulation.name,
        "linear_solver": LINEAR_SOLVERS.kind_of(decisions.linear_solver),
    }
    numbers = {name: int(getattr(decisions, name)) for name in _CHOSEN_NUMBERS}
    write_attributes(group, {**chosen, **numbers, **asdict(plan.sizes)})
    items = plan.items
    texts = {"name": [item.name for item in items], "reason": [item.reason for item in items]}
    texts["stage"] = [item.stage.name for item in items]
    costs = {name: np.array([getattr(item.cost, name) for item in items], dtype=float) for name in _COSTS}
    needed = np.array([item.is_needed for item in items], dtype=np.int64)
    size = np.array([item.cost.size for item in items], dtype=np.int64)
    write_table(group, {**texts, "is_needed": needed, **costs, "size": size})
    write_texts(group, "warnings", plan.warnings)


def read_plan(reader: Reader, scene: Scene) -> Plan:
    """Read what `write_plan` has written to the group ``plan``; the options of a linear solver are in the scene."""
    chosen = reader.attributes("plan")
    displacement, traction, slopes, n_steps, has_contact = (int(chosen[name]) for name in _CHOSEN_NUMBERS)
    formulation = Formulation[str(chosen["formulation"])]
    taken = scene.linear_solver
    if isinstance(taken, Automatic):
        taken = LINEAR_SOLVERS.find(str(chosen["linear_solver"]))()
    decisions = Decisions(formulation, displacement, traction, bool(slopes), n_steps, bool(has_contact), taken)
    sizes = Sizes(**{name: int(chosen[name]) for name in _SIZES})
    columns = reader.table("plan", texts=("name", "reason", "stage"), floats=_COSTS, integers=("is_needed", "size"))
    items = []
    for k, name in enumerate(columns["name"]):
        cost = Cost(**{cost: float(columns[cost][k]) for cost in _COSTS}, size=int(columns["size"][k]))
        is_needed, stage = bool(columns["is_needed"][k]), Stage[columns["stage"][k]]
        items.append(PlanItem(name, is_needed, columns["reason"][k], stage, cost))
    return Plan(decisions, sizes, tuple(items), reader.texts("plan/warnings"))


def write_work(group: h5py.Group, work: Work) -> None:
    """Write the counts as attributes, and the factorisations as a table."""
    counts = {name: getattr(work, name) for name in _COUNTS}
    for name in _OPERATORS:
        counts |= {f"{name}_{kind}": count for kind, count in asdict(getattr(work, name)).items()}
    write_attributes(group, counts)
    kinds = [one.kind.name for one in work.factorisations]
    write_table(group, {"kind": kinds, "order": np.array([one.order for one in work.factorisations], dtype=np.int64)})


def read_work(reader: Reader) -> Work:
    """Read what `write_work` has written to the group ``work``."""
    counts = {name: int(value) for name, value in reader.attributes("work").items()}
    columns = reader.table("work", texts=("kind",), integers=("order",))
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
