"""Integrals of element pairs that are coincident, touching, near or far.

For a test element i and a trial element j, with local coordinates xi and t in [-1, 1] on each and the Legendre
polynomials P_k, the scalar integrals

    log[a, b]      = int int P_a(xi) P_b(t) log|x - y|
    quotient[a, b] = int int P_a(xi) P_b(t) (x - y) / conj(x - y)          (complex: Q11 - Q22 + 2i Q12)
    double[a, b]   = int int P_a(xi) P_b(t) k(x, y)                        (Laplace double layer)

serve all four operators. The inner integral has a closed form on straight elements (`kernels`). On curved elements it
is the same closed form plus a smooth remainder for near points, and a Gauss rule for far points (`inner`). The outer
integral is a Gauss rule, whose number of points depends on the distance of the end points of the trial element, where
the inner integral is singular. Most pairs are far and are swept densely in chunks; the few that need more points or
exact local coordinates are listed and corrected (`near`).
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from bemkit.arrays import BoolArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry, squared_distance
from bemkit.operators.integrals.inner import far_inner
from bemkit.operators.integrals.near import integrate_listed
from bemkit.operators.integrals.outer_rules import GAUSS_LEVELS, LevelArray, gauss_levels
from bemkit.operators.integrals.pairs import Degrees, Inner, PairIntegrals

DENSE_DISTANCE = 45.0
"""Smallest distance of a pair in the dense sweep, in half lengths of the trial element."""
CHUNK_PAIRS = 32768
"""Largest number of pairs in a chunk, of which a few complex arrays stay in the cache."""
CHUNK_INTEGRALS = 65536
"""Largest number of integrals of one kind in a chunk, over all polynomials."""
LISTED_COST = 1.5
"""Cost of a listed pair and point relative to the dense sweep (measured)."""
FEW = 120
"""Largest number of straight elements whose pairs are all listed; both orders of two elements then share integrals."""


class PairSweep:
    """Integrals of all pairs of some test and trial elements, in chunks of rows; safe to call from threads.

    Parameters
    ----------
    mesh : BoundaryMesh
    degrees : Degrees
        The required integrals.
    test_elements, trial_elements : (n_test,), (n_trial,) arrays, optional
        Elements of the rows and the columns; by default all elements.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        degrees: Degrees,
        test_elements: IntArray | None = None,
        trial_elements: IntArray | None = None,
    ) -> None:
        all_elements = np.arange(mesh.n_elements)
        self.geometry = ElementGeometry(mesh)
        self.degrees = degrees
        self.test = all_elements if test_elements is None else test_elements
        self.trial = all_elements if trial_elements is None else trial_elements
        self._n_rows = rows_per_chunk(degrees, self.trial.size, 1)
        level, is_close = self._classify()
        counts = np.bincount(level.ravel(), minlength=len(GAUSS_LEVELS) + 1)
        self.base = _cheapest_level(counts, degrees.extra_points)
        is_listed = is_close | (level > self.base)
        n_points = 1 if is_listed.all() else self._n_points(self.base)
        self._n_rows = rows_per_chunk(degrees, self.trial.size, n_points)
        self._rows, self._columns = np.nonzero(is_listed)
        pairs = self.test[self._rows], self.trial[self._columns]
        self._listed, self._slots = integrate_listed(self.geometry, degrees, *pairs)

    def _n_points(self, level: int) -> int:
        """Return the number of points of a Gauss level."""
        return GAUSS_LEVELS[level][0] + self.degrees.extra_points

    def row_slices(self) -> Iterator[slice]:
        """Yield the chunks as slices of the test elements."""
        return (
            slice(first, min(first + self._n_rows, self.test.size)) for first in range(0, self.test.size, self._n_rows)
        )

    def _classify(self) -> tuple[LevelArray, BoolArray]:
        """Return the Gauss level of each pair, and a mask of pairs too close for the dense sweep."""
        geometry = self.geometry
        level = np.empty((self.test.size, self.trial.size), np.int8)
        is_close = np.empty(level.shape, bool)
        # only the closed forms of straight elements need a distance
        distance = np.inf if self.trial.size <= FEW else DENSE_DISTANCE
        least = np.where(geometry.is_straight, distance * geometry.half, -np.inf)[self.trial]
        for rows in self.row_slices():
            test = self.test[rows, None]
            level[rows] = gauss_levels(geometry, test, self.trial)
            between = np.sqrt(squared_distance(geometry.centre[test], geometry.centre[self.trial]))
            is_close[rows] = between < least + geometry.half[test]
        return level, is_close

    def chunk(self, rows: slice) -> PairIntegrals:
        """Return the integrals of some rows, of shape (..., n_rows, n_trial).

        All pairs are swept with the base rule, then listed pairs replace theirs.
        """
        listed = slice(*np.searchsorted(self._rows, [rows.start, rows.stop]))
        shape = self.test[rows].size, self.trial.size
        if listed.stop - listed.start == shape[0] * shape[1]:  # on small meshes
            return self._listed.take(self._slots[listed].reshape(shape))
        is_straight = self.geometry.is_straight[self.trial]
        with np.errstate(all="ignore"):  # listed pairs may overflow here; they are replaced
            if is_straight.all():
                result = self._swept(rows, self.trial, is_straight=True)
            else:
                result = PairIntegrals.zeros(self.degrees, shape)
                for kind in (True, False):
                    columns = np.flatnonzero(is_straight == kind)
                    result.put(slice(None), columns, self._swept(rows, self.trial[columns], is_straight=kind))
        result.put(self._rows[listed] - rows.start, self._columns[listed], self._listed.take(self._slots[listed]))
        return result

    def _swept(self, rows: slice, trial: IntArray, *, is_straight: bool) -> PairIntegrals:
        """Integrate with the base rule on test elements, on straight trial elements with far series of closed forms."""
        geometry, degrees, test, n_points = self.geometry, self.degrees, self.test[rows], self._n_points(self.base)
        centre, to_local, polynomials = geometry.centre[trial], geometry.to_local[trial], geometry.polynomials(trial)
        n_terms = kernels.terms_needed(DENSE_DISTANCE)
        inner = []
        for xi in gauss_legendre(n_points)[0].tolist():
            zeta = geometry.point(test, xi)[:, None] - centre
            zeta *= to_local
            if is_straight:
                integrals = kernels.far_integrals(zeta, degrees.highest_integral, n_terms)
                log_product = kernels.far_log_product(zeta) if degrees.log else zeta.real
                inner.append(Inner.straight(degrees, integrals, log_product, zeta.imag))
            else:
                inner.append(far_inner(degrees, polynomials, zeta, n_points))
        sums = PairIntegrals.summed(degrees, inner)
        sums.scale(geometry.half[test, None], geometry.half[trial], geometry.tangent[trial])
        return sums


def rows_per_chunk(degrees: Degrees, n_trial: int, n_points: int) -> int:
    """Return how many rows of pairs fit into the cache with the inner integrals of all points."""
    n_rows = min(CHUNK_PAIRS, CHUNK_INTEGRALS // degrees.n_products) // max(1, n_trial)
    return max(1, 3 * n_rows // max(3, n_points))


def _cheapest_level(counts: IntArray, extra_points: int) -> int:
    """Return the Gauss level of the dense sweep that minimises the cost of swept and listed pairs."""
    n_points = extra_points + np.array([n for n, _ in GAUSS_LEVELS] + [GAUSS_LEVELS[-1][0]])
    listed = LISTED_COST * counts * n_points
    costs = [n_points[base] * counts.sum() + listed[base + 1 :].sum() for base in range(len(GAUSS_LEVELS))]
    return int(np.argmin(costs))
