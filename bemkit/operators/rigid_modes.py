"""Rigid motions of the plane, and those of bodies at their contact nodes."""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    RigidMotions: TypeAlias = FloatArray | csr_array
else:
    RigidMotions = "FloatArray | csr_array"

NULL_TOLERANCE = 1e-9
"""Largest singular value of conditions that leave a motion free. Round-off of normals gives 1e-16, one held node in a
million 1e-3."""


def rigid_motions(points: FloatArray, centre: FloatArray, length: float) -> FloatArray:
    """Return the displacements of two unit translations and of the rotation about `centre`.

    Parameters
    ----------
    points : (n, 2) array [m]
    centre : (2,) array [m]
    length : float [m]
        The rotation is 1/length [rad], so that all three motions have comparable size.

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


def admissible_modes(mesh: BoundaryMesh) -> tuple[int, ...]:
    """Return which of the two translations and the rotation a body admits.

    A body admits all three, or those that its symmetry allows. An exterior, which is at rest at infinity, admits none.
    The forces on the body do no work on admissible motions.
    """
    if mesh.is_exterior:
        return ()
    return (0, 1, 2) if mesh.symmetry is None else mesh.symmetry.rigid_motions


def traction_free_modes(mesh: BoundaryMesh, points: FloatArray) -> FloatArray:
    """Return the motions of a body that cause no tractions.

    Parameters
    ----------
    mesh : BoundaryMesh
    points : (n, 2) array [m]

    Returns
    -------
    (2 n, n_motions) array
        The admissible rigid motions, component-wise; see `admissible_modes`.
    """
    admissible = list(admissible_modes(mesh))
    motions = rigid_motions(points, mesh.centre, mesh.diameter)[:, :, admissible]
    return motions.reshape(2 * len(points), len(admissible))


def without_motion(mesh: BoundaryMesh, points: FloatArray, displacement: FloatArray) -> FloatArray:
    """Return a displacement minus its best-fitting rigid motion, which causes no strain.

    Parameters
    ----------
    mesh : BoundaryMesh
    points, displacement : (n, 2) arrays [m]

    Returns
    -------
    (n, 2) array [m]
        For an exterior the displacement itself, since every motion of its boundary causes strain.
    """
    motions = traction_free_modes(mesh, points)
    if not motions.shape[1]:
        return displacement
    nearest = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
    return displacement - (motions @ nearest).reshape(-1, 2)


def as_rows(motions: RigidMotions) -> RigidMotions:
    """Return motions, dense or sparse, with one row (2 n_contact,) for each motion."""
    if isinstance(motions, np.ndarray) and motions.ndim == 3:
        return motions.reshape(len(motions), 2 * motions.shape[1])
    return motions


def as_dense(motions: RigidMotions, n_contact: int) -> FloatArray:
    """Return motions as a dense array (n_motions, n_contact, 2)."""
    return motions if isinstance(motions, np.ndarray) else np.asarray(motions.toarray()).reshape(-1, n_contact, 2)


def largest_components(motions: RigidMotions) -> FloatArray:
    """Return the largest component (n_motions,) of each motion."""
    rows = as_rows(motions)
    if isinstance(rows, np.ndarray):
        return np.asarray(np.abs(rows).max(axis=1, initial=0.0))
    return np.asarray(abs(rows).max(axis=1).toarray(), dtype=float).ravel()


def of_unit_size(motions: RigidMotions) -> tuple[RigidMotions, FloatArray]:
    """Return motions, one in each row, of largest component one, and the sizes (n_motions,) that divide them."""
    sizes = largest_components(motions)
    sizes = np.where(sizes > 0.0, sizes, 1.0)  # motions of bodies that touch nothing stay zero
    return motions / sizes[:, None] if isinstance(motions, np.ndarray) else (motions.T / sizes).T.tocsr(), sizes


def orthonormal(motions: FloatArray) -> FloatArray:
    """Return orthonormal motions (n_motions, n_contact, 2) with the span of linearly independent ones."""
    return np.asarray(np.linalg.qr(motions.reshape(len(motions), 2 * motions.shape[1]).T)[0]).T.reshape(motions.shape)
