"""Which tangential displacements of the contact nodes need not be unknowns.

Where a law is frictionless no traction acts along the tangent, so that this displacement is eliminated with the rest of
the body and follows the unknowns. A few of these tangents stay unknowns if normals, friction and supports alone would
leave the body free to move, or nearly so: what is eliminated has to be held.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray

WEAK = 0.03
"""A rigid motion whose share in the open directions is less than this is held too weakly by them: eliminating the rest
then loses the square of it in digits."""
SMALLEST = 1e-9
"""A combination of motions that moves the contact nodes by less than this share of the others moves none of them."""


def open_tangents(motions: FloatArray, is_frictionless: BoolArray, is_supported: BoolArray) -> BoolArray:
    """Choose the contact nodes whose tangential displacement is an unknown.

    Parameters
    ----------
    motions : (n_motions, n_contact, 2) array
        Normal and tangential components of the rigid motions that no support holds, of any sizes.
    is_frictionless : (n_contact,) bool array
    is_supported : (n_contact,) bool array
        Nodes that a support holds in one direction; they have no tangent of their own.

    Returns
    -------
    (n_contact,) bool array
        All nodes with friction, and at most as many others as there are motions.
    """
    is_open = ~is_frictionless
    if not motions.size:
        return is_open
    motions = _of_unit_size(motions)
    normal, tangential = motions[:, :, 0].T, motions[:, :, 1].T  # (n_contact, n_motions)
    held = np.concatenate([normal, tangential[is_open & ~is_supported]])
    _, singular, directions = np.linalg.svd(np.linalg.qr(held, mode="r"), full_matrices=True)
    sizes = np.zeros(len(motions))
    sizes[: singular.size] = singular
    weak = directions[sizes < WEAK * np.sqrt(len(held))]
    along = np.where((is_frictionless & ~is_supported)[:, None], tangential @ weak.T, 0.0)
    for _ in weak:  # the tangents that feel most of what is still free
        sizes = np.linalg.norm(along, axis=1)
        if sizes.max(initial=0.0) < WEAK:
            break
        node = int(np.argmax(sizes))
        is_open[node] = True
        unit = along[node] / sizes[node]
        along = along - np.outer(along @ unit, unit)
    return is_open


def _of_unit_size(motions: FloatArray) -> FloatArray:
    """Return motions that span the same, orthogonal and of mean size one at the contact nodes.

    Of a body that touches along a small part of its boundary all rotations are nearly translations there.
    """
    columns = motions.reshape(len(motions), -1).T
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    basis = basis[:, sizes > SMALLEST * sizes[0]]
    return np.asarray(np.sqrt(motions.shape[1]) * basis.T.reshape(-1, *motions.shape[1:]))
