"""Integrals of listed element pairs: separated by a few lengths, close, touching, or the same element."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_graded, gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.inner import N_SMOOTH, bending, far_inner, inner_integrals, local_coordinates
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.panels import Panels

SEPARATION = 3.0
"""A piece of the test element is integrated once its centre is this many of its half lengths from every singular
point."""
N_REGULAR = 10
N_TOUCHING = 20
MAX_SPLITS = 60
"""Pieces shorter than 2**-60 of an element carry nothing that a double can hold."""


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


class _Pieces:
    """Pieces [low, high] of test elements, as fractions of the length from one end node."""

    def __init__(self, pair: IntArray, low: FloatArray, high: FloatArray, touches: BoolArray) -> None:
        self.pair, self.low, self.high, self.touches = pair, low, high, touches

    def select(self, chosen: BoolArray) -> _Pieces:
        return _Pieces(self.pair[chosen], self.low[chosen], self.high[chosen], self.touches[chosen])


def _split(panels: Panels, test: IntArray, trial: IntArray, at_start: bool) -> _Pieces:
    """Bisect one half of each test element until every piece may be integrated by a single rule."""
    node = (panels.start if at_start else panels.end)[test]
    number = (panels.start_node if at_start else panels.end_node)[test]
    half = panels.half[test]
    separation = panels.reach(SEPARATION)[test]
    to_a, to_b = node - panels.start[trial], node - panels.end[trial]
    meets_a, meets_b = number == panels.start_node[trial], number == panels.end_node[trial]
    pair = np.arange(test.size)
    low, high = np.zeros(test.size), np.full(test.size, 0.5)
    done: list[_Pieces] = []
    for split in range(MAX_SPLITS + 1):
        centre = panels.offset(test[pair], 0.5 * (low + high), at_start)
        reach = (separation * half)[pair] * (high - low)
        at_node = low == 0.0
        a_is_clear, b_is_clear = np.abs(to_a[pair] + centre) >= reach, np.abs(to_b[pair] + centre) >= reach
        touches = at_node & (meets_a | meets_b)[pair]
        ready = (a_is_clear | (at_node & meets_a[pair])) & (b_is_clear | (at_node & meets_b[pair]))
        if split == MAX_SPLITS:
            ready[:] = True
        done.append(_Pieces(pair[ready], low[ready], high[ready], touches[ready]))
        rest = ~ready
        if not rest.any():
            break
        pair, low, high = pair[rest], low[rest], high[rest]
        middle = 0.5 * (low + high)
        pair, low, high = np.tile(pair, 2), np.concatenate([low, middle]), np.concatenate([middle, high])
    return _Pieces(
        *(np.concatenate([getattr(piece, name) for piece in done]) for name in ("pair", "low", "high", "touches"))
    )


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
    if panels.bent is None or bool(panels.is_straight[test].all()):
        result.quotient[:1, :1] = 4.0
    else:
        coefficients = panels.bent.about_centre[:, test]
        for xi, weight in zip(*gauss_legendre(N_SMOOTH + degrees.extra_points), strict=True):
            inner = bending(degrees, coefficients, np.full(test.size, xi + 0j))
            result.add(float(weight), float(xi), inner)
    for a, b in np.ndindex(*result.log.shape[:2]):
        result.log[a, b] += kernels.log_on_itself(a, b)
    result.scale(panels.half[test], panels.half[test], panels.tangent[test])
    return result
