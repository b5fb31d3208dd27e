"""Which combinations of rigid motions linear conditions leave free, for one body or for a thousand.

Bodies with few motions give them as a dense array (n_motions, n_contact, 2), those of many members as a sparse one
(n_motions, 2 n_contact) with index ``2 node + component``, since each moves the contact nodes of one member alone.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    RigidMotions: TypeAlias = FloatArray | csr_array
else:
    RigidMotions = "FloatArray | csr_array"

FREE_MOTION_TOLERANCE = 1e-9
"""A unit rigid motion that changes no condition by more than this is free of them. Normals leave about 1e-16; one held
node out of a million gives 1e-3."""
_FREE_OF_NORMAL_EQUATIONS = 1e-7
"""The same where squares of the changes are formed, which hold half of the digits."""
_SHIFT = 1e-12
"""Added to the normal equations, which are singular: well above their round-off, far below what holds anything."""
_FEW_MOTIONS = 400
"""So many motions that hang together are examined by a singular value decomposition, more of them by iteration."""


def as_rows(motions: RigidMotions) -> RigidMotions:
    """Return motions, dense or sparse, with one row (2 n_contact,) for each."""
    if isinstance(motions, np.ndarray) and motions.ndim == 3:
        return motions.reshape(len(motions), 2 * motions.shape[1])
    return motions


def as_dense(motions: RigidMotions, n_contact: int) -> FloatArray:
    """Return motions as a dense array (n_motions, n_contact, 2)."""
    return motions if isinstance(motions, np.ndarray) else np.asarray(motions.toarray()).reshape(-1, n_contact, 2)


def largest_components(motions: RigidMotions) -> FloatArray:
    """Return (n_motions,) the size of the largest component of each motion."""
    rows = as_rows(motions)
    if isinstance(rows, np.ndarray):
        return np.asarray(np.abs(rows).max(axis=1, initial=0.0))
    return np.asarray(abs(rows).max(axis=1).toarray(), dtype=float).ravel()


def null_space(matrix: csr_array) -> csr_array:
    """Return an orthonormal basis of the vectors that a sparse matrix takes to zero.

    Parameters
    ----------
    matrix : (n_rows, n) sparse array
        Columns of size about one.

    Returns
    -------
    (n_null, n) sparse array
        Columns that hang together through no row are treated apart.
    """
    from scipy.sparse import csgraph, csr_array

    n = matrix.shape[1]
    felt = matrix.copy()
    felt.eliminate_zeros()
    n_groups, group = csgraph.connected_components(abs(felt).T @ abs(felt), directed=False)
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(group, minlength=n_groups))[:-1])
    by_column = felt.tocsc()
    n_entries = np.diff(by_column.indptr)
    rows, columns, values, n_null = [], [], [], 0
    for members in groups:
        if members.size == 1 and n_entries[members[0]] == 0:
            basis = np.ones((1, 1))
        else:
            part = by_column[:, members].tocsr()
            part = part[np.diff(part.indptr) > 0]
            basis = _null_space_of_group(part)
        rows.append(np.repeat(np.arange(n_null, n_null + len(basis)), members.size))
        columns.append(np.tile(members, len(basis)))
        values.append(basis.ravel())
        n_null += len(basis)
    place: tuple[IntArray, IntArray] = (
        np.concatenate([*rows, []]).astype(int),
        np.concatenate([*columns, []]).astype(int),
    )
    return csr_array((np.concatenate([*values, []]), place), (n_null, n))


def _null_space_of_group(part: csr_array) -> FloatArray:
    if part.shape[1] <= _FEW_MOTIONS:
        _, singular, directions = np.linalg.svd(np.linalg.qr(part.toarray(), mode="r"))
        return np.asarray(directions[np.count_nonzero(singular > FREE_MOTION_TOLERANCE) :])
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    # inverse iteration on the normal equations, on more and more vectors until not all of them are null
    normal = csc_array(part.T @ part)
    factors = splu(
        normal + _SHIFT * eye_array(part.shape[1], format="csc"),
        permc_spec="MMD_AT_PLUS_A",
        diag_pivot_thresh=0.0,
        options={"SymmetricMode": True},
    )
    random = np.random.default_rng(0)
    n_tried = 8
    while True:
        vectors = np.linalg.qr(random.normal(size=(part.shape[1], min(n_tried, part.shape[1]))))[0]
        for _ in range(3):
            vectors = np.linalg.qr(factors.solve(vectors))[0]
        _, singular, directions = np.linalg.svd(part @ vectors, full_matrices=False)
        is_null = singular <= _FREE_OF_NORMAL_EQUATIONS
        if not is_null.all() or n_tried >= part.shape[1]:
            return np.asarray(directions[is_null] @ vectors.T)
        n_tried *= 4
