"""Nodal forces of tractions, and matrices in the frames of the nodes."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.steklov_poincare.protocol import TractionField


def integrate_traction(space: BoundarySpace, elements: IntArray, field: TractionField) -> FloatArray:
    """Integrate tractions against the scalar basis functions of a space over some elements, (n_nodes, 2)."""
    points, weights = gauss_legendre(space.degree + 5)  # exact for tractions up to the ninth power of the coordinates
    places = space.mesh.points(elements, points)
    normals = space.mesh.normals_at(elements, points)
    values = field(places.reshape(-1, 2), normals.reshape(-1, 2)).reshape(places.shape)
    measure = space.mesh.jacobian(elements, points) * weights
    local = np.einsum("eq,pq,eqc->epc", measure, space.basis(points), values)
    result = np.zeros((space.n_dofs // 2, 2))
    np.add.at(result, space.element_dofs[elements], local)
    return result


def rotate_columns(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express the columns (2 * node + component) in the frames of the nodes."""
    turned = np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))
    if not turned.size:
        return matrix
    result = matrix.copy()
    x, y = matrix[:, 2 * turned], matrix[:, 2 * turned + 1]
    for k in range(2):
        result[:, 2 * turned + k] = frame[turned, k, 0] * x + frame[turned, k, 1] * y
    return result


def rotate_rows(matrix: FloatArray, frame: FloatArray) -> FloatArray:
    """Express the rows (2 * node + component) in the frames of the nodes."""
    return rotate_columns(matrix.T, frame).T
