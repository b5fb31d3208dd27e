"""Element-pair integrals: the one place where coincident, touching, near and far elements are told apart.

For a test element i and a trial element j, with local coordinates xi and t in [-1, 1] on each and the Legendre
polynomials P_k, the scalar integrals

    log[a, b]      = int int P_a(xi) P_b(t) log|x - y|
    quotient[a, b] = int int P_a(xi) P_b(t) (x - y) / conj(x - y)          (complex: Q11 - Q22 + 2i Q12)
    double[a, b]   = int int P_a(xi) P_b(t) k(x, y)                        (Laplace double layer)

serve all four operators. The inner integral is closed form on straight elements (`kernels`); on curved ones it is the
same closed form plus a smooth remainder near by, and a Gauss rule far away (`inner`). The outer is a Gauss rule whose
number of points follows from the distance of the two singular points of the inner integral, the end points of the trial
element. Most pairs are far and are swept densely in chunks; the few that need more points or exact local coordinates
are listed and corrected (`near`).
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import cached_property
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.inner import far_inner
from bemkit.operators.integrals.near import integrate_near, integrate_same, integrate_separated
from bemkit.operators.integrals.pairs import Degrees, Inner, PairIntegrals
from bemkit.operators.integrals.panels import Panels, squared_distance

# An analytic function whose nearest singularity lies z half lengths from the centre is integrated by n Gauss points
# with an error of about (z + sqrt(z^2 - 1))^(-2n); the distances below make that 1e-15. A factor P_a costs a digits
# of that base, so every rule has `Degrees.extra_points` more.
GAUSS_LEVELS = ((2, 3.0e3), (3, 160.0), (4, 38.0), (6, 9.0), (10, 3.0))
"""Numbers of outer points, and the distance [half lengths of the test element] from which each is enough."""
DENSE_DISTANCE = 45.0
"""Pairs closer than this, in half lengths of the trial element, leave the dense sweep."""
CHUNK_PAIRS = 32768
"""Pairs treated at once: a few complex arrays of this length stay in the cache."""
LISTED_COST = 2.5
"""Cost of a listed pair and point against one of the dense sweep (measured)."""


LevelArray: TypeAlias = npt.NDArray[np.int8]
"""An index into `GAUSS_LEVELS` for each pair; one byte, because there are as many as matrix blocks."""


class PairSweep:
    """Integrals of all pairs of some test and trial elements, delivered in chunks of rows (from any thread).

    Parameters
    ----------
    mesh : BoundaryMesh
    degrees : Degrees
        The integrals that are wanted.
    test_elements, trial_elements : (n_test,), (n_trial,) arrays, optional
        Element numbers of the rows and the columns; all elements if left out.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        degrees: Degrees,
        test_elements: IntArray | None = None,
        trial_elements: IntArray | None = None,
    ) -> None:
        everything = np.arange(mesh.n_elements)
        self.panels = Panels(mesh)
        self.degrees = degrees
        self.test = everything if test_elements is None else test_elements
        self.trial = everything if trial_elements is None else trial_elements
        self.rows_per_chunk = max(1, CHUNK_PAIRS // max(1, self.trial.size))
        level, is_close = self._classify()
        self.base = _cheapest_level(np.bincount(level.ravel(), minlength=len(GAUSS_LEVELS) + 1))
        is_close |= level > self.base
        self._rows, self._columns = np.nonzero(is_close)
        self._listed = self._correct(level[self._rows, self._columns])

    def _n_points(self, level: int) -> int:
        """Return the number of points of a Gauss level."""
        return GAUSS_LEVELS[level][0] + self.degrees.extra_points

    def row_slices(self) -> Iterator[slice]:
        """Yield the chunks as slices of the test elements."""
        for first in range(0, self.test.size, self.rows_per_chunk):
            yield slice(first, min(first + self.rows_per_chunk, self.test.size))

    def _classify(self) -> tuple[LevelArray, BoolArray]:
        """Find the Gauss level of every pair, and which pairs are too close for the dense sweep.

        The level counts the distances of `GAUSS_LEVELS` that the pair falls short of. A curved trial element needs a
        rule of its own, with the same distances in its own half lengths.
        """
        p = self.panels
        level = np.empty((self.test.size, self.trial.size), np.int8)
        is_close = np.empty(level.shape, bool)
        start, end, centre = p.start[self.trial], p.end[self.trial], p.centre[self.trial]
        _, curved = self._columns_by_kind
        reach = DENSE_DISTANCE * p.half[self.trial]
        outer = [(p.half * p.reach(distance))[self.test, None] for _, distance in GAUSS_LEVELS]
        inner = [(p.half * p.reach(distance))[self.trial[curved]] for _, distance in GAUSS_LEVELS]
        for rows in self.row_slices():
            x = p.centre[self.test[rows], None]
            half = p.half[self.test[rows], None]
            nearest = np.minimum(squared_distance(x, start), squared_distance(x, end))
            level[rows] = 0
            for threshold in outer:
                level[rows] += nearest < threshold[rows] ** 2
            from_centre = squared_distance(x, centre)
            is_close[rows] = from_centre < (reach + half) ** 2
            if curved.size:
                own = sum((from_centre[:, curved] < (threshold + half) ** 2).astype(np.int8) for threshold in inner)
                level[rows, curved] = np.maximum(level[rows, curved], own)
                is_close[rows, curved] = False
        return level, is_close

    @cached_property
    def _columns_by_kind(self) -> tuple[IntArray, IntArray]:
        """Return the columns of straight and of curved trial elements."""
        is_straight = self.panels.is_straight[self.trial]
        return np.flatnonzero(is_straight), np.flatnonzero(~is_straight)

    def _correct(self, level: LevelArray) -> PairIntegrals:
        """Integrate the listed pairs, each with the rule that its distance asks for; straight trial elements first."""
        test, trial = self.test[self._rows], self.trial[self._columns]
        result = PairIntegrals.zeros(self.degrees, (test.size,))
        is_same = test == trial
        is_straight = self.panels.is_straight[trial]
        for kind in (is_straight, ~is_straight):
            for number in range(len(GAUSS_LEVELS)):
                n_points = self._n_points(number)
                for chosen in _batches(np.flatnonzero(kind & (level == number)), 2 * CHUNK_PAIRS // n_points):
                    values = integrate_separated(self.panels, self.degrees, test[chosen], trial[chosen], n_points)
                    _assign(result, chosen, values)
            near = np.flatnonzero(kind & (level == len(GAUSS_LEVELS)) & ~is_same)
            for chosen in _batches(near, CHUNK_PAIRS // 32):
                _assign(result, chosen, integrate_near(self.panels, self.degrees, test[chosen], trial[chosen]))
            same = np.flatnonzero(kind & is_same)
            _assign(result, same, integrate_same(self.panels, self.degrees, test[same]))
        return result

    def chunk(self, rows: slice) -> PairIntegrals:
        """Return the integrals of some rows, of shape (..., n_rows, n_trial).

        All pairs are swept with the base rule, then the listed pairs are put in their places.
        """
        straight, curved = self._columns_by_kind
        with np.errstate(all="ignore"):  # listed pairs may overflow here; they are replaced below
            if not curved.size:
                result = self._sweep_straight(rows, self.trial)
            else:
                result = PairIntegrals.zeros(self.degrees, (self.test[rows].size, self.trial.size))
                result.put(slice(None), straight, self._sweep_straight(rows, self.trial[straight]))
                result.put(slice(None), curved, self._sweep_curved(rows, self.trial[curved]))
        listed = slice(*np.searchsorted(self._rows, [rows.start, rows.stop]))
        result.put(self._rows[listed] - rows.start, self._columns[listed], self._listed.take(listed))
        return result

    def _sweep_straight(self, rows: slice, trial: IntArray) -> PairIntegrals:
        """Integrate with the base rule on the test elements and the far series of the closed forms on the others."""
        p, test = self.panels, self.test[rows]
        result = PairIntegrals.zeros(self.degrees, (test.size, trial.size))
        n_terms = kernels.terms_needed(DENSE_DISTANCE)
        to_local, offset = p.to_local[trial], p.to_local[trial] * p.centre[trial]
        for xi, weight in zip(*gauss_legendre(self._n_points(self.base)), strict=True):
            zeta = p.point(test, float(xi))[:, None] * to_local
            zeta -= offset
            integrals = kernels.far_integrals(zeta, self.degrees.highest_integral, n_terms)
            log_product = kernels.far_log_product(zeta) if self.degrees.log else zeta.real
            result.add(float(weight), float(xi), Inner.straight(self.degrees, integrals, log_product, zeta.imag))
        result.scale(p.half[test, None], p.half[trial], p.tangent[trial])
        return result

    def _sweep_curved(self, rows: slice, trial: IntArray) -> PairIntegrals:
        """Integrate with the base rule on both elements."""
        p, test = self.panels, self.test[rows]
        result = PairIntegrals.zeros(self.degrees, (test.size, trial.size))
        n_points = self._n_points(self.base)
        polynomials = p.polynomials(trial)
        for xi, weight in zip(*gauss_legendre(n_points), strict=True):
            zeta = (p.point(test, float(xi))[:, None] - p.centre[trial]) * p.to_local[trial]
            result.add(float(weight), float(xi), far_inner(self.degrees, polynomials, zeta, n_points))
        result.scale(p.half[test, None], p.half[trial], p.tangent[trial])
        return result


def _cheapest_level(counts: IntArray) -> int:
    """Choose the Gauss level of the dense sweep: more points for all, or fewer and a longer list."""
    n_points = np.array([n for n, _ in GAUSS_LEVELS] + [GAUSS_LEVELS[-1][0]])
    listed = LISTED_COST * counts * n_points
    costs = [n_points[base] * counts.sum() + listed[base + 1 :].sum() for base in range(len(GAUSS_LEVELS))]
    return int(np.argmin(costs))


def _batches(indices: IntArray, size: int) -> Iterator[IntArray]:
    for first in range(0, indices.size, size):
        yield indices[first : first + size]


def _assign(result: PairIntegrals, index: IntArray, values: PairIntegrals) -> None:
    result.log[..., index] = values.log
    result.quotient[..., index] = values.quotient
    result.double[..., index] = values.double
