"""Integrals of listed element pairs: separated by a few lengths, close, touching, or the same element.

Of two straight elements the shorter one takes the outer rule, whichever is the test element: seen from there the other
one is far away sooner, and its closed forms serve both ways. Close and touching pairs are split towards their common
points [SauterSchwab2011].
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.quadrature import gauss_graded, gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.inner import N_SMOOTH, bending, far_inner, inner_integrals, local_coordinates
from bemkit.operators.integrals.pairs import Degrees, Inner, PairIntegrals
from bemkit.operators.integrals.panels import Panels, squared_distance
from bemkit.operators.integrals.splitting import SEPARATION, split_until

# An analytic function whose nearest singularity lies z half lengths from the centre is integrated by n Gauss points
# with an error of about (z + sqrt(z^2 - 1))^(-2n). A factor P_a costs a digits of that base, and every rule has one
# point more for every two degrees (`Degrees.extra_points`), so that an odd a costs one digit: the distances below make
# the error 1e-15 for even a and at most 7e-14 for odd a, of what P_0 gives.
GAUSS_LEVELS = ((2, 1.2e4), (3, 212.0), (4, 38.0), (6, 9.0), (10, 3.0))
"""Numbers of outer points, and the distance [half lengths of the outer element] from which each is enough."""
N_REGULAR = 10
N_TOUCHING = 30
BATCH_POINTS = 4096
"""Outer points treated at once: their integrals stay in the cache."""

LevelArray = npt.NDArray[np.int8]
"""An index into `GAUSS_LEVELS` for each pair; one byte, because there are as many as matrix blocks."""


def gauss_levels(panels: Panels, outer: IntArray, inner: IntArray) -> LevelArray:
    """Return how many of the distances of `GAUSS_LEVELS` pairs fall short of, for elements of shapes that broadcast.

    A curved inner element needs a rule of its own, with the same distances in its own half lengths.
    """
    centre, half = panels.centre[outer], panels.half[outer]
    nearest = np.minimum(squared_distance(centre, panels.start[inner]), squared_distance(centre, panels.end[inner]))
    level = np.zeros(nearest.shape, np.int8)
    for _, distance in GAUSS_LEVELS:
        level += nearest < np.square(half * panels.reach(distance)[outer])
    if panels.curved is not None:
        from_centre = squared_distance(centre, panels.centre[inner])
        own = np.zeros_like(level)
        for _, distance in GAUSS_LEVELS:
            own += from_centre < np.square(panels.half[inner] * panels.reach(distance)[inner] + half)
        level = np.where(panels.is_straight[inner], level, np.maximum(level, own))
    return level


def integrate_listed(
    panels: Panels, degrees: Degrees, test: IntArray, trial: IntArray
) -> tuple[PairIntegrals, IntArray]:
    """Integrate pairs of elements, each with the rule that its distance asks for.

    Parameters
    ----------
    panels : Panels
    degrees : Degrees
    test, trial : (n,) arrays
        Element numbers of the pairs.

    Returns
    -------
    integrals : PairIntegrals
        One after the other, each kind of pairs in one piece.
    places : (n,) int array
        Where those of each pair are.
    """
    half, n_elements = panels.half, panels.half.size
    is_same = test == trial
    is_turned = (half[test] > half[trial]) | ((half[test] == half[trial]) & (test > trial))
    is_turned &= panels.is_straight[test] & panels.is_straight[trial]
    # both orders of two elements share their integrals; those of elements with themselves come last and are left out
    numbers = np.where(is_turned, trial * n_elements + test, test * n_elements + trial)
    numbers[is_same] = n_elements**2
    different, places = np.unique(numbers, return_inverse=True)
    different = different[: np.searchsorted(different, n_elements**2)]
    direct, turned = _integrate_different(panels, degrees.either_way, *np.divmod(different, n_elements))
    parts = [direct]
    if is_turned.any():
        parts.append(turned)
        places[is_turned] += direct.size
    is_straight = panels.is_straight[trial]
    for same in (np.flatnonzero(is_same & is_straight), np.flatnonzero(is_same & ~is_straight)):
        places[same] = sum(part.size for part in parts) + np.arange(same.size)
        parts.append(_integrate_same(panels, degrees, test[same]))
    return PairIntegrals.joined(degrees, parts), places


def _integrate_different(
    panels: Panels, degrees: Degrees, outer: IntArray, inner: IntArray
) -> tuple[PairIntegrals, PairIntegrals]:
    """Integrate pairs of two elements as tests and trials (outer, inner) and, if straight, the other way round."""
    half, tangent = panels.half, panels.tangent
    sums = Inner.from_rows(degrees, _outer_sums(panels, degrees, outer, inner))
    sums.log[:1, :1] += 4.0 * np.log(half[inner])
    measure = half[outer] * half[inner]
    log, quotient = measure * sums.log, (measure * tangent[inner] ** 2) * sums.quotient
    cauchy = (half[outer] / (2.0 * np.pi)) * sums.cauchy
    # with the normal n = -i tangent at y, k = Re(n / (x - y)) / (2 pi)
    turned = -((tangent[outer] * tangent[inner].conj()) * cauchy).imag
    # the sums are by the polynomials of the inner element first
    return PairIntegrals(log, quotient, cauchy.imag).swapped, PairIntegrals(log, quotient, turned)


def _outer_sums(panels: Panels, degrees: Degrees, outer: IntArray, inner: IntArray) -> FloatArray:
    """Return the (n_rows, n_outer_polynomials, n) sums of the rows of `Inner` over the rules of the outer elements."""
    (n_log, n_double), extra_points = degrees.n_trial, degrees.extra_points
    sums = np.zeros((outer.size, 3 * n_log + 2 * n_double, max(n_log, n_double)))
    level = gauss_levels(panels, outer, inner)
    for is_curved in np.unique(~panels.is_straight[inner]).tolist():
        is_kind = panels.is_straight[inner] != is_curved
        for number, (n_points, _) in enumerate(GAUSS_LEVELS):
            item = np.flatnonzero(is_kind & (level == number))
            if item.size:
                rule = _Rule.whole(item, n_points + extra_points)
                _add(sums, panels, degrees, outer, inner, rule, n_points + extra_points if is_curved else None)
        item = np.flatnonzero(is_kind & (level == len(GAUSS_LEVELS)))
        pieces = _split(panels, outer, inner, item)
        for (points, weights), chosen in (
            (_on_unit_interval(N_REGULAR + extra_points), ~pieces.touches),
            (gauss_graded(N_TOUCHING + extra_points), pieces.touches),
        ):
            _add(sums, panels, degrees, outer, inner, pieces.rule(chosen, points, weights), None)
    return np.ascontiguousarray(sums.transpose(1, 2, 0))


@lru_cache(maxsize=16)
def _on_unit_interval(n_points: int) -> tuple[FloatArray, FloatArray]:
    """Return Gauss points and weights on [0, 1], read-only."""
    reference, reference_weights = gauss_legendre(n_points)
    points, weights = 0.5 * (reference + 1.0), 0.5 * reference_weights
    read_only(points)
    read_only(weights)
    return points, weights


@dataclass(frozen=True, eq=False)
class _Rule:
    """Points on the outer elements of some items, (n, n_points) each, and the items, ascending.

    Points are given as fractions of the length from one end node, so that the distance to a shared node, and to a node
    at any small distance from it, is exact however small it is.
    """

    item: IntArray
    at_start: BoolArray
    fraction: FloatArray
    weight: FloatArray

    @classmethod
    def whole(cls, item: IntArray, n_points: int) -> _Rule:
        """Return one Gauss rule for all, each half of it measured from its own end."""
        points, weights = gauss_legendre(n_points)
        shape = (item.size, n_points)
        at_start, fraction = points < 0.0, 0.5 * (1.0 - np.abs(points))
        fraction, weight = np.broadcast_to(fraction, shape), np.broadcast_to(weights, shape)
        return cls(item, np.broadcast_to(at_start, shape), fraction, weight)


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Pieces [low, high] of outer elements, as fractions of the length from one end node; items ascending."""

    item: IntArray
    at_start: BoolArray
    low: FloatArray
    high: FloatArray
    touches: BoolArray

    def rule(self, chosen: BoolArray, points: FloatArray, weights: FloatArray) -> _Rule:
        """Return a rule on [0, 1] moved to some of the pieces."""
        low, length = self.low[chosen, None], (self.high - self.low)[chosen, None]
        at_start = np.broadcast_to(self.at_start[chosen, None], (low.size, points.size))
        return _Rule(self.item[chosen], at_start, low + points * length, 2.0 * weights * length)


