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
    /parts, /contacts    tables: resultants of the tractions on each part, what each contact part feels; for other
                     programs, since they follow from the fields
    /contact, /transitions, /history    tables: one dataset per column, all of one length
    /plan, /work     texts: linear solver, sizes and counts as JSON
    /warnings        texts, one sentence each; a file without them has none

Every array has an attribute `meaning` and, where the scene names its units, `unit`; see `bemkit.results.file_meanings`.

Of an assembly these groups differ:

    /assembly        text, the assembly as TOML, instead of /scene
    /bodies/N        mesh and boundary of body N, as /mesh and /boundary of a scene; attributes name, energy
    /contact         with columns direction_x, direction_y and, with friction, friction_bound
    /contacts        table: what each contact transmits
    /rigid           table: how each rigid body moved, and what acts on it; left out without rigid bodies

Of a load history there are also /asked and /steps; see `bemkit.results.history_file`.
"""

from __future__ import annotations

from dataclasses import fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.atomic_files import OutputFileError
from bemkit.hdf5 import FileFormat, Reader, ResultFileError, rows_of, write_text
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.file_meanings import annotate
from bemkit.results.history_file import read_history, write_history
from bemkit.results.outcome_file import read_fields, read_outcome, write_fields, write_forces, write_outcome
from bemkit.results.outputs import STDOUT
from bemkit.results.part_forces import ContactForce, RigidResult
from bemkit.results.solution import Solution
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.scene import Scene
from bemkit.scene.toml import MAX_BYTES, SceneError, scene_from_toml, scene_to_toml

if TYPE_CHECKING:
    import h5py

__all__ = ["OutputFileError", "ResultFileError", "check_result_target", "read_result", "write_result"]

FORMAT = FileFormat("bemkit-result", 2, "bemkit result", "bemkit run -o")
_FORCES = ("force_normal", "force_tangential", "energy")
_CONTACT_NUMBERS = tuple(entry.name for entry in fields(ContactForce) if entry.name != "name")
_RIGID_NUMBERS = tuple(entry.name for entry in fields(RigidResult) if entry.name != "name")
_DIRECTIONS, _BOUND = ("direction_x", "direction_y"), "friction_bound"


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


def write_result(path: str | Path, solution: Solution | AssemblySolution) -> None:
    """Write a solution to an HDF5 file, replacing an older result of that name at once or not at all.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not a bemkit result stands in the way.
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
            write_outcome(file, solution, {name: getattr(solution, name) for name in _FORCES}, {})
            write_forces(file, "parts", solution.part_forces)
            write_forces(file, "contacts", solution.contacts)
            write_fields(file, solution.mesh, solution.boundary)
        if solution.loading is not None:
            write_history(file, solution.loading)
        annotate(file, solution.units)


def read_result(path: str | Path) -> Solution | AssemblySolution:
    """Read a solution from a result file.

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
    outcome, _ = read_outcome(reader)
    mesh, boundary = read_fields(reader, "", lambda: scene.build_mesh().curves)
    forces: dict[str, Any] = {name: float(summary[name]) for name in _FORCES}
    return Solution(scene=scene, mesh=mesh, boundary=boundary, **forces, **outcome)


def _write_assembly(file: h5py.File, solution: AssemblySolution) -> None:
    """Write a solution into an open file, all but the text of the assembly."""
    columns = dict(zip(_DIRECTIONS, solution.contact_directions.T, strict=True))
    if solution.friction_bound is not None:
        columns[_BOUND] = solution.friction_bound
    write_outcome(file, solution, {"n_bodies": len(solution.bodies)}, columns)
    write_forces(file, "contacts", solution.contacts)
    if solution.rigid:
        write_forces(file, "rigid", tuple(solution.rigid.values()))
    for number, body in enumerate(solution.bodies.values()):
        group = file.create_group(f"bodies/{number}")
        group.attrs.update({"name": body.name, "energy": body.energy})
        write_fields(group, body.mesh, body.boundary)


def _read_assembly(reader: Reader, assembly: Assembly) -> AssemblySolution:
    """Read a solution of an assembly."""
    has_bound = reader.has(f"contact/{_BOUND}")
    outcome, columns = read_outcome(reader, (*_DIRECTIONS, _BOUND) if has_bound else _DIRECTIONS)
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
    mesh, boundary = read_fields(reader, f"bodies/{number}/", lambda: body.placement.mesh(scene.build_mesh()).curves)
    energy = float(reader.attributes(f"bodies/{number}")["energy"])
    return BodyResult(body.name, scene, mesh, boundary, energy)
