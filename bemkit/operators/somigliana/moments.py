r"""Integrals over single elements, seen from points off the boundary, that fields inside a body are made of.

With rho = x - y, rho* its conjugate, tau the unit tangent at y, t the local coordinate of the element and p the
Legendre polynomials P_0, P_1, ... of t, or close to an end e of the element the powers of t - e:

    log          int p log|rho| ds          quotient     int p rho / rho* ds
    cauchy       int p tau / rho ds         turn         int p (rho tau* / rho*^2 - tau / rho*) ds
    reciprocal   int p / rho ds             spread       int p rho / rho*^2 ds
    hyper        int p tau / rho^2 ds       twist        int p (tau / rho*^2 - 2 rho tau* / rho*^3) ds

Straight elements have them in closed form: with the local coordinate zeta = xi + i eta of x, they are combinations of

    C_k = int P_k / (zeta - t) dt,  G_k = int P_k / (zeta - t)^2 dt,  H_k = int P_k / (zeta - t)^3 dt

Curved elements are bisected until each piece is well away from the point, and every piece takes one Gauss rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.operators import kernels
from bemkit.operators.integrals.panels import Panels
from bemkit.operators.integrals.splitting import SEPARATION, split_until

Integrands = Callable[[ComplexArray, ComplexArray], list[ComplexArray]]
"""Integrands as functions of rho and tau."""
N_POINTS = 14
"""Gauss points of a piece: (3 + sqrt(8))**-28 is far below round-off, which leaves room for the third power of rho."""
CENTRE, START, END = 0, 1, 2
AT_END = 0.5
"""Points closer to an end of an element than this, in half lengths, see its densities expanded about that end."""


@dataclass(frozen=True, eq=False)
class DisplacementMoments:
    """Integrals for displacements; every array is (n_polynomials, n_pairs), `measure` the integral of P_k ds."""

    log: FloatArray
    measure: FloatArray
    quotient: ComplexArray
    cauchy: ComplexArray
    turn: ComplexArray


@dataclass(frozen=True, eq=False)
class GradientMoments:
    """Integrals for displacement gradients and stresses; every array is (n_polynomials, n_pairs).

    Densities are sums of Legendre polynomials, or of powers of t - e with e = -1, 1, as `origin` (n_pairs,) says
    (`CENTRE`, `START`, `END`): close to an end of an element they are expanded about it, or the two elements that meet
    there would cancel.
    """

    origin: IntArray
    reciprocal: ComplexArray
    spread: ComplexArray
    hyper: ComplexArray
    twist: ComplexArray


def local_moments(plus: ComplexArray, minus: ComplexArray, highest: int, n_orders: int) -> list[ComplexArray]:
    """Return C_k, G_k, H_k (the first `n_orders` of them) for k = 0 ... highest, at any distance from the element.

    Parameters
    ----------
    plus, minus : complex arrays
        zeta + 1 and zeta - 1, each formed from the distance to its own end point.
    highest : int
        Highest degree.
    n_orders : int
        1 for C, 2 for C and G, 3 for C, G and H.

    Notes
    -----
    G_k = -C_k' and H_k = C_k'' / 2 follow from (zeta^2 - 1) C_k' = k (zeta C_k - C_{k-1}) and from the differential
    equation of the C_k, which is that of the Legendre polynomials [DLMF, 14.10.5 and 14.2.1]; nothing cancels.
    """
    integrals, _ = kernels.near_integrals(plus, minus, highest)
    result = [integrals]
    zeta = kernels.local_coordinate(plus, minus)
    product = plus * minus
    if n_orders > 1:
        pairs = zip(range(1, highest + 1), integrals[1:], integrals, strict=False)
        result.append(np.stack([2.0 / product, *(k * (below - zeta * own) / product for k, own, below in pairs)]))
    if n_orders > 2:
        pairs = zip(range(highest + 1), integrals, result[1], strict=True)
        result.append(np.stack([(zeta * slope + 0.5 * k * (k + 1) * own) / product for k, own, slope in pairs]))
    return result


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
        Highest degree.
    length : float [m]
        Unit of length r0 of the logarithm.
    """
    plus, minus, eta = _local(panels, x, elements)
    half, square = panels.half[elements], panels.tangent[elements] ** 2
    c, g = local_moments(plus, minus, highest + 1, 2)
    log_product = np.log(np.abs(plus)) + np.log(np.abs(minus))
    measure = np.stack([half * kernels.interval_moment(k) for k in range(highest + 1)])
    return DisplacementMoments(
        log=half * kernels.log_integrals(c, log_product) + measure * np.log(half / length),
        measure=measure,
        quotient=half * square * kernels.quotient_integrals(c[:-1], eta),
        cauchy=c[:-1],
        turn=np.stack([2j * eta * square * own.conj() for own in g[:-1]]),
    )


