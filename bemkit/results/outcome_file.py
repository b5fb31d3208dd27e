"""What result files say of every solve: certificate, contact table, history, plan; and meshes with their fields."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.problem import Certificate
from bemkit.errors import InputError
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.surface import Surface
from bemkit.geometry.symmetry import Symmetry
from bemkit.hdf5 import Reader, rows_of, write_table, write_text
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.contact_table import ContactTable, Transition
from bemkit.results.part_forces import PartForce
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.tables import CERTIFICATE_ENTRIES, RECORD_COUNTS, history_columns
from bemkit.scene.serialisation import structure, unstructure
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import h5py

_MAX_PLAN = 1_000_000
_COUNTS = ("linear_solves", "outer_steps")
_NUMBERS = ("x", "y", "s", "u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "weight")
_BOUNDARY = ("points", "displacement", "centres", "traction", "traction_dofs")


Outcome: TypeAlias = Solution | AssemblySolution


def write_outcome(
    file: h5py.File, solution: Outcome, numbers: Mapping[str, float], columns: Mapping[str, FloatArray]
) -> None:
    """Write what every solution has.

    Parameters
    ----------
    file : h5py.File
    solution : Outcome
    numbers : mapping of str to float
        Further attributes of the summary.
    columns : mapping of str to (n_contact,) array
        Further columns of the contact table.
    """
    counts = {name: getattr(solution, name) for name in _COUNTS}
    summary = {"status": solution.status.name, "message": solution.message, **counts, **numbers}
    file.create_group("summary").attrs.update(summary)
    file.create_group("certificate").attrs.update(solution.certificate.as_dict())
    if solution.between_nodes is not None:
        file.create_group("between_nodes").attrs.update(solution.between_nodes.as_dict())
    file.create_group("timings", track_order=True).attrs.update(solution.timings)
    contact = {"part": list(solution.contact.part), **solution.contact.columns(), **columns}
    write_table(file.create_group("contact"), contact)
    rows = [transition.as_dict() for transition in solution.transitions]
    texts: dict[str, Any] = {name: [row[name] for row in rows] for name in ("part", "from", "to")}
    places = {name: np.array([row[name] for row in rows], dtype=float) for name in ("x", "y", "s")}
    write_table(file.create_group("transitions"), texts | places)
    write_table(file.create_group("history"), history_columns(solution.history))
    for name in ("plan", "work"):
        write_text(file, name, json.dumps(unstructure(getattr(solution, name))))
    file.create_group("memory").attrs.update(solution.memory)
    write_table(file, {"warnings": list(solution.warnings)})


def read_outcome(reader: Reader, columns: tuple[str, ...] = ()) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Read what `write_outcome` wrote.

    Returns
    -------
    dict
        Arguments of a solution, by name.
    dict of str to (n_contact,) array
        The further columns of the contact table that are asked for.
    """
    summary, certificate = reader.attributes("summary"), reader.attributes("certificate")
    table = reader.table("contact", texts=("part",), floats=(*_NUMBERS, *columns), integers=("status",))
    further = {name: table.pop(name) for name in columns}
    outcome: dict[str, Any] = {name: int(summary[name]) for name in _COUNTS}
    outcome |= {
        "status": Status[str(summary["status"])],
        "message": str(summary["message"]),
        "certificate": Certificate(**{name: float(certificate[name]) for name in CERTIFICATE_ENTRIES}),
        "contact": ContactTable(**{**table, "part": tuple(table["part"])}),
        "history": _read_history(reader),
        "transitions": _read_transitions(reader),
        "timings": {name: float(value) for name, value in reader.attributes("timings").items()},
        "plan": structure(json.loads(reader.text("plan", _MAX_PLAN)), Plan),
        "work": structure(json.loads(reader.text("work", _MAX_PLAN)), OperationCounts),
        "memory": {name: int(value) for name, value in reader.attributes("memory").items()},
        "warnings": reader.texts("warnings"),
    }
    return outcome, further


def write_forces(file: h5py.File, name: str, forces: Sequence[PartForce]) -> None:
    """Write resultants of parts or contacts as a table with their entries as columns."""
    rows = [force.as_dict() for force in forces]
    columns = {key: [row[key] for row in rows] for key in (rows[0] if rows else ("name",))}
    numbers = {key: np.array(column, dtype=float) for key, column in columns.items() if key != "name"}
    write_table(file.create_group(name), {"name": columns["name"], **numbers})


