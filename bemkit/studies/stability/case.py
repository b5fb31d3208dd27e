"""One case of a stability sweep."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from bemkit.contact.laws import Coulomb
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import break_nodes
from bemkit.results.solution import Solution
from bemkit.scene.conditions import Contact, Part
from bemkit.scene.scene import Scene
from bemkit.studies.stability.similarity import Similarity

PRECISION = 1e-9
"""Required agreement of similar problems after scaling, relative to the largest entry."""


def precision_elsewhere(solution: Solution, distance: float) -> float:
    """Return the required agreement of a scene that is moved by a distance [m].

    Gaps are differences of coordinates, known to eps of the distance; displacements are a small part of the size, and
    rough gaps make tractions as rough as E' times the roughness over the length of an element.
    """
    bodies = solution.bodies.values()
    longest = max(float(np.abs(body.boundary.displacement).max()) for body in bodies)
    pressure = float(np.abs(solution.contact.sigma_n).max(initial=0.0))
    stiffest = max(body.scene.material.plane_modulus / float(body.mesh.lengths.min()) for body in bodies)
    loss = max(1.0 / longest, stiffest / pressure if pressure else 0.0) if longest else 0.0
    return PRECISION + 4.0 * np.finfo(float).eps * distance * loss


def with_friction(scene: Scene, coefficient: float) -> Scene:
    """Return a scene with one friction coefficient, and no laws of single contacts."""

    def parts(own: Sequence[Part]) -> tuple[Part, ...]:
        return tuple(
            replace(part, condition=Contact(part.condition.obstacle)) if isinstance(part.condition, Contact) else part
            for part in own
        )

    bodies = tuple(replace(body, parts=parts(body.parts)) for body in scene.bodies)
    contacts = tuple(replace(pair, law=None) for pair in scene.contacts)
    return replace(scene, parts=parts(scene.parts), bodies=bodies, contacts=contacts, law=Coulomb(coefficient))


@dataclass(frozen=True)
class Case:
    """One row to compute.

    Parameters
    ----------
    value : float
        Place on the axis.
    scene : Scene
    similarity : Similarity
        Factors that lead from the reference of the axis to this scene, by which results are scaled back.
    levels : int
        Number of times that the elements at corners and ends of parts are halved, in the mesh of the scene.
    precision : float
        Required agreement with the scaled copy of this case.
    deviation_limit : float
        Required agreement with the reference; infinite if the solution may change along the axis.
    keeps_steps : bool
        Whether active sets and the number of linear solves must be those of the reference as well.
    is_solvable : bool or None
        Whether a solution exists, where that is known beforehand.
    """

    value: float
    scene: Scene
    similarity: Similarity = field(default_factory=Similarity)
    levels: int = 0
    precision: float = PRECISION
    deviation_limit: float = float("inf")
    keeps_steps: bool = False
    is_solvable: bool | None = None

    def mesh(self, scene: Scene) -> BoundaryMesh:
        """Divide the boundary of `scene`, which is this case's or similar to it."""
        mesh = scene.build_mesh()
        for _ in range(self.levels):
            mesh = mesh.refined(np.unique(mesh.node_elements[break_nodes(mesh)]))
        return mesh