def _split(panels: Panels, outer: IntArray, inner: IntArray, item: IntArray) -> _Pieces:
    """Bisect both halves of the outer elements until every piece is away from both end nodes of the inner element.

    A piece that begins at a common node takes the rule for that, but must be away from the other node.
    """
    own, other = np.tile(outer[item], 2), np.tile(inner[item], 2)
    at_start = np.repeat([True, False], item.size)
    node = np.where(at_start, panels.start[own], panels.end[own])
    number = np.where(at_start, panels.start_node[own], panels.end_node[own])
    reach = (panels.reach(SEPARATION) * panels.half)[own]
    to_start, to_end = node - panels.start[other], node - panels.end[other]
    meets_start, meets_end = number == panels.start_node[other], number == panels.end_node[other]

    def is_clear(half: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
        centre = panels.offset(own[half], 0.5 * (low + high), at_start[half])
        distance, at_node = reach[half] * (high - low), low == 0.0
        start_is_clear = (np.abs(to_start[half] + centre) >= distance) | (at_node & meets_start[half])
        end_is_clear = (np.abs(to_end[half] + centre) >= distance) | (at_node & meets_end[half])
        return np.asarray(start_is_clear & end_is_clear)

    half, low, high = split_until(is_clear, own.size, 0.0, 0.5)
    order = np.argsort(half % max(item.size, 1), kind="stable")
    half, low, high = half[order], low[order], high[order]
    touches = (low == 0.0) & (meets_start | meets_end)[half]
    return _Pieces(np.tile(item, 2)[half], at_start[half], low, high, touches)


def _add(
    sums: FloatArray,
    panels: Panels,
    degrees: Degrees,
    outer: IntArray,
    inner: IntArray,
    rule: _Rule,
    n_inner_points: int | None,
) -> None:
    """Add sums over the points of a rule to (n_items, n_rows, n_outer_polynomials) those of their items.

    Curved inner elements that are far away take a Gauss rule of `n_inner_points`.
    """
    n_points = rule.fraction.shape[1]
    size = max(1, BATCH_POINTS // n_points)
    for batch in (slice(first, first + size) for first in range(0, rule.item.size, size)):
        item, at_start, fraction = rule.item[batch], rule.at_start[batch], rule.fraction[batch]
        own, other = outer[item, None], inner[item, None]
        node = np.where(at_start, panels.start[own], panels.end[own])
        offset = panels.offset(np.repeat(own, n_points), fraction.ravel(), at_start.ravel())
        from_start, from_end = ((node - end[other]).ravel() + offset for end in (panels.start, panels.end))
        other = np.repeat(other, n_points)
        if n_inner_points is None:
            values = inner_integrals(panels, degrees, other, from_start, from_end)
        else:
            zeta = local_coordinates(panels, other, from_start)
            values = far_inner(degrees, panels.polynomials(other), zeta, n_inner_points)
        rows = values.rows().reshape(-1, item.size, n_points)
        xi = np.where(at_start, 2.0 * fraction - 1.0, 1.0 - 2.0 * fraction)
        factors = rule.weight[batch] * kernels.legendre_values(sums.shape[2] - 1, xi)
        moments = rows.transpose(1, 0, 2) @ factors.transpose(1, 2, 0)
        begins = np.flatnonzero(np.diff(item, prepend=-1))
        if begins.size < item.size:
            item, moments = item[begins], np.add.reduceat(moments, begins, axis=0)
        sums[item] += moments


def _integrate_same(panels: Panels, degrees: Degrees, elements: IntArray) -> PairIntegrals:
    """Integrate elements against themselves: the logarithm scales from the unit element, bending adds smooth parts."""
    result = PairIntegrals.zeros(degrees, (elements.size,))
    if panels.curved is None or bool(panels.is_straight[elements].all()):
        result.quotient[:1, :1] = 4.0
    else:
        coefficients = panels.curved.about_centre[:, elements]
        points, weights = gauss_legendre(N_SMOOTH + degrees.extra_points)
        inner = [bending(degrees, coefficients, np.full(elements.size, xi + 0j)) for xi in points]
        result = PairIntegrals.summed(degrees, points, weights, inner)
    for a, b in np.ndindex(*result.log.shape[:2]):
        result.log[a, b] += kernels.log_on_itself(a, b)
    result.scale(panels.half[elements], panels.half[elements], panels.tangent[elements])
    return result