def straight_gradient_moments(
    panels: Panels, x: ComplexArray, elements: IntArray, highest: int, at_end: float = AT_END
) -> GradientMoments:
    """Return the moments of straight elements for gradients; parameters as in `straight_displacement_moments`.

    Points within ``at_end`` of an end, in halves of the element, have their powers about it.
    """
    plus, minus, eta = _local(panels, x, elements)
    half, tangent = panels.half[elements], panels.tangent[elements]
    origin = np.where(np.abs(plus) < at_end, START, np.where(np.abs(minus) < at_end, END, CENTRE))
    orders = local_moments(plus, minus, max(1, highest), 3)
    for end, zeta in ((START, plus), (END, minus)):
        _expand_about_end(orders, zeta, np.flatnonzero(origin == end), end)
    t, g, h = (row[: highest + 1] for row in orders)
    cube = tangent * tangent * tangent
    return GradientMoments(
        origin=origin,
        reciprocal=tangent.conj() * t,
        spread=cube * (t.conj() + 2j * eta * g.conj()),
        hyper=(tangent.conj() / half) * g,
        twist=(-cube / half) * (g.conj() + 4j * eta * h.conj()),
    )


def _expand_about_end(orders: list[ComplexArray], zeta: ComplexArray, chosen: IntArray, end: int) -> None:
    """Replace the Legendre polynomials by the powers of t - e at some points, `zeta` from that end."""
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
    return plus, minus, kernels.local_coordinate(plus, minus).imag


class ArcQuadrature:
    """Quadrature over curved elements that follows how near a point is.

    Parameters
    ----------
    mesh : BoundaryMesh
        Curved where asked.
    origin : (2,) array [m]
        Complex coordinates are relative to it.
    """

    def __init__(self, mesh: BoundaryMesh, origin: FloatArray) -> None:
        self._mesh, self._origin = mesh, complex(origin[0], origin[1])
        self._rules: dict[int, tuple[ComplexArray, ComplexArray]] = {}

    def place(self, elements: IntArray, xi: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return y and dy/dxi, (n, q), for (n,) elements at (q,) or (n, q) local coordinates."""
        plane = np.array([1.0, 1j])
        return self._mesh.points(elements, xi) @ plane - self._origin, self._mesh.derivatives(elements, xi) @ plane

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

    def _integrate(
        self,
        x: ComplexArray,
        elements: IntArray,
        highest: int,
        integrands: Integrands,
    ) -> list[ComplexArray]:
        """Integrate the Legendre polynomials times each integrand: a list of (highest + 1, n) arrays."""
        middle, slope = (values[elements, 0] for values in self._rule(1))
        is_far = _is_away(x, middle, slope, 2.0)
        sums = []
        for far, near in zip(
            self._integrate_whole(x[is_far], elements[is_far], highest, integrands),
            self._integrate_pieces(x[~is_far], elements[~is_far], highest, integrands),
            strict=True,
        ):
            total = np.empty((highest + 1, x.size), complex)
            total[:, is_far], total[:, ~is_far] = far, near
            sums.append(total)
        return sums

    def _integrate_whole(
        self, x: ComplexArray, elements: IntArray, highest: int, integrands: Integrands
    ) -> list[ComplexArray]:
        """Integrate over elements that are well away from their points; all points share the places on an element."""
        n_points = N_POINTS + highest // 2
        polynomials = kernels.legendre_weights(highest + 1, n_points)
        y, slope = (values[elements] for values in self._rule(n_points))
        speed = np.abs(slope)
        return [(value * speed @ polynomials.T).T for value in integrands(x[:, None] - y, slope / speed)]

    def _integrate_pieces(
        self, x: ComplexArray, elements: IntArray, highest: int, integrands: Integrands
    ) -> list[ComplexArray]:
        """Integrate over elements that are bisected until each piece is well away from its point."""
        pair, low, high = self._split(x, elements)
        reference, weights = gauss_legendre(N_POINTS + highest // 2)
        xi = 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * reference
        y, slope = self.place(elements[pair], xi)
        speed = np.abs(slope)
        measure = 0.5 * (high - low)[:, None] * weights * speed
        values = integrands(x[pair, None] - y, slope / speed)
        sums = [np.zeros((highest + 1, x.size), complex) for _ in values]
        for k, polynomial in enumerate(kernels.legendre_values(highest, xi)):
            for total, value in zip(sums, values, strict=True):
                np.add.at(total[k], pair, np.sum(value * measure * polynomial, axis=1))
        return sums

    def _rule(self, n_points: int) -> tuple[ComplexArray, ComplexArray]:
        """Return y and dy/dxi (n_elements, n_points) of every element, computed once."""
        if n_points not in self._rules:
            xi = gauss_legendre(n_points)[0]
            self._rules[n_points] = self.place(np.arange(self._mesh.n_elements), xi)
        return self._rules[n_points]

    def _split(self, x: ComplexArray, elements: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """Bisect elements until each piece [low, high] is well away from its point."""

        def is_away(pair: IntArray, low: FloatArray, high: FloatArray) -> BoolArray:
            y, slope = self.place(elements[pair], 0.5 * (low + high)[:, None])
            return _is_away(x[pair], y[:, 0], slope[:, 0], high - low)

        return split_until(is_away, x.size, -1.0, 1.0)


def _is_away(x: ComplexArray, middle: ComplexArray, slope: ComplexArray, length: FloatArray | float) -> BoolArray:
    """Return which pieces, of lengths in the local coordinate, are so far from their points that one rule serves."""
    away: BoolArray = np.abs(x - middle) >= SEPARATION * 0.5 * length * np.abs(slope)
    return away
