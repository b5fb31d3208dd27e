"""Rigid motions of the plane."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh


def rigid_motions(points: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return the displacements of two unit translations and of the rotation about `centre`.

    Parameters
    ----------
    points : (n, 2) array [m]
    centre : (2,) array [m]
    length : float [m]
        The rotation is 1/length [rad], which makes all three motions comparable.

    Returns
    -------
    (n, 2, 3) array
        motions[:, :, m] is motion m: along x, along y, rotation anticlockwise.
    """
    motions = np.zeros((points.shape[0], 2, 3))
    motions[:, 0, 0] = 1.0
    motions[:, 1, 1] = 1.0
    motions[:, 0, 2] = -(points[:, 1] - centre[1]) / length
    motions[:, 1, 2] = (points[:, 0] - centre[0]) / length
    return motions


def resting_motions(mesh: BoundaryMesh, points: FloatArray) -> FloatArray:
    """Return the motions of a body that cause no tractions at all.

    Parameters
    ----------
    mesh : BoundaryMesh
    points : (n, 2) array [m]

    Returns
    -------
    (2 n, n_motions) array
        The three rigid motions, component-wise; none for an exterior, which is at rest at infinity.
    """
    motions = rigid_motions(points, mesh.centre, mesh.diameter).reshape(-1, 3)
    return motions[:, :0] if mesh.is_exterior else motions
