"""Content of pictures: all bodies of a scene or a result in their positions, moved or not, with their contacts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import drawn_points
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry.images import reflected_to_whole
from bemkit.model.placed import place
from bemkit.results.contact_table import ContactTable
from bemkit.results.part_forces import RigidResult
from bemkit.results.solution import Solution
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import Part
from bemkit.scene.discretisation import on_whole_body
from bemkit.scene.load_history import load_steps
from bemkit.scene.plane_motion import RigidBody
from bemkit.scene.scene import Scene
from bemkit.scene.unit_names import UnitNames

Drawable: TypeAlias = Solution | Scene


@dataclass(frozen=True, eq=False)
class DrawnBody:
    """One body on its whole boundary, images by symmetry included.

    Parameters
    ----------
    scene : BodyScene
        Its scene, under its last load.
    mesh : BoundaryMesh
        In its place.
    space : BoundarySpace
        Of the displacement.
    displacement : (n_scalar, 2) array [m]
        Zero of a scene that is not solved.
    """

    scene: BodyScene
    mesh: BoundaryMesh
    space: BoundarySpace
    displacement: FloatArray

    @property
    def parts(self) -> Sequence[tuple[Part, IntArray]]:
        """The parts with their elements, those that have any."""
        return [(part, self.mesh.part(part.name)) for part in self.scene.parts if part.name in self.mesh.parts]

    def displacement_at(self, elements: IntArray, xi: FloatArray) -> FloatArray:
        """Return the displacement (m, q, 2) [m] on (m,) elements at (q,) or (m, q) local coordinates."""
        xi = np.broadcast_to(xi, (elements.size, xi.shape[-1]))
        if self.space.is_continuous:
            at_nodes = values_on_elements(self.space, self.displacement, elements)
            basis = self.space.basis(xi.ravel()).reshape(-1, *xi.shape)
        else:  # constant elements move like a polygon through their ends
            at_nodes = at_mesh_nodes(self.space, self.displacement)[self.mesh.elements[elements]]
            basis = np.stack([0.5 - 0.5 * xi, 0.5 + 0.5 * xi])
        return np.asarray(np.einsum("pmq,mpc->mqc", basis, at_nodes))

    def outlines(self, factor: float) -> list[FloatArray]:
        """Return the closed loops (n, 2), or the strip, of the body moved by a multiple of its displacement."""
        xi = drawn_points(self.mesh, self.space.degree)[:-1]
        elements = np.arange(self.mesh.n_elements)
        moved = self.mesh.points(elements, xi) + factor * self.displacement_at(elements, xi)
        loops = [moved[loop].reshape(-1, 2) for loop in self.mesh.loops]
        if self.mesh.surface is not None:
            last = self.mesh.nodes[-1] + factor * at_mesh_nodes(self.space, self.displacement)[-1]
            return [np.concatenate([*loops, [last]])]
        return [np.concatenate([loop, loop[:1]]) for loop in loops]


@dataclass(frozen=True, eq=False)
class DrawnScene:
    """Bodies, rigid bodies and contact table, as pictures draw them.

    Parameters
    ----------
    title : str
    units : UnitNames or None
    bodies : tuple of DrawnBody
    rigid : tuple of (RigidBody, RigidResult)
    contact : ContactTable
        Without rows where nothing is solved.
    """

    title: str
    units: UnitNames | None
    bodies: tuple[DrawnBody, ...]
    rigid: tuple[tuple[RigidBody, RigidResult], ...]
    contact: ContactTable

    @cached_property
    def frame(self) -> FloatArray:
        """(2, 2) array [m]: least and largest x, least and largest y of bodies; of exteriors some of the plane."""
        low = np.min([body.mesh.nodes.min(axis=0) for body in self.bodies], axis=0)
        high = np.max([body.mesh.nodes.max(axis=0) for body in self.bodies], axis=0)
        endless = [body.mesh for body in self.bodies if body.mesh.is_exterior]
        length = float((high - low).max())
        if any(mesh.surface is not None for mesh in endless):  # a strip of a surface ends where it is cut
            inside = -0.5 * length * endless[0].normals[0]
            low, high = low + np.minimum(inside, -0.2 * inside), high + np.maximum(inside, -0.2 * inside)
        elif endless:
            low, high = low - 0.5 * length, high + 0.5 * length
        return np.stack([low, high], axis=1)

    @property
    def size(self) -> float:
        """Diagonal of the frame [m]."""
        return float(np.hypot(*np.ptp(self.frame, axis=1)))

    @property
    def displacement(self) -> FloatArray:
        """(n, 2) array [m]: of all bodies."""
        return np.concatenate([body.displacement for body in self.bodies])


def shown(subject: Drawable) -> DrawnScene:
    """Collect what pictures show of a scene or a result."""
    match subject:
        case Solution():
            bodies = tuple(_body(body.scene, body.mesh, body.boundary.displacement) for body in subject.bodies.values())
            rigid = tuple((body, subject.rigid[body.name]) for body in subject.scene.rigid)
            return DrawnScene(subject.title, subject.units, bodies, rigid, subject.contact)
        case Scene():
            bodies = tuple(_body(placed.scene, placed.mesh) for placed in place(load_steps(subject)[-1]))
            rigid = tuple((body, RigidResult(body.name, *(0.0,) * 6)) for body in subject.rigid)
            return DrawnScene(subject.title, subject.units, bodies, rigid, ContactTable.empty())


def _body(scene: BodyScene, mesh: BoundaryMesh, displacement: FloatArray | None = None) -> DrawnBody:
    whole = on_whole_body(scene.discretisation, mesh)
    space, half = whole.displacement_space(mesh.whole), scene.discretisation.displacement_space(mesh)
    if displacement is None:
        displacement = np.zeros((half.n_dofs // 2, 2))
    return DrawnBody(scene, mesh.whole, space, reflected_to_whole(half, space, displacement))


def at_mesh_nodes(space: BoundarySpace, displacement: FloatArray) -> FloatArray:
    """Return displacements (n_scalar, 2) at the nodes of the mesh, between the two elements where they differ."""
    mesh = space.mesh
    at_ends = np.einsum("pq,epc->eqc", space.basis(np.array([-1.0, 1.0])), values_on_elements(space, displacement))
    before, after = mesh.node_elements.T
    share = (mesh.lengths[after] / (mesh.lengths[before] + mesh.lengths[after]))[:, None]
    return np.asarray(share * at_ends[before, 1] + (1.0 - share) * at_ends[after, 0])
