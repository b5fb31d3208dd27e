"""Result files: HDF5 with a versioned layout, written atomically, safe to read.

A result file holds plain arrays, texts and numbers only, so any HDF5 program can read it, and reading one from a
stranger runs no code. The layout, version 3 (files of other versions are refused):

    /                attributes format = "bemkit-result" and schema_version
    /scene           text, the scene as TOML
    /provenance, /summary, /certificate, /timings, /memory     attributes
    /between_nodes   attributes, with contact; for other programs, since it follows from the fields
    /mesh            nodes, elements, part_elements, table parts; attribute is_exterior,
                     with a symmetry also symmetry_x, symmetry_y;
                     with curved elements also element_curve and element_span
    /boundary        points, displacement, centres, traction, traction_dofs, reaction
    /parts, /contacts    tables: resultants of the tractions on each part, what each contact part feels; for other
                     programs, since they follow from the fields
    /contact, /transitions, /history    tables: one dataset per column, all of one length
    /plan, /work     texts: linear solver, sizes and counts as JSON
    /warnings        JSON: kind, subject, text and number of each

Every array has an attribute `meaning` and, where the scene names its units, `unit`; see `bemkit.results.file_meanings`.

Of an assembly these groups differ:

    /assembly        text, the assembly as TOML, instead of /scene
    /bodies/N        mesh and boundary of body N, as /mesh and /boundary of a scene; attributes name, energy
    /contact         with columns direction_x, direction_y and, with friction, friction_bound
    /contacts        table: what each contact transmits
    /rigid           table: how each rigid body moved, and what acts on it; absent without rigid bodies

Of a load history there are also /asked and /steps; see `bemkit.results.history_file`.
"""

from __future__ import annotations

import json
from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.atomic_files import OutputFileError
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.surface import Surface
from bemkit.geometry.symmetry import Symmetry
from bemkit.hdf5 import FileFormat, Reader, ResultFileError, rows_of, write_table, write_text
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.result_warning import ResultWarning
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.contact_table import ContactTable, Transition
from bemkit.results.file_meanings import annotate
from bemkit.results.history_file import TRANSITION_COLUMNS, read_history, write_history
from bemkit.results.part_forces import ContactForce, PartForce, RigidResult
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.tables import CERTIFICATE_ENTRIES, RECORD_COUNTS, columns_of, history_columns
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure, unstructure
from bemkit.scene.toml import MAX_BYTES, SceneError, scene_from_toml, scene_to_toml
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    import h5py

