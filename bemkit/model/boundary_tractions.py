"""Tractions on the elements of a boundary: given loads projected onto their space, and means."""

from __future__ import annotations

from collections.abc import Collection

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace
from bemkit.scene.conditions import Free, Pressure, Traction
from bemkit.scene.scene import Scene

_MORE_POINTS = 4
"""Gauss points of an element at which given loads are evaluated, beyond the degree of the tractions."""


def insert_loads(
    traction: FloatArray, scene: Scene, mesh: BoundaryMesh, space: BoundarySpace, touching: Collection[str] = ()
) -> None:
    """Replace the tractions of loaded elements by the projection of the loads, of free elements by zero.

    Parameters
    ----------
    traction : (n_elements, n_local, 2) array [Pa]
        At the local nodes of their space; changed in place, but for elements in contact and those that supports hold.
    scene : Scene
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
        if isinstance(part.condition, Traction | Pressure):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            values = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            traction[elements] = np.einsum("lq,eqc->elc", projection, values)
    traction[is_free] = 0.0


def mean_tractions(space: BoundarySpace, traction: FloatArray) -> FloatArray:
    """Return the means (n_elements, 2) of tractions (n_elements, n_local, 2) at the local nodes of their space."""
    xi, weights = gauss_legendre(space.degree + 1)
    mean: FloatArray = np.einsum("l,elc->ec", space.basis(xi) @ weights / 2.0, traction)
    return mean


def projector(space: BoundarySpace, xi: FloatArray, weights: FloatArray) -> FloatArray:
    """Return (n_local, n_points): the local dofs of the least-squares fit to values at quadrature points."""
    basis = space.basis(xi)
    return np.asarray(np.linalg.solve((basis * weights) @ basis.T, basis * weights), float)
