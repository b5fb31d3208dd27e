"""Assemblies in result files: the layout of `bemkit.results.result_file`, with a group for each body.

The groups that differ from those of a scene:

    /assembly        text, the assembly as TOML, instead of /scene
    /bodies/N        mesh and boundary of body N, as /mesh and /boundary of a scene; attributes name, energy
    /contact         with columns direction_x, direction_y and, with friction, friction_bound
    /contacts        table: what each contact transmits
    /rigid           table: how each rigid body moved, and what acts on it; left out without rigid bodies
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from bemkit.hdf5 import Reader, rows_of
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.outcome_file import read_fields, read_outcome, write_fields, write_forces, write_outcome
from bemkit.results.part_forces import ContactForce, RigidResult
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body

if TYPE_CHECKING:
    import h5py

_CONTACT_NUMBERS = tuple(entry.name for entry in fields(ContactForce) if entry.name != "name")
_RIGID_NUMBERS = tuple(entry.name for entry in fields(RigidResult) if entry.name != "name")
_DIRECTIONS, _BOUND = ("direction_x", "direction_y"), "friction_bound"


def write_assembly(file: h5py.File, solution: AssemblySolution) -> None:
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


def read_assembly(reader: Reader, assembly: Assembly) -> AssemblySolution:
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
