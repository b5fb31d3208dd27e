"""Interpolative decomposition: a few columns of a matrix, and all others as combinations of these.

With the pivoted QR factorisation A P = Q [R1 R2] of [GuEisenstat1996], stopped where the next pivot is below the
tolerance times the first one, A is A[:, skeleton] times [1, R1^-1 R2].
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray


def interpolative(matrix: FloatArray, tolerance: float) -> tuple[IntArray, FloatArray]:
    """Choose columns of a matrix by which all of them are interpolated.

    Parameters
    ----------
    matrix : (m, n) array
        Overwritten.
    tolerance : float
        Of what is left out of a column, relative to the largest column.

    Returns
    -------
    skeleton : (k,) array
        The columns chosen.
    interpolation : (k, n) array
        ``matrix[:, skeleton] @ interpolation`` is the matrix to the tolerance; at the skeleton itself exactly.
    """
    if not matrix.size:
        return np.zeros(0, np.intp), np.zeros((0, matrix.shape[1]))
    from scipy.linalg.lapack import dgeqp3, dtrtrs

    factored, pivots, *_ = dgeqp3(np.asfortranarray(matrix), overwrite_a=1)
    order, sizes = pivots.astype(np.intp) - 1, np.abs(np.diagonal(factored))
    rank = int(np.count_nonzero(sizes > tolerance * sizes[0]))
    interpolation = np.zeros((rank, matrix.shape[1]))
    if rank:
        interpolation[:, order[rank:]] = dtrtrs(factored[:rank, :rank], factored[:rank, rank:])[0]
        interpolation[np.arange(rank), order[:rank]] = 1.0
    return order[:rank], interpolation
