r"""Integrals over single elements, seen from points off the boundary, that fields inside a body are made of.

With rho = x - y, rho* its conjugate, tau the unit tangent at y and t the local coordinate of the element, for the
powers k = 0, 1, ...:

    log          int t^k log|rho| ds        quotient     int t^k rho / rho* ds
    cauchy       int t^k tau / rho ds       turn         int t^k (rho tau* / rho*^2 - tau / rho*) ds
    reciprocal   int t^k / rho ds           spread       int t^k rho / rho*^2 ds
    hyper        int t^k tau / rho^2 ds     twist        int t^k (tau / rho*^2 - 2 rho tau* / rho*^3) ds

Straight elements have them in closed form: with the local coordinate zeta = xi + i eta of x, they are combinations of

    T_k = int t^k / (zeta - t) dt,  G_k = int t^k / (zeta - t)^2 dt,  H_k = int t^k / (zeta - t)^3 dt

Curved elements are bisected until each piece is well away from the point, and every piece takes one Gauss rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import comb

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.validity.chords import derivative_on, evaluate_curves, point_on
from bemkit.operators import kernels
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.integrals.splitting import SEPARATION, split_until

N_POINTS = 14
"""Gauss points of a piece: (3 + sqrt(8))**-28 is far below round-off, which leaves room for the third power of rho."""
CENTRE, START, END = 0, 1, 2
FAR = 6.0
"""Local distance |zeta| beyond which a series replaces the upward recursion of G and H."""
AT_END = 0.5
"""Points closer to an end of an element than this, in half lengths, see its densities expanded about that end."""


@dataclass(frozen=True, eq=False)
class DisplacementMoments:
    """What displacements need; every array is (n_powers, n_pairs), `measure` the integral of t^k ds."""

    log: FloatArray
    measure: FloatArray
    quotient: ComplexArray
    cauchy: ComplexArray
    turn: ComplexArray


@dataclass(frozen=True, eq=False)
class GradientMoments:
    """What displacement gradients and stresses need; every array is (n_powers, n_pairs).

    Powers are those of t - e, with e = 0, -1, 1 (`CENTRE`, `START`, `END`) as `origin` (n_pairs,) says: close to an end
    of an element the densities are expanded about it, or the two elements that meet there would cancel.
    """

    origin: IntArray
    reciprocal: ComplexArray
    spread: ComplexArray
    hyper: ComplexArray
    twist: ComplexArray


def local_moments(plus: ComplexArray, minus: ComplexArray, highest: int, n_orders: int) -> list[list[ComplexArray]]:
    """Return T_k, G_k, H_k (the first `n_orders` of them) for k = 0 ... highest, at any distance from the element.

    Parameters
    ----------
    plus, minus : complex arrays
        zeta + 1 and zeta - 1, each formed from the distance to its own end point.
    highest : int
        Highest power.
    n_orders : int
        1 for T alone, 2 for T and G, 3 for T, G and H.
    """
    integrals, _ = kernels.near_integrals(plus, minus, highest)
    # the Legendre coefficients of powers are positive: nothing cancels
    result = [list(np.tensordot(kernels.legendre_of_monomials(highest), np.stack(integrals), 1))]
    zeta = np.where(np.abs(plus) < np.abs(minus), plus - 1.0, minus + 1.0)
    product = plus * minus
    first = (2.0 / product, 2.0 * zeta / (product * product))
    far = np.minimum(np.abs(plus), np.abs(minus)) > FAR
    for order in range(1, n_orders):
        row = [first[order - 1]]
        for k in range(1, highest + 1):
            row.append(zeta * row[-1] - result[order - 1][k - 1])
        if far.any():
            _replace_far(row, result[order - 1], zeta, far, order)
        result.append(row)
    return result


def _replace_far(
    row: list[ComplexArray], below: list[ComplexArray], zeta: ComplexArray, far: BoolArray, order: int
) -> None:
    """Put in the series at far points, where the upward recursion would lose digits like |zeta|^(2k)."""
    inverse = 1.0 / zeta[far]
    highest = len(row) - 1
    first = highest % 2  # terms with j + highest odd vanish
    series = np.zeros_like(inverse)
    for j in range(first + 2 * (kernels.terms_needed(FAR - 1.0) + 2), first - 1, -2):
        series = series * inverse * inverse + 2.0 * comb(j + order, order) / (j + highest + 1)
    row[highest][far] = series * inverse ** (first + order + 1)
    for k in range(highest - 1, -1, -1):
        row[k][far] = (row[k + 1][far] + below[k][far]) * inverse


def straight_displacement_moments(
    panels: Panels, x: ComplexArray, elements: IntArray, highest: int, length: float
) -> DisplacementMoments:
    """Return the moments of straight elements for displacements, in closed form.

    Parameters
    ----------
    panels : Panels
    x : (n_pairs,) complex array [m]
        Points, none on its element.
    elements : (n_pairs,) int array
    highest : int
        Highest power.
    length : float [m]
        Unit of length r0 of the logarithm.
    """
    plus, minus, eta = _local(panels, x, elements)
    half, square = panels.half[elements], panels.tangent[elements] ** 2
    t, g = local_moments(plus, minus, highest + 1, 2)
    log_product = np.log(np.abs(plus)) + np.log(np.abs(minus))
    powers = range(highest + 1)
    constants = [2.0 / (k + 1) if k % 2 == 0 else 0.0 for k in powers]
    return DisplacementMoments(
        log=np.stack(
            [
                half
                * (m * np.log(half / length) + (log_product if m else -t[0].real) / (k + 1) + t[k + 1].real / (k + 1))
                for k, m in enumerate(constants)
            ]
        ),
        measure=np.stack([half * m for m in constants]),
        quotient=np.stack([half * square * (2j * eta * t[k].conj() + m) for k, m in enumerate(constants)]),
        cauchy=np.stack(t[: highest + 1]),
        turn=np.stack([2j * eta * square * g[k].conj() for k in powers]),
    )


def straight_gradient_moments(panels: Panels, x: ComplexArray, elements: IntArray, highest: int) -> GradientMoments:
    """Return the moments of straight elements for gradients; parameters as in `straight_displacement_moments`."""
    plus, minus, eta = _local(panels, x, elements)
    half, tangent = panels.half[elements], panels.tangent[elements]
    origin = np.where(np.abs(plus) < AT_END, START, np.where(np.abs(minus) < AT_END, END, CENTRE))
    orders = local_moments(plus, minus, max(1, highest), 3)
    for end, zeta in ((START, plus), (END, minus)):
        _expand_about_end(orders, zeta, np.flatnonzero(origin == end), end)
    t, g, h = (np.stack(row)[: highest + 1] for row in orders)
    cube = tangent * tangent * tangent
    return GradientMoments(
        origin=origin,
        reciprocal=tangent.conj() * t,
        spread=cube * (t.conj() + 2j * eta * g.conj()),
        hyper=(tangent.conj() / half) * g,
        twist=(-cube / half) * (g.conj() + 4j * eta * h.conj()),
    )


def _expand_about_end(orders: list[list[ComplexArray]], zeta: ComplexArray, chosen: IntArray, end: int) -> None:
    """Replace the powers of t by those of t - e at some points; `zeta` is their coordinate from that end."""
    for k in range(1, len(orders[0])):
        # the integral of (t - e)**(k - 1) over [-1, 1]
        moment = 2.0**k / k if end == START else -((-2.0) ** k) / k
        below: ComplexArray | float = moment
        for row in orders:
            row[k][chosen] = zeta[chosen] * row[k - 1][chosen] - below
            below = row[k - 1][chosen]


def _local(panels: Panels, x: ComplexArray, elements: IntArray) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return zeta + 1, zeta - 1 and eta, each exact near its end point."""
    to_local = panels.to_local[elements]
    plus, minus = (x - panels.start[elements]) * to_local, (x - panels.end[elements]) * to_local
    return plus, minus, np.where(np.abs(plus) < np.abs(minus), plus.imag, minus.imag)


