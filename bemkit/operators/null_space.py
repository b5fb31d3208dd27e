"""Null spaces of sparse matrices, group by group of coupled columns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.rigid_modes import NULL_TOLERANCE

if TYPE_CHECKING:
    from scipy.sparse import csr_array

_NORMAL_EQUATIONS_TOLERANCE = 1e-7
"""The same tolerance for normal equations, which have half of the digits."""
_SHIFT = 1e-12
"""Shift of the diagonal of the singular normal equations: larger than round-off, smaller than any condition."""
_MOST_DENSE = 400
"""Largest number of coupled columns that take a singular value decomposition; more columns take an iteration."""


def null_space(matrix: csr_array) -> csr_array:
    """Return an orthonormal basis of the null space of a sparse matrix.

    Parameters
    ----------
    matrix : (n_rows, n) sparse array
        Columns of size about one.

    Returns
    -------
    (n_null, n) sparse array
        One vector in each row. Groups of columns without common rows are treated separately, so that vectors are
        sparse.
    """
    from scipy.sparse import csgraph, csr_array

    n = matrix.shape[1]
    nonzero = matrix.copy()
    nonzero.eliminate_zeros()
    n_groups, group = csgraph.connected_components(abs(nonzero).T @ abs(nonzero), directed=False)
    order = np.argsort(group, kind="stable")
    groups = np.split(order, np.cumsum(np.bincount(group, minlength=n_groups))[:-1])
    by_column = nonzero.tocsc()
    n_entries = np.diff(by_column.indptr)
    rows, columns, values, n_null = [], [], [], 0
    for columns_of_group in groups:
        if columns_of_group.size == 1 and n_entries[columns_of_group[0]] == 0:
            basis = np.ones((1, 1))
        else:
            part = by_column[:, columns_of_group].tocsr()
            part = part[np.diff(part.indptr) > 0]
            basis = _null_space_of_group(part)
        rows.append(np.repeat(np.arange(n_null, n_null + len(basis)), columns_of_group.size))
        columns.append(np.tile(columns_of_group, len(basis)))
        values.append(basis.ravel())
        n_null += len(basis)
    positions: tuple[IntArray, IntArray] = (
        np.concatenate([*rows, []]).astype(int),
        np.concatenate([*columns, []]).astype(int),
    )
    return csr_array((np.concatenate([*values, []]), positions), (n_null, n))


def _null_space_of_group(part: csr_array) -> FloatArray:
    """Return an orthonormal basis (n_null, n) of the null space of a matrix whose columns are coupled."""
    if part.shape[1] <= _MOST_DENSE:
        _, singular, directions = np.linalg.svd(np.linalg.qr(part.toarray(), mode="r"))
        return np.asarray(directions[np.count_nonzero(singular > NULL_TOLERANCE) :])
    from scipy.sparse import csc_array, eye_array
    from scipy.sparse.linalg import splu

    # inverse iteration on the normal equations with more and more vectors, until some are outside of the null space
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
        is_null = singular <= _NORMAL_EQUATIONS_TOLERANCE
        if not is_null.all() or n_tried >= part.shape[1]:
            return np.asarray(directions[is_null] @ vectors.T)
        n_tried *= 4
