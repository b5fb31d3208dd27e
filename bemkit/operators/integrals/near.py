"""Integrals of listed element pairs: separated by a few lengths, close, touching, or coincident.

For two straight elements the outer integral is that over the shorter one, whether it is the test or the trial element:
fewer Gauss points are then accurate, and the closed forms on the longer element serve both orders. Close and touching
pairs are split towards their common points [SauterSchwab2011].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray, IntArray, consecutive_runs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry
from bemkit.operators.integrals.inner import N_SMOOTH, bending, far_inner, inner_integrals, local_coordinates
from bemkit.operators.integrals.outer_rules import (
    GAUSS_LEVELS,
    LevelArray,
    OuterRule,
    batches,
    gauss_levels,
    split_rules,
)
from bemkit.operators.integrals.pairs import Degrees, Inner, PairIntegrals

BATCH_POINTS = 8192
"""Outer points of a batch, whose integrals stay in the cache."""


def integrate_listed(
    geometry: ElementGeometry, degrees: Degrees, test: IntArray, trial: IntArray
) -> tuple[PairIntegrals, IntArray]:
    """Integrate pairs of elements, each with a rule that suits its distance.

    Parameters
    ----------
    geometry : ElementGeometry
    degrees : Degrees
    test, trial : (n,) arrays
        Elements of the pairs.

    Returns
    -------
    integrals : PairIntegrals
        Integrals of distinct pairs, sorted by kind.
    slots : (n,) int array
        Position of the integrals of each pair.

    Notes
    -----
    Three permutations lead from a pair to its slot: both orders of two straight elements are one distinct pair;
    distinct pairs are sorted by their rule; reversed pairs and coincident elements follow behind.
    """
    half, n_elements = geometry.half, geometry.half.size
    is_same = test == trial
    is_reversed = (half[test] > half[trial]) | ((half[test] == half[trial]) & (test > trial))
    is_reversed &= geometry.is_straight[test] & geometry.is_straight[trial]
    # distinct pairs (outer, inner); coincident elements share one last key and are treated below
    keys = np.where(is_reversed, trial * n_elements + test, test * n_elements + trial)
    keys[is_same] = n_elements**2
    distinct_keys, slots = np.unique(keys, return_inverse=True)
    outer, inner = np.divmod(distinct_keys[: np.searchsorted(distinct_keys, n_elements**2)], n_elements)
    # sorted by rule
    levels = gauss_levels(geometry, outer, inner)
    order = np.argsort(levels, kind="stable")
    slots = np.append(np.argsort(order), 0)[slots]
    direct, reverse = _integrate_different(geometry, degrees.either_way, outer[order], inner[order], levels[order])
    # reversed pairs, then coincident straight and curved elements
    parts = [direct]
    if is_reversed.any():
        parts.append(reverse)
        slots[is_reversed] += direct.size
    is_straight = geometry.is_straight[trial]
    for same in (np.flatnonzero(is_same & is_straight), np.flatnonzero(is_same & ~is_straight)):
        slots[same] = sum(part.size for part in parts) + np.arange(same.size)
        parts.append(_integrate_same(geometry, degrees, test[same]))
    return PairIntegrals.concatenated(degrees, parts), slots


def _integrate_different(
    geometry: ElementGeometry, degrees: Degrees, outer: IntArray, inner: IntArray, level: LevelArray
) -> tuple[PairIntegrals, PairIntegrals]:
    """Integrate pairs with test elements `outer` and trial elements `inner`, and the reversed pairs if straight."""
    half, tangent = geometry.half, geometry.tangent
    sums = Inner.from_rows(degrees, _outer_sums(geometry, degrees, outer, inner, level))
    sums.log[:1, :1] += 4.0 * np.log(half[inner])
    measure = half[outer] * half[inner]
    log, quotient = measure * sums.log, (measure * tangent[inner] ** 2) * sums.quotient
    cauchy = (half[outer] / (2.0 * np.pi)) * sums.cauchy
    # with the normal n = -i tangent at y, k = Re(n / (x - y)) / (2 pi)
    reverse = -((tangent[outer] * tangent[inner].conj()) * cauchy).imag
    # the first axis of the sums is the degree on the inner element
    return PairIntegrals(log, quotient, cauchy.imag).transposed, PairIntegrals(log, quotient, reverse)


def _outer_sums(
    geometry: ElementGeometry, degrees: Degrees, outer: IntArray, inner: IntArray, level: LevelArray
) -> FloatArray:
    """Integrate the rows of `Inner` over the outer elements; return (n_rows, n_outer_polynomials, n)."""
    (n_log, n_double), extra_points = degrees.n_trial, degrees.extra_points
    sums = np.zeros((3 * n_log + 2 * n_double, max(n_log, n_double), outer.size))
    is_straight = geometry.is_straight[inner]

    def add(rules: Sequence[OuterRule], n_inner_points: int | None) -> None:
        for batch in batches(rules, BATCH_POINTS):
            values = _inner_rows(geometry, degrees, outer, inner, batch, n_inner_points)
            ends = np.cumsum([rule.n_points for rule in batch])[:-1]
            for rule, rule_values in zip(batch, np.split(values, ends, axis=1), strict=True):
                item, moments = rule.moments(rule_values, sums.shape[1])
                for positions, items in consecutive_runs(item):
                    sums[..., items] += moments[..., positions]

    wholes = [
        OuterRule.whole(np.flatnonzero(is_straight & (level == index)), n_points + extra_points)
        for index, (n_points, _) in enumerate(GAUSS_LEVELS)
    ]
    is_close = level == len(GAUSS_LEVELS)
    add([*wholes, *split_rules(geometry, outer, inner, np.flatnonzero(is_straight & is_close), extra_points)], None)
    if geometry.curved is not None:
        for index, (n_points, _) in enumerate(GAUSS_LEVELS):
            n_points += extra_points
            add([OuterRule.whole(np.flatnonzero(~is_straight & (level == index)), n_points)], n_points)
        add(split_rules(geometry, outer, inner, np.flatnonzero(~is_straight & is_close), extra_points), None)
    return sums


def _inner_rows(
    geometry: ElementGeometry,
    degrees: Degrees,
    outer: IntArray,
    inner: IntArray,
    rules: Sequence[OuterRule],
    n_inner_points: int | None,
) -> FloatArray:
    """Return the rows of `Inner` at the points of some rules.

    With `n_inner_points` the inner integrals are Gauss rules, for far curved elements.
    """
    item, at_start, fraction = (np.concatenate(part) for part in zip(*(rule.points for rule in rules), strict=True))
    outer_element, inner_element = outer[item], inner[item]
    node = np.where(at_start, geometry.start[outer_element], geometry.end[outer_element])
    offset = geometry.offset(outer_element, fraction, at_start)
    from_start, from_end = (node - end[inner_element] + offset for end in (geometry.start, geometry.end))
    if n_inner_points is None:
        return inner_integrals(geometry, degrees, inner_element, from_start, from_end).rows()
    zeta = local_coordinates(geometry, inner_element, from_start)
    return far_inner(degrees, geometry.polynomials(inner_element), zeta, n_inner_points).rows()


def _integrate_same(geometry: ElementGeometry, degrees: Degrees, elements: IntArray) -> PairIntegrals:
    """Integrate coincident elements: closed forms of the unit element, scaled, plus smooth parts of curved elements."""
    result = PairIntegrals.zeros(degrees, (elements.size,))
    if geometry.curved is None or bool(geometry.is_straight[elements].all()):
        result.quotient[:1, :1] = 4.0
    else:
        coefficients = geometry.curved.about_centre[:, elements]
        points, _ = gauss_legendre(N_SMOOTH + degrees.extra_points)
        inner = [bending(degrees, coefficients, np.full(elements.size, xi + 0j)) for xi in points]
        result = PairIntegrals.summed(degrees, inner)
    for a, b in np.ndindex(*result.log.shape[:2]):
        result.log[a, b] += kernels.log_on_itself(a, b)
    result.scale(geometry.half[elements], geometry.half[elements], geometry.tangent[elements])
    return result
