"""Integrals of listed element pairs: separated by a few lengths, close, touching, or the same element.

Of two straight elements the shorter one takes the outer rule, whichever is the test element: seen from there the other
one is far away sooner, and its closed forms serve both ways. Close and touching pairs are split towards their common
points [SauterSchwab2011].
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray, IntArray, consecutive_runs
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
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
from bemkit.operators.integrals.panels import Panels

BATCH_POINTS = 8192
"""Outer points treated at once: their integrals stay in the cache."""


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
    # both orders of two elements share their integrals; those of elements with themselves come last and are excluded
    numbers = np.where(is_turned, trial * n_elements + test, test * n_elements + trial)
    numbers[is_same] = n_elements**2
    different, places = np.unique(numbers, return_inverse=True)
    outer, inner = np.divmod(different[: np.searchsorted(different, n_elements**2)], n_elements)
    levels = gauss_levels(panels, outer, inner)
    order = np.argsort(levels, kind="stable")  # those of one rule in one piece
    places = np.append(np.argsort(order), 0)[places]
    direct, turned = _integrate_different(panels, degrees.either_way, outer[order], inner[order], levels[order])
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
    panels: Panels, degrees: Degrees, outer: IntArray, inner: IntArray, level: LevelArray
) -> tuple[PairIntegrals, PairIntegrals]:
    """Integrate pairs of two elements as tests and trials (outer, inner) and, if straight, the other way round."""
    half, tangent = panels.half, panels.tangent
    sums = Inner.from_rows(degrees, _outer_sums(panels, degrees, outer, inner, level))
    sums.log[:1, :1] += 4.0 * np.log(half[inner])
    measure = half[outer] * half[inner]
    log, quotient = measure * sums.log, (measure * tangent[inner] ** 2) * sums.quotient
    cauchy = (half[outer] / (2.0 * np.pi)) * sums.cauchy
    # with the normal n = -i tangent at y, k = Re(n / (x - y)) / (2 pi)
    turned = -((tangent[outer] * tangent[inner].conj()) * cauchy).imag
    # the sums are by the polynomials of the inner element first
    return PairIntegrals(log, quotient, cauchy.imag).swapped, PairIntegrals(log, quotient, turned)


def _outer_sums(panels: Panels, degrees: Degrees, outer: IntArray, inner: IntArray, level: LevelArray) -> FloatArray:
    """Return the (n_rows, n_outer_polynomials, n) sums of the rows of `Inner` over the rules of the outer elements."""
    (n_log, n_double), extra_points = degrees.n_trial, degrees.extra_points
    sums = np.zeros((3 * n_log + 2 * n_double, max(n_log, n_double), outer.size))
    is_straight = panels.is_straight[inner]

    def add(rules: Sequence[OuterRule], n_inner_points: int | None) -> None:
        for batch in batches(rules, BATCH_POINTS):
            values = _inner_rows(panels, degrees, outer, inner, batch, n_inner_points)
            ends = np.cumsum([rule.n_points for rule in batch])[:-1]
            for rule, own in zip(batch, np.split(values, ends, axis=1), strict=True):
                item, moments = rule.moments(own, sums.shape[1])
                for positions, items in consecutive_runs(item):
                    sums[..., items] += moments[..., positions]

    wholes = [
        OuterRule.whole(np.flatnonzero(is_straight & (level == number)), n_points + extra_points)
        for number, (n_points, _) in enumerate(GAUSS_LEVELS)
    ]
    is_close = level == len(GAUSS_LEVELS)
    add([*wholes, *split_rules(panels, outer, inner, np.flatnonzero(is_straight & is_close), extra_points)], None)
    if panels.curved is not None:
        for number, (n_points, _) in enumerate(GAUSS_LEVELS):
            n_points += extra_points
            add([OuterRule.whole(np.flatnonzero(~is_straight & (level == number)), n_points)], n_points)
        add(split_rules(panels, outer, inner, np.flatnonzero(~is_straight & is_close), extra_points), None)
    return sums


def _inner_rows(
    panels: Panels,
    degrees: Degrees,
    outer: IntArray,
    inner: IntArray,
    rules: Sequence[OuterRule],
    n_inner_points: int | None,
) -> FloatArray:
    """Return the rows of `Inner` at the points of some rules, one after the other.

    Curved inner elements that are far away take a Gauss rule of `n_inner_points`.
    """
    item, at_start, fraction = (np.concatenate(each) for each in zip(*(rule.points for rule in rules), strict=True))
    own, other = outer[item], inner[item]
    node = np.where(at_start, panels.start[own], panels.end[own])
    offset = panels.offset(own, fraction, at_start)
    from_start, from_end = (node - end[other] + offset for end in (panels.start, panels.end))
    if n_inner_points is None:
        return inner_integrals(panels, degrees, other, from_start, from_end).rows()
    zeta = local_coordinates(panels, other, from_start)
    return far_inner(degrees, panels.polynomials(other), zeta, n_inner_points).rows()


def _integrate_same(panels: Panels, degrees: Degrees, elements: IntArray) -> PairIntegrals:
    """Integrate elements against themselves: the logarithm scales from the unit element, bending adds smooth parts."""
    result = PairIntegrals.zeros(degrees, (elements.size,))
    if panels.curved is None or bool(panels.is_straight[elements].all()):
        result.quotient[:1, :1] = 4.0
    else:
        coefficients = panels.curved.about_centre[:, elements]
        points, _ = gauss_legendre(N_SMOOTH + degrees.extra_points)
        inner = [bending(degrees, coefficients, np.full(elements.size, xi + 0j)) for xi in points]
        result = PairIntegrals.summed(degrees, inner)
    for a, b in np.ndindex(*result.log.shape[:2]):
        result.log[a, b] += kernels.log_on_itself(a, b)
    result.scale(panels.half[elements], panels.half[elements], panels.tangent[elements])
    return result