_MAX_PLAN = 1_000_000
_COUNTS = ("linear_solves", "outer_steps")
_NUMBERS = ("x", "y", "s", "u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "weight")
_BOUNDARY = ("points", "displacement", "centres", "traction", "traction_dofs", "reaction")


__all__ = ["OutputFileError", "ResultFileError", "check_result_target", "read_result", "write_result"]

FORMAT = FileFormat("bemkit-result", 3, "bemkit result", "bemkit run -o")
_FORCES = ("force_normal", "force_tangential", "energy")
_CONTACT_NUMBERS = tuple(entry.name for entry in fields(ContactForce) if entry.name != "name")
_RIGID_NUMBERS = tuple(entry.name for entry in fields(RigidResult) if entry.name != "name")
_DIRECTIONS, _BOUND = ("direction_x", "direction_y"), "friction_bound"


def check_result_target(path: str | Path) -> Path:
    """Find out, before any work is done, whether a result can be written to a file.

    Raises
    ------
    OutputFileError
        If the folder cannot be written to, or a file that is not a bemkit result has its name.
    """
    if str(path) == "-":
        raise OutputFileError("- is standard output, which cannot take a binary result: give a file name")
    return FORMAT.check_target(path)


def write_result(path: str | Path, solution: Solution | AssemblySolution) -> None:
    """Write a solution to an HDF5 file; an older result of that name is replaced as a whole, or not at all.

    Parameters
    ----------
    path : str or Path
        Of the file, usually ``.h5``.
    solution : Solution or AssemblySolution

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not a bemkit result has its name.
    SceneError
        If the scene holds a Python function, which a file cannot hold.
    """
    text = scene_to_toml(solution.assembly if isinstance(solution, AssemblySolution) else solution.scene)
    with FORMAT.created(path) as file:
        if isinstance(solution, AssemblySolution):
            write_text(file, "assembly", text)
            _write_assembly(file, solution)
        else:
            write_text(file, "scene", text)
            _write_outcome(file, solution, {name: getattr(solution, name) for name in _FORCES}, {})
            _write_forces(file, "parts", solution.part_forces)
            _write_forces(file, "contacts", solution.contacts)
            _write_fields(file, solution.mesh, solution.boundary)
        if solution.loading is not None:
            write_history(file, solution.loading)
        annotate(file, solution.units)


def read_result(path: str | Path) -> Solution | AssemblySolution:
    """Read a solution from a result file.

    Parameters
    ----------
    path : str or Path
        Of a file written by `write_result`, `run_to_file` or ``bemkit run -o``.

    Returns
    -------
    Solution or AssemblySolution
        Of an assembly if the file holds one.

    Raises
    ------
    ResultFileError
        If the file is not a complete bemkit result of a known version.
    """
    with FORMAT.opened(path) as reader:
        name = "assembly" if reader.has("assembly") else "scene"
        try:
            scene = scene_from_toml(reader.text(name, MAX_BYTES), name="scene inside")
        except SceneError as error:
            raise reader.error(str(error)) from error
        try:
            solution = _read_assembly(reader, scene) if isinstance(scene, Assembly) else _read_solution(reader, scene)
            return replace(solution, loading=read_history(reader, solution))
        except (ValueError, KeyError, OverflowError, RecursionError) as error:
            raise reader.error(f"inconsistent content ({error})") from error


def _read_solution(reader: Reader, scene: Scene) -> Solution:
    summary = reader.attributes("summary")
    outcome, _ = _read_outcome(reader)
    mesh, boundary = _read_fields(reader, "", lambda: scene.build_mesh().curves)
    forces: dict[str, Any] = {name: float(summary[name]) for name in _FORCES}
    return Solution(scene=scene, mesh=mesh, boundary=boundary, **forces, **outcome)


def _write_assembly(file: h5py.File, solution: AssemblySolution) -> None:
    """Write a solution into an open file, all but the text of the assembly."""
    columns = dict(zip(_DIRECTIONS, solution.contact_directions.T, strict=True))
    if solution.friction_bound is not None:
        columns[_BOUND] = solution.friction_bound
    _write_outcome(file, solution, {"n_bodies": len(solution.bodies)}, columns)
    _write_forces(file, "contacts", solution.contacts)
    if solution.rigid:
        _write_forces(file, "rigid", tuple(solution.rigid.values()))
    for number, body in enumerate(solution.bodies.values()):
        group = file.create_group(f"bodies/{number}")
        group.attrs.update({"name": body.name, "energy": body.energy})
        _write_fields(group, body.mesh, body.boundary)


def _read_assembly(reader: Reader, assembly: Assembly) -> AssemblySolution:
    """Read a solution of an assembly."""
    has_bound = reader.has(f"contact/{_BOUND}")
    outcome, columns = _read_outcome(reader, (*_DIRECTIONS, _BOUND) if has_bound else _DIRECTIONS)
    contacts = rows_of(reader.table("contacts", texts=("name",), floats=_CONTACT_NUMBERS))
    rigid = rows_of(reader.table("rigid", texts=("name",), floats=_RIGID_NUMBERS)) if reader.has("rigid") else []
    bodies = [_read_body(reader, number, body, assembly) for number, body in enumerate(assembly.placed_bodies)]
    return AssemblySolution(
        assembly=assembly,
        bodies={body.name: body for body in bodies},
        contact_directions=np.stack([columns[name] for name in _DIRECTIONS], axis=1),
        friction_bound=columns.get(_BOUND),
        contacts=tuple(ContactForce(**row) for row in contacts),
        rigid={row["name"]: RigidResult(**row) for row in rigid},
        **outcome,
    )


def _read_body(reader: Reader, number: int, body: Body, assembly: Assembly) -> BodyResult:
    scene = assembly.scene_of(body)
    mesh, boundary = _read_fields(reader, f"bodies/{number}/", lambda: body.placement.mesh(scene.build_mesh()).curves)
    energy = float(reader.attributes(f"bodies/{number}")["energy"])
    return BodyResult(body.name, scene, mesh, boundary, energy)


def _write_outcome(
    file: h5py.File,
    solution: Solution | AssemblySolution,
    numbers: Mapping[str, float],
    columns: Mapping[str, FloatArray],
) -> None:
    """Write what every solution has, further numbers of the summary and further columns of the contact table."""
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
    write_table(file.create_group("transitions"), columns_of(rows, **TRANSITION_COLUMNS))
    write_table(file.create_group("history"), history_columns(solution.history))
    for name in ("plan", "work"):
        write_text(file, name, json.dumps(unstructure(getattr(solution, name))))
    file.create_group("memory").attrs.update(solution.memory)
    file["provenance"].attrs.update(solution.provenance)
    write_text(file, "warnings", json.dumps([unstructure(warning) for warning in solution.warnings]))


def _read_outcome(reader: Reader, columns: tuple[str, ...] = ()) -> tuple[dict[str, Any], dict[str, FloatArray]]:
    """Read what `_write_outcome` wrote: arguments of a solution by name, and the further columns asked for."""
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
        "transitions": tuple(map(Transition.of, rows_of(reader.table("transitions", **TRANSITION_COLUMNS)))),
        "timings": {name: float(value) for name, value in reader.attributes("timings").items()},
        "plan": structure(json.loads(reader.text("plan", _MAX_PLAN)), Plan),
        "work": structure(json.loads(reader.text("work", _MAX_PLAN)), OperationCounts),
        "memory": {name: int(value) for name, value in reader.attributes("memory").items()},
        "provenance": {name: str(value) for name, value in reader.attributes("provenance").items()},
        "warnings": structure(json.loads(reader.text("warnings", _MAX_PLAN)), tuple[ResultWarning, ...]),
    }
    return outcome, further


def _write_forces(file: h5py.File, name: str, forces: Sequence[PartForce]) -> None:
    """Write resultants of parts or contacts as a table with their entries as columns."""
    rows = [force.as_dict() for force in forces]
    numbers = list(rows[0])[1:] if rows else ()
    write_table(file.create_group(name), columns_of(rows, texts=("name",), floats=numbers))


def _write_fields(group: h5py.Group, mesh: BoundaryMesh, boundary: BoundaryFields) -> None:
    """Write the mesh of a body, and displacement and traction on it, into a group."""
    _write_mesh(group.create_group("mesh"), mesh)
    for name in _BOUNDARY:
        group.create_dataset(f"boundary/{name}", data=getattr(boundary, name))


def _read_fields(
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


def _read_history(reader: Reader) -> tuple[StepRecord, ...]:
    floats = ("relative_change", *CERTIFICATE_ENTRIES)
    rows = rows_of(reader.table("history", texts=("message",), floats=floats, integers=RECORD_COUNTS))
    certificates = [Certificate(**{name: row.pop(name) for name in CERTIFICATE_ENTRIES}) for row in rows]
    return tuple(StepRecord(**row, certificate=each) for row, each in zip(rows, certificates, strict=True))
