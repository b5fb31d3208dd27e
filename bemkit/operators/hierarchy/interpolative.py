"""Interpolative decomposition: a few columns of a matrix, and all others as combinations of these.

The pivoted QR factorisation A P = Q [R1 R2] of [GuEisenstat1996] stops where the next pivot is below the tolerance
times the first one. Then A is A[:, skeleton] times [1, R1^-1 R2]. A matrix with many more rows than its rank is first
replaced by a few random combinations of its rows, whose columns have the same linear relations
[HalkoMartinssonTropp2011]. LU with partial pivoting of these combinations finds a skeleton as good as that of QR in
less time [DongMartinsson2023].
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from bemkit.arrays import FloatArray, IntArray

_SPARE = 10
"""Random combinations beyond the rank; a decomposition with fewer is repeated with more combinations."""
_SKETCHED = 0.3
"""Tolerance of LU relative to that of QR: the remainder of random combinations is a few times larger."""
_ROUND_OFF = 5e-14
"""Smallest tolerance of LU: smaller pivots are round-off of the combinations."""
_KEPT, _MOST_KEPT = 8, 2**19
"""Number of cached arrays of random numbers, and their largest size: 4 MB each."""


@dataclass(frozen=True, eq=False)
class Interpolation:
    """Interpolation of n values from k of them, the skeleton.

    Parameters
    ----------
    skeleton : (k,) array
        Indices, ascending.
    rest : (n - k,) array
        Indices of the other values.
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

    def matrix(self) -> FloatArray:
        """Return the matrix (n, k) from values of the skeleton to all values."""
        result = np.zeros((self.n, self.skeleton.size))
        result[self.skeleton, np.arange(self.skeleton.size)] = 1.0
        result[self.rest] = self.weights.T
        return result

    def gather(self, values: FloatArray) -> FloatArray:
        """Apply the transpose of `matrix` to values (n, ...); return (k, ...)."""
        gathered: FloatArray = values[self.skeleton]
        gathered += self.weights @ values[self.rest]
        return gathered

    def scaled(self, sizes: FloatArray) -> Interpolation:
        """Return the interpolation of the original values from that of values multiplied by sizes (n,)."""
        weights = self.weights * sizes[self.skeleton, None]
        weights /= sizes[self.rest]
        return Interpolation(self.skeleton, self.rest, weights)


def interpolative(matrix: FloatArray, tolerance: float) -> Interpolation:
    """Choose columns of a matrix from which all of its columns are interpolated.

    Parameters
    ----------
    matrix : (m, n) array
        Overwritten if its columns are contiguous.
    tolerance : float
        Largest remainder of a column, relative to the largest column.

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
    return _sorted(order, weights)


@dataclass(frozen=True, eq=False)
class Block:
    """Weighted rows of a matrix.

    Parameters
    ----------
    entries : (m, n) array
    weights : (m,) array
    """

    entries: FloatArray
    weights: FloatArray

    def weighted(self) -> FloatArray:
        """Return the rows (m, n) multiplied by their weights."""
        return self.entries * self.weights[:, None]

    def combined(self, combinations: slice, first: int) -> FloatArray:
        """Return random combinations (n_combinations, n) of the rows; `first` is the index of row 0 in all blocks."""
        m = len(self.entries)
        random = _random(_power_of_two(combinations.stop), _power_of_two(first + m))[combinations, first : first + m]
        combined: FloatArray = (random * self.weights) @ self.entries
        return combined


def sketched(
    blocks: Sequence[Block],
    sizes: FloatArray,
    tolerance: float,
    guess: int | None,
    *,
    chosen: IntArray | None = None,
    kinds: IntArray | None = None,
) -> Interpolation:
    """Interpolate columns of a matrix from random combinations of its rows.

    Parameters
    ----------
    blocks : sequence of Block
        Rows of the matrix. Each block is scaled by its largest column, so that blocks of small entries count as much.
    sizes : (n,) array
        Scale factors of the columns, for pivoting only.
    tolerance : float
        See `interpolative`.
    guess : int or None
        Guessed rank; a wrong guess only costs time. None takes all rows, which keeps more digits of rows that are far
        smaller than others.
    chosen : (n,) array, optional
        Columns to interpolate, by default all.
    kinds : (n,) array, optional
        Kinds 0, 1 ... of the columns: the tolerance is relative to the largest column of the same kind.
    """
    columns = slice(None) if chosen is None else chosen
    firsts = np.cumsum([0, *(len(block.entries) for block in blocks)]).tolist()
    parts: list[FloatArray] = []
    while True:
        n_present, n_rows = len(parts[0]) if parts else 0, 0 if guess is None else guess + _SPARE
        if is_whole := guess is None or n_rows >= firsts[-1]:
            parts = [block.weighted()[:, columns] for block in blocks]
        else:  # add combinations to those of the last round
            new = slice(n_present, n_rows)
            more = [block.combined(new, first)[:, columns] for block, first in zip(blocks, firsts, strict=False)]
            parts = [np.concatenate(pair) for pair in zip(parts, more, strict=True)] if parts else more
        sketch, scales = _scaled_sketch(parts, sizes, kinds, is_whole=is_whole)
        lu_tolerance = max(_SKETCHED * tolerance, _ROUND_OFF)
        result = interpolative(sketch, tolerance) if is_whole else _of_sketch(sketch, lu_tolerance)
        if result is not None:
            return result.scaled(scales)
        assert guess is not None  # all rows are always enough
        guess += guess // 2


def _scaled_sketch(
    parts: list[FloatArray], sizes: FloatArray, kinds: IntArray | None, *, is_whole: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the scaled rows, or the sum of scaled combinations, and the factors (n,) of the columns."""
    scaled = [part * sizes for part in parts]
    for part in scaled:
        part /= _norms(part).max(initial=0.0) or 1.0
    sketch = np.concatenate(scaled) if is_whole else sum(scaled[1:], start=scaled[0])
    if kinds is None:
        return sketch, sizes
    norms = _norms(sketch)
    of_kind = np.array([norms[kinds == kind].max(initial=0.0) or 1.0 for kind in range(kinds.max() + 1)])
    sketch /= of_kind[kinds]
    return sketch, sizes / of_kind[kinds]


