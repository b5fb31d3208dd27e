"""One body for the check: its scene, its fields, and its contact nodes."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import Frictionless
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.model.particular import ParticularFields
from bemkit.results.contact_table import ContactTable
from bemkit.results.solution import Solution
from bemkit.results.solved_body import BoundaryFields, SolvedBody
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Contact, Free, name_at_obstacle

_NO_TABLE = ContactTable((), *(np.zeros(0),) * 9, status=np.zeros(0, np.intp), weight=np.zeros(0))


@dataclass(frozen=True, eq=False)
class BodyView:
    """A body of a solution, with the contact nodes that are measured with it."""

    scene: BodyScene
    mesh: BoundaryMesh
    boundary: BoundaryFields
    energy: float
    particular: ParticularFields | None
    contact: ContactTable = _NO_TABLE
    motion: SlipHistory | None = None


def view_of(solution: Solution) -> BodyView:
    """Return the only body of a solution with its contacts at fixed obstacles."""
    body = solution.body
    table = solution.contact.renamed({name_at_obstacle(body.name, name): name for name in obstacles_of(body.scene)})
    return BodyView(
        body.scene, body.mesh, body.boundary, body.energy / body.scene.depth, body.particular, table, solution.motion
    )


def freed(body: SolvedBody) -> BodyView:
    """Return a body with free parts in place of rigid obstacles, whose contact is then a load."""
    obstacles = obstacles_of(body.scene)
    parts = tuple(replace(part, condition=Free()) if part.name in obstacles else part for part in body.scene.parts)
    scene = replace(body.scene, parts=parts, law=Frictionless())
    return BodyView(scene, body.mesh, body.boundary, body.energy / body.scene.depth, body.particular)


def obstacles_of(scene: BodyScene) -> list[str]:
    """Return the names of the parts that face rigid obstacles."""
    return [part.name for part in scene.parts if isinstance(part.condition, Contact)]
