"""One step in a result file: what its group holds, written and read by one pair of functions.

A result of a single load is one step, a load history several. See `bemkit.results.result_file` for the layout.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.contact.certificate import Certificate
from bemkit.errors import ResultWarning
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.hdf5 import Reader, write_array, write_table
from bemkit.operators.counts import OperationCounts
from bemkit.plan.plan import Plan
from bemkit.results.contact_table import ContactTable
from bemkit.results.load_history import LoadStep, StepWork
from bemkit.results.part_forces import ContactForce, ContactForces, PartForce, RigidResult
from bemkit.results.solution import Solution, stated_warnings
from bemkit.results.solved_body import BoundaryFields, SideName, SolvedBody
from bemkit.results.transitions import Transition
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    import h5py

Force = TypeVar("Force", bound=PartForce)
NODES = ("x", "y", "s", "weight")
"""Columns of the contact table that all steps share, with the part."""
_CONTACT = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance")
_STATE = ("state_u_n", "state_u_t", "state_sigma_n", "state_sigma_t")
_SLIP = ("slip", "last_slip")
_DIRECTIONS = ("direction_x", "direction_y")
_PLAIN = ("message", "linear_solves", "outer_steps")
"""Entries of a solution that are texts and numbers."""
_FIELDS = ("displacement", "traction", "traction_dofs", "reaction")


@dataclass(frozen=True)
class BodyLayout:
    """Data that all steps of one body share.

    Parameters
    ----------
    name : str
    mesh : BoundaryMesh
    points, centres : (n_points, 2), (n_elements, 2) arrays [m]
    n_traction_dofs, n_reactions : int
        Rows of the body in the arrays of these names.
    """

    name: str
    mesh: BoundaryMesh
    points: FloatArray
    centres: FloatArray
    n_traction_dofs: int
    n_reactions: int


@dataclass(frozen=True)
class StepLayout:
    """Data that all steps of a file share.

    Parameters
    ----------
    bodies : tuple of BodyLayout
    nodes : mapping of str to array
        The columns `NODES` of the contact table, and its parts.
    plan : Plan
    provenance : mapping of str to str
    """

    bodies: tuple[BodyLayout, ...]
    nodes: Mapping[str, Any]
    plan: Plan
    provenance: Mapping[str, str]


def write_step(group: h5py.Group, solution: Solution, step: LoadStep | None) -> None:
    """Write the fields of a solution into a group; with a step of a load history also its outcome and what slipped."""
    table = solution.contact
    columns: dict[str, Any] = {name: getattr(table, name) for name in _CONTACT} | {"status": table.status}
    columns |= dict(zip(_DIRECTIONS, solution.contact_directions.T, strict=True))
    bound = solution.friction_bound
    columns["friction_bound"] = np.full(table.n_contact, np.nan) if bound is None else bound
    if step is not None:
        state = np.hstack([step.state.displacement, step.state.traction])
        columns |= dict(zip(_STATE, state.T, strict=True)) | {name: getattr(step.motion, name) for name in _SLIP}
        write_outcome(group, solution, step)
    write_table(group, "contact", columns)
    for name in _FIELDS:
        write_array(group, name, np.concatenate([getattr(body.boundary, name) for body in solution.bodies.values()]))


def read_step(reader: Reader, group: str, outcome: str, problem: Scene, layout: StepLayout) -> Solution:
    """Read the fields that `write_step` wrote, and the outcome at a path, as the solution of a scene."""
    names = (*_CONTACT, *_DIRECTIONS, "friction_bound")
    columns = reader.table(f"{group}/contact", floats=names, integers=("status",))
    entries = reader.json(outcome)
    table = {name: columns[name] for name in (*_CONTACT, "status")}
    boundaries = _read_boundaries(reader, group, layout.bodies)
    placed = [problem.scene_of(body) for body in problem.placed_bodies]
    columns_of_bodies = layout.bodies, placed, boundaries, map(float, entries["energies"]), entries["contact_forces"]
    bodies = [
        SolvedBody(body.name, scene, body.mesh, boundary, energy, _by_name(PartForce, forces))
        for body, scene, boundary, energy, forces in zip(*columns_of_bodies, strict=True)
    ]
    bound = columns["friction_bound"]
    return Solution(
        scene=problem,
        contact=ContactTable(**layout.nodes, **table),
        plan=layout.plan,
        provenance=layout.provenance,
        bodies={body.name: body for body in bodies},
        contact_sides={name: tuple(SideName(*side) for side in sides) for name, sides in entries["sides"].items()},
        contact_directions=np.stack([columns[name] for name in _DIRECTIONS], axis=1),
        friction_bound=bound if entries["has_friction"] else None,
        contacts=ContactForces(_by_name(ContactForce, entries["contacts"]).values()),
        rigid=_by_name(RigidResult, entries["rigid"]),
        **_outcome(entries),
    )


def write_outcome(group: h5py.Group, solution: Solution, step: LoadStep | None = None) -> None:
    """Write all of a solution but its arrays as a text in JSON, of a step also what it adds to its load history."""
    entries: dict[str, Any] = {
        "status": solution.status.name,
        **{name: getattr(solution, name) for name in _PLAIN},
        "certificate": solution.certificate.as_dict(),
        "transitions": [transition.as_dict() for transition in solution.transitions],
        "timings": dict(solution.timings),
        "memory": dict(solution.memory),
        "work": solution.work.as_dict(),
        "warnings": [warning.as_dict() for warning in solution.warnings],
        "history": [vars(record) | {"certificate": record.certificate.as_dict()} for record in solution.history],
        "energies": [body.energy for body in solution.bodies.values()],
        "contact_forces": [list(map(asdict, body.contact_forces.values())) for body in solution.bodies.values()],
        "sides": solution.contact_sides,
        "has_friction": solution.friction_bound is not None,
        "contacts": [asdict(contact) for contact in solution.contacts],
        "rigid": [asdict(body) for body in solution.rigid.values()],
    }
    if step is not None:
        counts = {"n_increments": step.n_increments, "linear_solves": step.linear_solves}
        times = {"time": step.time, "time_step": step.motion.time_step}
        entries["step"] = {**times, **counts, "work": vars(step.work)}
    write_array(group, "outcome", json.dumps(entries, default=lambda number: number.item()))


def read_load_step(reader: Reader, group: str, end: Solution) -> LoadStep:
    """Read what `write_step` wrote of a step of a load history, whose fields at its end are given."""
    columns = reader.table(f"{group}/contact", floats=(*_STATE, *_SLIP))
    entries = reader.json(f"{group}/outcome")["step"]
    state = np.stack([columns[name] for name in _STATE], axis=1)
    return LoadStep(
        work=StepWork(**_floats(entries["work"])),
        n_increments=entries["n_increments"],
        linear_solves=entries["linear_solves"],
        end=end,
        state=ContactState(state[:, :2].copy(), state[:, 2:].copy()),
        motion=SlipHistory(entries["time"], entries["time_step"], *(columns[name] for name in _SLIP)),
    )


def read_outcome(reader: Reader, path: str) -> dict[str, Any]:
    """Return the entries of a solution that `write_outcome` wrote at a path, by name."""
    return _outcome(reader.json(path))


def _outcome(entries: Mapping[str, Any]) -> dict[str, Any]:
    return {name: entries[name] for name in (*_PLAIN, "memory")} | {
        "status": Status[entries["status"]],
        "certificate": Certificate(**_floats(entries["certificate"])),
        "transitions": tuple(map(Transition.of, entries["transitions"])),
        "timings": _floats(entries["timings"]),
        "work": structure(entries["work"], OperationCounts),
        "warnings_of": partial(stated_warnings, tuple(ResultWarning(**warning) for warning in entries["warnings"])),
        "history": tuple(
            StepRecord(**{**record, "certificate": Certificate(**_floats(record["certificate"]))})
            for record in entries["history"]
        ),
    }


def _by_name(kind: type[Force], rows: Sequence[Mapping[str, Any]]) -> dict[str, Force]:
    """Return resultants by their names."""
    numbers = ({key: value for key, value in row.items() if key != "name"} for row in rows)
    return {row["name"]: kind(row["name"], **_floats(own)) for row, own in zip(rows, numbers, strict=True)}


def _floats(entries: Mapping[str, Any]) -> dict[str, float]:
    return {name: float(value) for name, value in entries.items()}


def _read_boundaries(reader: Reader, group: str, bodies: Sequence[BodyLayout]) -> list[BoundaryFields]:
    """Return the fields of each body; in the file they follow each other."""
    n_rows = {
        "displacement": [len(body.points) for body in bodies],
        "traction": [len(body.centres) for body in bodies],
        "traction_dofs": [body.n_traction_dofs for body in bodies],
        "reaction": [body.n_reactions for body in bodies],
    }
    pieces = {
        name: np.split(reader.rows(f"{group}/{name}", sum(counts)), np.cumsum(counts)[:-1])
        for name, counts in n_rows.items()
    }
    return [
        BoundaryFields(body.points, centres=body.centres, **{name: pieces[name][k].copy() for name in _FIELDS})
        for k, body in enumerate(bodies)
    ]
