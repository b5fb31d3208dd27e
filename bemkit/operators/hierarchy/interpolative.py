"""Interpolative decomposition: a few columns of a matrix, and all others as combinations of these.

With the pivoted QR factorisation A P = Q [R1 R2] of [GuEisenstat1996], stopped where the next pivot is below the
tolerance times the first one, A is A[:, skeleton] times [1, R1^-1 R2]. A matrix with many more rows than its rank is
first multiplied from the left by a few random rows: its columns depend on each other in the same way
[HalkoMartinssonTropp2011].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np

from bemkit.arrays import FloatArray, IntArray

_SPARE = 10
"""Random rows beyond the rank; with fewer of them a decomposition is made anew from more."""


@dataclass(frozen=True, eq=False)
class Interpolation:
    """How n values follow from k of them.

    Parameters
    ----------
    skeleton : (k,) array
        Ascending.
    rest : (n - k,) array
        The others, ascending.
    weights : (k, n - k) array
        Value ``rest[j]`` is the sum of ``weights[i, j]`` times value ``skeleton[i]``.
    """

    skeleton: IntArray
    rest: IntArray
    weights: FloatArray

    @property
    def n(self) -> int:
        """Number of all values."""
        return self.skeleton.size + self.rest.size

    @property
    def n_bytes(self) -> int:
        """Memory [bytes]."""
        return self.weights.nbytes + self.skeleton.nbytes + self.rest.nbytes

    def matrix(self) -> FloatArray:
        """Return the matrix (n, k) from values of the skeleton to all values."""
        result = np.zeros((self.n, self.skeleton.size))
        result[self.skeleton, np.arange(self.skeleton.size)] = 1.0
        result[self.rest] = self.weights.T
        return result

    def gather(self, values: FloatArray) -> FloatArray:
        """Return sums (k, ...) at the skeleton of values (n, ...) by the same weights: the transpose of `matrix`."""
        gathered: FloatArray = values[self.skeleton]
        gathered += self.weights @ values[self.rest]
        return gathered

    def scaled(self, sizes: FloatArray) -> Interpolation:
        """Return the same for values that were multiplied by sizes (n,) before."""
        weights = self.weights * sizes[self.skeleton, None]
        weights /= sizes[self.rest]
        return Interpolation(self.skeleton, self.rest, weights)


def interpolative(matrix: FloatArray, tolerance: float) -> Interpolation:
    """Choose columns of a matrix by which all of them are interpolated.

    Parameters
    ----------
    matrix : (m, n) array
        Overwritten if its columns are contiguous.
    tolerance : float
        Of what is left out of a column, relative to the largest column.

    Returns
    -------
    Interpolation
        ``matrix`` follows from ``matrix[:, skeleton]`` to the tolerance.
    """
    n = matrix.shape[1]
    if not matrix.size:
        return Interpolation(np.zeros(0, np.intp), np.arange(n), np.zeros((0, n)))
    from scipy.linalg.lapack import dgeqp3, dtrtrs

    factored, pivots, *_ = dgeqp3(matrix, overwrite_a=1)
    order, sizes = pivots.astype(np.intp) - 1, np.abs(np.diagonal(factored))
    rank = int(np.count_nonzero(sizes > tolerance * sizes[0]))
    weights = np.zeros((0, n))
    if rank:
        weights = dtrtrs(factored[:rank, :rank], factored[:rank, rank:])[0] if rank < n else np.zeros((rank, 0))
    by_row, by_column = np.argsort(order[:rank]), np.argsort(order[rank:])
    return Interpolation(
        order[:rank][by_row], order[rank:][by_column], np.ascontiguousarray(weights[np.ix_(by_row, by_column)])
    )


def sketched(
    matrix: FloatArray, row_weights: FloatArray, column_sizes: FloatArray, tolerance: float, guess: int | None
) -> Interpolation:
    """Interpolate the columns of a matrix from random combinations of its rows.

    Parameters
    ----------
    matrix : (m, n) array
    row_weights : (m,) array
        What a row counts.
    column_sizes : (n,) array
        By which columns are multiplied before they are compared; the weights returned hold without.
    tolerance : float
        As of `interpolative`.
    guess : int or None
        Of the rank; a wrong one costs time, nothing else. None takes all rows, which keeps more digits of rows that are
        far smaller than others.
    """
    m, n = matrix.shape
    while True:
        n_rows = m if guess is None else guess + _SPARE
        if guess is None or n_rows >= min(m, 2 * n):
            guess = None
            sketch = (matrix * row_weights[:, None]) * column_sizes
        else:
            random = _random(_power_of_two(n_rows), _power_of_two(m))[:n_rows, :m]
            sketch = ((random * row_weights) @ matrix) * column_sizes
        result = interpolative(sketch, tolerance)
        if guess is None or result.skeleton.size + _SPARE <= n_rows:
            return result.scaled(column_sizes)
        guess *= 2


@cache
def _random(n_rows: int, n_columns: int) -> FloatArray:
    return np.random.default_rng(0).standard_normal((n_rows, n_columns))


def _power_of_two(n: int) -> int:
    return 1 << (n - 1).bit_length()