class CurvedElements:
    """Quadrature over curved elements that follows how near a point is.

    Parameters
    ----------
    mesh : BoundaryMesh
        Curved where asked.
    origin : (2,) array [m]
        Complex coordinates are relative to it.
    """

    def __init__(self, mesh: BoundaryMesh, origin: FloatArray) -> None:
        self._curves = mesh.curves
        self._curve = np.zeros(0, np.intp) if mesh.element_curve is None else mesh.element_curve
        self._span = np.zeros((0, 2)) if mesh.element_span is None else mesh.element_span
        self._origin = complex(origin[0], origin[1])

    def place(self, elements: IntArray, xi: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return y and dy/dxi, (n, q), for (n,) elements at (n, q) local coordinates."""
        span = self._span[elements]
        s = span[:, :1] * (0.5 - 0.5 * xi) + span[:, 1:] * (0.5 + 0.5 * xi)
        curve = self._curve[elements]
        point = evaluate_curves(self._curves, curve, s, point_on)
        slope = evaluate_curves(self._curves, curve, s, derivative_on) * (0.5 * np.diff(span, axis=1))[..., None]
        return point[..., 0] + 1j * point[..., 1] - self._origin, slope[..., 0] + 1j * slope[..., 1]

    def displacement_moments(
        self, x: ComplexArray, elements: IntArray, highest: int, length: float
    ) -> DisplacementMoments:
        """Return the moments for displacements; parameters as in `straight_displacement_moments`."""

        def integrands(rho: ComplexArray, tau: ComplexArray) -> list[ComplexArray]:
            conjugate = rho.conj()
            return [
                np.log(np.abs(rho) / length) + 0j,
                np.ones_like(rho),
                rho / conjugate,
                tau / rho,
                (rho * tau.conj() / conjugate - tau) / conjugate,
            ]

        log, measure, quotient, cauchy, turn = self._integrate(x, elements, highest, integrands)
        return DisplacementMoments(log.real, measure.real, quotient, cauchy, turn)

    def gradient_moments(self, x: ComplexArray, elements: IntArray, highest: int) -> GradientMoments:
        """Return the moments for gradients; parameters as in `straight_displacement_moments`."""

        def integrands(rho: ComplexArray, tau: ComplexArray) -> list[ComplexArray]:
            conjugate = rho.conj()
            squared = conjugate * conjugate
            return [
                1.0 / rho,
                rho / squared,
                tau / (rho * rho),
                (tau - 2.0 * rho * tau.conj() / conjugate) / squared,
            ]

        return GradientMoments(np.full(x.size, CENTRE), *self._integrate(x, elements, highest, integrands))

    def angles(self, x: ComplexArray, elements: IntArray) -> FloatArray:
        """Return the angles (n,) [rad] under which the elements are seen, anticlockwise positive."""
        (cauchy,) = self._integrate(x, elements, 0, lambda rho, tau: [tau / rho])
        angles: FloatArray = -cauchy[0].imag
        return angles

    def _integrate(
        self,
        x: ComplexArray,
        elements: IntArray,
        highest: int,
        integrands: Callable[[ComplexArray, ComplexArray], list[ComplexArray]],
    ) -> list[ComplexArray]:
        """Integrate t^k times each integrand: a list of (highest + 1, n) arrays."""
        pair, low, high = self._split(x, elements)
        reference, weights = gauss_legendre(N_POINTS)
        xi = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * reference
        y, slope = self.place(elements[pair], xi)
        speed = np.abs(slope)
        measure = 0.5 * (high - low)[:, None] * weights * speed
        values = integrands(x[pair, None] - y, slope / speed)
        sums = [np.zeros((highest + 1, x.size), complex) for _ in values]
        for k in range(highest + 1):
            for total, value in zip(sums, values, strict=True):
                np.add.at(total[k], pair, np.sum(value * measure, axis=1))
            measure = measure * xi
        return sums

    def _split(self, x: ComplexArray, elements: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Bisect elements until each piece [low, high] is well away from its point."""

        def is_away(pair: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
            y, slope = self.place(elements[pair], 0.5 * (low + high)[:, None])
            away: BoolArray = np.abs(x[pair] - y[:, 0]) >= SEPARATION * 0.5 * (high - low) * np.abs(slope[:, 0])
            return away

        return split_until(is_away, x.size, -1.0, 1.0)
