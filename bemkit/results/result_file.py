"""Result files: HDF5 with a versioned layout, written atomically, safe to read.

A result file holds plain arrays, texts and numbers only, so any HDF5 program can read it, and reading one from a
stranger runs no code. The layout, version 2:

    /                attributes format = "bemkit-result" and schema_version
    /scene           text, the scene as TOML
    /provenance, /summary, /certificate, /timings, /memory     attributes
    /between_nodes   attributes, with contact; for other programs, since it follows from the fields
    /mesh            nodes, elements, part_elements, table parts; attribute is_exterior,
                     with a symmetry also symmetry_x, symmetry_y;
                     with curved elements also element_curve and element_span
    /boundary        points, displacement, centres, traction, traction_dofs
    /contact, /transitions, /history    tables: one dataset per column, all of one length
    /plan, /work     texts: linear solver, sizes and counts as JSON
    /warnings        texts, one sentence each; a file without them has none
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.atomic_files import OutputFileError
from bemkit.contact.certificate import Certificate
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.symmetry import Symmetry
from bemkit.hdf5 import FileFormat, Reader, ResultFileError, rows_of, write_table, write_text
from bemkit.operators.counts import OperationCounts
from bemkit.plan import Plan
from bemkit.results.outputs import STDOUT
from bemkit.results.solution import BoundaryFields, ContactTable, Solution, Transition
from bemkit.results.tables import CERTIFICATE_ENTRIES, RECORD_COUNTS, history_columns
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure, unstructure
from bemkit.scene.toml import MAX_BYTES, SceneError, scene_to_toml, single_body_from_toml
from bemkit.solvers.base import Status, StepRecord

if TYPE_CHECKING:
    import h5py

__all__ = ["OutputFileError", "ResultFileError", "check_result_target", "read_result", "write_result"]

FORMAT = FileFormat("bemkit-result", 2, "bemkit result", "bemkit run -o")
_MAX_PLAN = 1_000_000

_COUNTS = ("linear_solves", "outer_steps")
_FORCES = ("force_normal", "force_tangential", "energy")
_NUMBERS = ("x", "y", "s", "u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "weight")
_BOUNDARY = ("points", "displacement", "centres", "traction", "traction_dofs")


def check_result_target(path: str | Path) -> Path:
    """Find out, before any work is done, whether a result can be written to a file.

    Raises
    ------
    OutputFileError
        If the folder cannot be written to, or a file that is not a bemkit result stands in the way.
    """
    if str(path) == STDOUT:
        raise OutputFileError("- is standard output, which cannot take a binary result: give a file name")
    return FORMAT.check_target(path)


def write_result(path: str | Path, solution: Solution) -> None:
    """Write a solution to an HDF5 file, replacing an older result of that name at once or not at all.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not a bemkit result stands in the way.
    SceneError
        If the scene holds a Python function, which a file cannot hold.
    """
    text = scene_to_toml(solution.scene)
    with FORMAT.created(path) as file:
        write_text(file, "scene", text)
        numbers = {name: getattr(solution, name) for name in (*_COUNTS, *_FORCES)}
        summary = {"status": solution.status.name, "message": solution.message, **numbers}
        file.create_group("summary").attrs.update(summary)
        file.create_group("certificate").attrs.update(solution.certificate.as_dict())
        if solution.between_nodes is not None:
            file.create_group("between_nodes").attrs.update(solution.between_nodes.as_dict())
        file.create_group("timings", track_order=True).attrs.update(solution.timings)
        _write_mesh(file.create_group("mesh"), solution.mesh)
        for name in _BOUNDARY:
            file.create_dataset(f"boundary/{name}", data=getattr(solution.boundary, name))
        contact = {"part": list(solution.contact.part), **solution.contact.columns()}
        write_table(file.create_group("contact"), contact)
        rows = [transition.as_dict() for transition in solution.transitions]
        columns: dict[str, Any] = {name: [row[name] for row in rows] for name in ("part", "from", "to")}
        columns |= {name: np.array([row[name] for row in rows], dtype=float) for name in ("x", "y", "s")}
        write_table(file.create_group("transitions"), columns)
        write_table(file.create_group("history"), history_columns(solution.history))
        for name in ("plan", "work"):
            write_text(file, name, json.dumps(unstructure(getattr(solution, name))))
        file.create_group("memory").attrs.update(solution.memory)
        write_table(file, {"warnings": list(solution.warnings)})


def read_result(path: str | Path) -> Solution:
    """Read a solution from a result file.

    Raises
    ------
    ResultFileError
        If the file is not a complete bemkit result of a known version.
    """
    with FORMAT.opened(path) as reader:
        try:
            scene = single_body_from_toml(reader.text("scene", MAX_BYTES), name="scene inside")
        except SceneError as error:
            raise reader.error(str(error)) from error
        try:
            solution = _read_solution(reader, scene)
        except (ValueError, KeyError, OverflowError, RecursionError) as error:
            raise reader.error(f"inconsistent content ({error})") from error
    return solution


def _write_mesh(group: h5py.Group, mesh: BoundaryMesh) -> None:
    lines = {} if mesh.symmetry is None else {"symmetry_x": mesh.symmetry.x, "symmetry_y": mesh.symmetry.y}
    lines = {name: place for name, place in lines.items() if place is not None}
    group.attrs.update({"is_exterior": int(mesh.is_exterior), **lines})
    group["nodes"] = mesh.nodes
    group["elements"] = mesh.elements.astype(np.int64)
    if mesh.element_curve is not None and mesh.element_span is not None:
        group["element_curve"] = mesh.element_curve.astype(np.int64)
        group["element_span"] = mesh.element_span
    counts = np.array([len(elements) for elements in mesh.parts.values()], dtype=np.int64)
    write_table(group.create_group("parts"), {"name": list(mesh.parts), "n_elements": counts})
    group["part_elements"] = np.concatenate([np.zeros(0, np.int64), *mesh.parts.values()]).astype(np.int64)


def _read_mesh(reader: Reader, scene: Scene) -> BoundaryMesh:
    parts_table = reader.table("mesh/parts", texts=("name",), integers=("n_elements",))
    ends = np.cumsum(parts_table["n_elements"])
    pieces = np.split(reader.integers("mesh/part_elements"), ends)
    is_curved = reader.has("mesh/element_curve")
    marks = reader.attributes("mesh")
    x, y = marks.get("symmetry_x"), marks.get("symmetry_y")
    return BoundaryMesh(
        nodes=reader.floats("mesh/nodes"),
        elements=reader.integers("mesh/elements"),
        parts=dict(zip(parts_table["name"], pieces, strict=False)),
        # the file names curves by their number in the outline; the outline itself is in the scene
        curves=scene.build_mesh().curves if is_curved else (),
        element_curve=reader.integers("mesh/element_curve") if is_curved else None,
        element_span=reader.floats("mesh/element_span") if is_curved else None,
        is_exterior=bool(marks["is_exterior"]),
        symmetry=None if x is None and y is None else Symmetry(x=x, y=y),
    )


def _read_solution(reader: Reader, scene: Scene) -> Solution:
    summary, certificate = reader.attributes("summary"), reader.attributes("certificate")
    numbers: dict[str, Any] = {name: int(summary[name]) for name in _COUNTS}
    numbers |= {name: float(summary[name]) for name in _FORCES}
    mesh = _read_mesh(reader, scene)
    columns = reader.table("contact", texts=("part",), floats=_NUMBERS, integers=("status",))
    boundary = BoundaryFields(**{name: reader.floats(f"boundary/{name}") for name in _BOUNDARY})
    if len(boundary.centres) != mesh.n_elements:
        raise InputError(f"{len(boundary.centres)} tractions for {mesh.n_elements} elements")
    return Solution(
        scene=scene,
        mesh=mesh,
        status=Status[str(summary["status"])],
        certificate=Certificate(**{name: float(certificate[name]) for name in CERTIFICATE_ENTRIES}),
        contact=ContactTable(**{**columns, "part": tuple(columns["part"])}),
        boundary=boundary,
        history=_read_history(reader),
        **numbers,
        transitions=_read_transitions(reader),
        timings={name: float(value) for name, value in reader.attributes("timings").items()},
        plan=structure(json.loads(reader.text("plan", _MAX_PLAN)), Plan),
        work=structure(json.loads(reader.text("work", _MAX_PLAN)), OperationCounts),
        memory={name: int(value) for name, value in reader.attributes("memory").items()},
        message=str(summary["message"]),
        warnings=reader.texts("warnings"),
    )


def _read_transitions(reader: Reader) -> tuple[Transition, ...]:
    rows = rows_of(reader.table("transitions", texts=("part", "from", "to"), floats=("x", "y", "s")))
    return tuple(Transition(row["part"], row["x"], row["y"], row["s"], row["from"], row["to"]) for row in rows)


def _read_history(reader: Reader) -> tuple[StepRecord, ...]:
    floats = ("relative_change", *CERTIFICATE_ENTRIES)
    rows = rows_of(reader.table("history", texts=("message",), floats=floats, integers=RECORD_COUNTS))
    certificates = [Certificate(**{name: row.pop(name) for name in CERTIFICATE_ENTRIES}) for row in rows]
    return tuple(StepRecord(**row, certificate=each) for row, each in zip(rows, certificates, strict=True))