def _of_sketch(sketch: FloatArray, tolerance: float) -> Interpolation | None:
    """Interpolate the columns of random combinations (n_rows, n) by LU; return None if they are too few for the rank.

    Overwrites `sketch`. The k-th combination estimates the remainder of each column after k - 1 pivots, up to a factor
    of order one, so that the pivot is the largest remaining column. All of the last pivots must be small.
    """
    from scipy.linalg.lapack import dgetrf, dtrtrs

    n_rows, n = sketch.shape
    largest = _norms(sketch).max(initial=0.0) / np.sqrt(n_rows)
    factored, swaps, _ = dgetrf(sketch.T, overwrite_a=1)
    large = np.flatnonzero(np.abs(np.diagonal(factored)) > tolerance * largest)
    rank = int(large[-1]) + 1 if large.size else 0
    if rank + _SPARE > n_rows and rank < n:
        return None
    order = np.arange(n)
    for row, pivot in enumerate(swaps.tolist()):
        order[row], order[pivot] = order[pivot], order[row]
    weights = np.zeros((rank, n - rank))
    if weights.size:
        weights = dtrtrs(factored[:rank, :rank], factored[rank:, :rank].T, lower=1, trans=1, unitdiag=1)[0]
    return _sorted(order, weights)


def _sorted(order: IntArray, weights: FloatArray) -> Interpolation:
    """Return an interpolation from an order (n,) of all values that begins with the skeleton."""
    rank = len(weights)
    by_row = np.argsort(order[:rank])
    return Interpolation(order[:rank][by_row], order[rank:], np.ascontiguousarray(weights[by_row]))


def _norms(matrix: FloatArray) -> FloatArray:
    norms: FloatArray = np.sqrt(np.einsum("ij,ij->j", matrix, matrix))
    return norms


def _random(n_rows: int, n_columns: int) -> FloatArray:
    """Return the same random numbers for the same shape; only small arrays are cached."""
    make = _kept_random if n_rows * n_columns <= _MOST_KEPT else _kept_random.__wrapped__
    return make(n_rows, n_columns)


@lru_cache(maxsize=_KEPT)
def _kept_random(n_rows: int, n_columns: int) -> FloatArray:
    return np.random.default_rng(0).standard_normal((n_rows, n_columns))


def _power_of_two(n: int) -> int:
    return 1 << (n - 1).bit_length()
