"""From nodal displacements and forces of a body to its energy, and to tractions where they are given."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.local_values import projector
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators.rigid_modes import without_motion
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import DistributedLoad, Free

_MORE_POINTS = 4
"""Gauss points of an element at which given loads are evaluated, beyond the degree of the tractions."""


def elastic_energy(
    elastic: SteklovPoincare, space: BoundarySpace, displacement: FloatArray, force: FloatArray
) -> float:
    """Return the elastic energy of the stresses in the plane, dimensionless, from nodal fields (n_nodes, 2)."""
    of_map, map_force = elastic.own_fields(displacement, force)
    # the forces are in equilibrium: on a rigid motion, which may be huge, they would only do the work of round-off
    strained = without_motion(space.mesh, dof_points(space), of_map)
    return 0.5 * float(np.sum(strained * map_force)) + float(elastic.further_energy(of_map, map_force).sum())


def insert_loads(
    traction: FloatArray, scene: BodyScene, mesh: BoundaryMesh, space: BoundarySpace, touching: Collection[str] = ()
) -> None:
    """Replace the tractions of loaded elements by the projection of the loads, of free elements by zero.

    Parameters
    ----------
    traction : (n_elements, n_local, 2) array [Pa]
        At the local nodes of their space; changed in place, but for elements in contact and those that supports hold.
    scene : BodyScene
    mesh : BoundaryMesh
        In physical units.
    space : BoundarySpace
        Of the tractions.
    touching : collection of str
        Free parts that other bodies touch: they are left as they are.
    """
    xi, weights = gauss_legendre(space.degree + 1 + _MORE_POINTS)
    projection = projector(space, xi, weights)
    is_free = np.ones(mesh.n_elements, bool)
    for part, elements in scene.parts_on(mesh):
        is_free[elements] = isinstance(part.condition, Free) and part.name not in touching
        if isinstance(part.condition, DistributedLoad):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            values = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            traction[elements] = np.einsum("lq,eqc->elc", projection, values)
    traction[is_free] = 0.0
