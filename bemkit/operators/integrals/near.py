"""Integrals of listed element pairs: separated by a few lengths, close, touching, or the same element.

Close and touching pairs are split towards their common points [SauterSchwab2011], with closed forms inside.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_graded, gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.inner import N_SMOOTH, bending, far_inner, inner_integrals, local_coordinates
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.integrals.splitting import SEPARATION, split_until

N_REGULAR = 10
N_TOUCHING = 20


def integrate_separated(
    panels: Panels, degrees: Degrees, test: IntArray, trial: IntArray, n_points: int
) -> PairIntegrals:
    """Integrate pairs with a Gauss rule on the whole test element, and on the whole trial element if that is curved.

    Parameters
    ----------
    panels : Panels
    degrees : Degrees
    test, trial : (n,) arrays
        Element numbers of the pairs; the trial elements are either all straight or all curved.
    n_points : int
        Points on each element.
    """
    result = PairIntegrals.zeros(degrees, (test.size,))
    is_straight = bool(panels.is_straight[trial].all())
    polynomials = panels.polynomials(trial)
    points, weights = gauss_legendre(n_points)
    for at_start in (True, False):
        half = points < 0.0 if at_start else points >= 0.0
        xi, weight = points[half, None], weights[half, None]
        node = (panels.start if at_start else panels.end)[test]
        # all points at once, the pairs of one point after those of the other: few long arrays
        own, other = np.tile(test, xi.size), np.tile(trial, xi.size)
        offset = panels.offset(own, np.repeat(0.5 * (1.0 - np.abs(xi)), test.size), at_start)
        from_start = np.tile(node - panels.start[trial], xi.size) + offset
        from_end = np.tile(node - panels.end[trial], xi.size) + offset
        if is_straight:
            inner = inner_integrals(panels, degrees, other, from_start, from_end)
        else:
            zeta = local_coordinates(panels, other, from_start)
            inner = far_inner(degrees, np.tile(polynomials, xi.size), zeta, n_points)
        result.add_points(weight, xi, inner)
    result.scale(panels.half[test], panels.half[trial], panels.tangent[trial])
    return result


def integrate_near(panels: Panels, degrees: Degrees, test: IntArray, trial: IntArray) -> PairIntegrals:
    """Integrate close or touching pairs: the test element is split until each piece is away from both singular points.

    Parameters and result as in `integrate_separated`.

    Notes
    -----
    Each half of the test element is measured from its own end node, so that the distance to a shared node, and to a
    node at any small distance from it, is exact however small the piece.
    """
    result = PairIntegrals.zeros(degrees, (test.size,))
    pair = np.arange(test.size)
    for at_start in (True, False):
        pieces = _split(panels, test, trial, at_start)
        for n_points, chosen in ((N_REGULAR, ~pieces.touches), (N_TOUCHING, pieces.touches)):
            _integrate_pieces(result, panels, degrees, (test, trial, pair), pieces.select(chosen), n_points, at_start)
    result.scale(panels.half[test], panels.half[trial], panels.tangent[trial])
    return result


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Pieces [low, high] of test elements, as fractions of the length from one end node."""

    pair: IntArray
    low: FloatArray
    high: FloatArray
    touches: BoolArray

    def select(self, chosen: BoolArray) -> _Pieces:
        return _Pieces(self.pair[chosen], self.low[chosen], self.high[chosen], self.touches[chosen])


def _split(panels: Panels, test: IntArray, trial: IntArray, at_start: bool) -> _Pieces:
    """Bisect one half of each test element until every piece may be integrated by a single rule."""
    node = (panels.start if at_start else panels.end)[test]
    number = (panels.start_node if at_start else panels.end_node)[test]
    reach = (panels.reach(SEPARATION) * panels.half)[test]
    to_start, to_end = node - panels.start[trial], node - panels.end[trial]
    meets_start, meets_end = number == panels.start_node[trial], number == panels.end_node[trial]

    def is_clear(pair: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
        # a piece that begins at a common node takes the rule for that, but must be away from the other node
        centre = panels.offset(test[pair], 0.5 * (low + high), at_start)
        distance, at_node = reach[pair] * (high - low), low == 0.0
        start_is_clear = (np.abs(to_start[pair] + centre) >= distance) | (at_node & meets_start[pair])
        end_is_clear = (np.abs(to_end[pair] + centre) >= distance) | (at_node & meets_end[pair])
        return np.asarray(start_is_clear & end_is_clear)

    pair, low, high = split_until(is_clear, test.size, 0.0, 0.5)
    return _Pieces(pair, low, high, (low == 0.0) & (meets_start | meets_end)[pair])


def _integrate_pieces(
    result: PairIntegrals,
    panels: Panels,
    degrees: Degrees,
    pairs: tuple[IntArray, IntArray, IntArray],
    pieces: _Pieces,
    n_points: int,
    at_start: bool,
) -> None:
    """Add the integrals over some pieces to their pairs."""
    if not pieces.pair.size:
        return
    test, trial = pairs[0][pieces.pair], pairs[1][pieces.pair]
    sums = PairIntegrals.zeros(degrees, (test.size,))
    if n_points == N_TOUCHING:
        # the map of the rule multiplies degrees by four
        n_points += 4 * degrees.extra_points
        points, weights = gauss_graded(n_points)
    else:
        n_points += degrees.extra_points
        reference, reference_weights = gauss_legendre(n_points)
        points, weights = 0.5 * (reference + 1.0), 0.5 * reference_weights
    node = (panels.start if at_start else panels.end)[test]
    length = pieces.high - pieces.low
    fraction = pieces.low + points[:, None] * length
    xi = (2.0 * fraction - 1.0) * (1.0 if at_start else -1.0)
    own, other = np.tile(test, n_points), np.tile(trial, n_points)
    offset = panels.offset(own, fraction.ravel(), at_start)
    from_start = np.tile(node - panels.start[trial], n_points) + offset
    from_end = np.tile(node - panels.end[trial], n_points) + offset
    inner = inner_integrals(panels, degrees, other, from_start, from_end)
    sums.add_points(2.0 * weights[:, None] * length, xi, inner)
    for target, values in ((result.log, sums.log), (result.quotient, sums.quotient), (result.double, sums.double)):
        for index in np.ndindex(*values.shape[:2]):
            np.add.at(target[index], pieces.pair, values[index])


def integrate_same(panels: Panels, degrees: Degrees, test: IntArray) -> PairIntegrals:
    """Integrate elements against themselves: the logarithm scales from the unit element, bending adds smooth parts."""
    result = PairIntegrals.zeros(degrees, (test.size,))
    if panels.curved is None or bool(panels.is_straight[test].all()):
        result.quotient[:1, :1] = 4.0
    else:
        coefficients = panels.curved.about_centre[:, test]
        for xi, weight in zip(*gauss_legendre(N_SMOOTH + degrees.extra_points), strict=True):
            inner = bending(degrees, coefficients, np.full(test.size, xi + 0j))
            result.add(float(weight), float(xi), inner)
    for a, b in np.ndindex(*result.log.shape[:2]):
        result.log[a, b] += kernels.log_on_itself(a, b)
    result.scale(panels.half[test], panels.half[test], panels.tangent[test])
    return result