def write_fields(group: h5py.Group, mesh: BoundaryMesh, boundary: BoundaryFields) -> None:
    """Write the mesh of a body, and displacement and traction on it, into a group."""
    _write_mesh(group.create_group("mesh"), mesh)
    for name in _BOUNDARY:
        group.create_dataset(f"boundary/{name}", data=getattr(boundary, name))


def read_fields(
    reader: Reader, prefix: str, curves: Callable[[], tuple[Curve, ...]]
) -> tuple[BoundaryMesh, BoundaryFields]:
    """Read the mesh of a body and its fields; `curves` gives the curves that the file names by their numbers."""
    mesh = _read_mesh(reader, f"{prefix}mesh", curves)
    boundary = BoundaryFields(**{name: reader.floats(f"{prefix}boundary/{name}") for name in _BOUNDARY})
    if len(boundary.centres) != mesh.n_elements:
        raise InputError(f"{len(boundary.centres)} tractions for {mesh.n_elements} elements")
    return mesh, boundary


def _write_mesh(group: h5py.Group, mesh: BoundaryMesh) -> None:
    lines = {} if mesh.symmetry is None else {"symmetry_x": mesh.symmetry.x, "symmetry_y": mesh.symmetry.y}
    lines = {name: place for name, place in lines.items() if place is not None}
    strip = {} if mesh.surface is None else {"is_periodic": int(mesh.surface.is_periodic)}
    group.attrs.update({"is_exterior": int(mesh.is_exterior), **lines, **strip})
    group["nodes"] = mesh.nodes
    group["elements"] = mesh.elements.astype(np.int64)
    if mesh.element_curve is not None and mesh.element_span is not None:
        group["element_curve"] = mesh.element_curve.astype(np.int64)
        group["element_span"] = mesh.element_span
    counts = np.array([len(elements) for elements in mesh.parts.values()], dtype=np.int64)
    write_table(group.create_group("parts"), {"name": list(mesh.parts), "n_elements": counts})
    group["part_elements"] = np.concatenate([np.zeros(0, np.int64), *mesh.parts.values()]).astype(np.int64)


def _read_mesh(reader: Reader, place: str, curves: Callable[[], tuple[Curve, ...]]) -> BoundaryMesh:
    parts_table = reader.table(f"{place}/parts", texts=("name",), integers=("n_elements",))
    ends = np.cumsum(parts_table["n_elements"])
    pieces = np.split(reader.integers(f"{place}/part_elements"), ends)
    is_curved = reader.has(f"{place}/element_curve")
    marks = reader.attributes(place)
    x, y = marks.get("symmetry_x"), marks.get("symmetry_y")
    return BoundaryMesh(
        nodes=reader.floats(f"{place}/nodes"),
        elements=reader.integers(f"{place}/elements"),
        parts=dict(zip(parts_table["name"], pieces, strict=False)),
        # the file names curves by their number in the outline; the outline itself is in the scene
        curves=curves() if is_curved else (),
        element_curve=reader.integers(f"{place}/element_curve") if is_curved else None,
        element_span=reader.floats(f"{place}/element_span") if is_curved else None,
        is_exterior=bool(marks["is_exterior"]),
        symmetry=None if x is None and y is None else Symmetry(x=x, y=y),
        surface=Surface(bool(marks["is_periodic"])) if "is_periodic" in marks else None,
    )


def _read_transitions(reader: Reader) -> tuple[Transition, ...]:
    rows = rows_of(reader.table("transitions", texts=("part", "from", "to"), floats=("x", "y", "s")))
    return tuple(Transition(row["part"], row["x"], row["y"], row["s"], row["from"], row["to"]) for row in rows)


def _read_history(reader: Reader) -> tuple[StepRecord, ...]:
    floats = ("relative_change", *CERTIFICATE_ENTRIES)
    rows = rows_of(reader.table("history", texts=("message",), floats=floats, integers=RECORD_COUNTS))
    certificates = [Certificate(**{name: row.pop(name) for name in CERTIFICATE_ENTRIES}) for row in rows]
    return tuple(StepRecord(**row, certificate=each) for row, each in zip(rows, certificates, strict=True))
