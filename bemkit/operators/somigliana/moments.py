r"""Integrals over straight elements for points off the boundary, from which interior fields are computed.

Let rho = x - y, rho* its conjugate, tau the unit tangent at y, t the local coordinate of the element, and p the
Legendre polynomials P_0, P_1, ... of t, or the powers of t - e for points close to an end e of the element:

    log          int p log|rho| ds          quotient     int p rho / rho* ds
    cauchy       int p tau / rho ds         turn         int p (rho tau* / rho*^2 - tau / rho*) ds
    reciprocal   int p / rho ds             spread       int p rho / rho*^2 ds
    hyper        int p tau / rho^2 ds       twist        int p (tau / rho*^2 - 2 rho tau* / rho*^3) ds

With the local coordinate zeta = xi + i eta of x, they are combinations of

    C_k = int P_k / (zeta - t) dt,  G_k = int P_k / (zeta - t)^2 dt,  H_k = int P_k / (zeta - t)^3 dt
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators import kernels
from bemkit.operators.element_geometry import ElementGeometry

CENTRE, START, END = 0, 1, 2
"""Origins of the expansion of densities."""
AT_END = 0.5
"""Distance of a point from an end, in half lengths, below which densities are expanded about that end."""


@dataclass(frozen=True, eq=False)
class DisplacementMoments:
    """Integrals for displacements, arrays (n_polynomials, n_pairs); `measure` is the integral of P_k ds."""

    log: FloatArray
    measure: FloatArray
    quotient: ComplexArray
    cauchy: ComplexArray
    turn: ComplexArray


@dataclass(frozen=True, eq=False)
class GradientMoments:
    """Integrals for displacement gradients and stresses, arrays (n_polynomials, n_pairs).

    Densities are expanded in Legendre polynomials if `origin` (n_pairs,) is `CENTRE`, and in powers of t + 1 or t - 1
    if it is `START` or `END`. Without the expansion about an end, the contributions of the two elements that meet in a
    close node would lose digits.
    """

    origin: IntArray
    reciprocal: ComplexArray
    spread: ComplexArray
    hyper: ComplexArray
    twist: ComplexArray


def local_moments(plus: ComplexArray, minus: ComplexArray, highest: int, n_orders: int) -> list[ComplexArray]:
    """Return the first `n_orders` of C_k, G_k, H_k for k = 0 ... highest, at any distance from the element.

    Parameters
    ----------
    plus, minus : complex arrays
        zeta + 1 and zeta - 1, each computed from the position relative to its end.
    highest : int
        Highest degree.
    n_orders : int
        1 for C, 2 for C and G, 3 for C, G and H.

    Notes
    -----
    G_k = -C_k' and H_k = C_k'' / 2 follow without cancellation from (zeta^2 - 1) C_k' = k (zeta C_k - C_{k-1}) and from
    the differential equation of the Legendre polynomials [DLMF, 14.10.5 and 14.2.1].
    """
    integrals, _ = kernels.near_integrals(plus, minus, highest)
    result = [integrals]
    zeta = kernels.local_coordinate(plus, minus)
    product = plus * minus
    if n_orders > 1:
        pairs = zip(range(1, highest + 1), integrals[1:], integrals, strict=False)
        result.append(np.stack([2.0 / product, *(k * (below - zeta * c_k) / product for k, c_k, below in pairs)]))
    if n_orders > 2:
        pairs = zip(range(highest + 1), integrals, result[1], strict=True)
        result.append(np.stack([(zeta * g_k + 0.5 * k * (k + 1) * c_k) / product for k, c_k, g_k in pairs]))
    return result


def straight_displacement_moments(
    geometry: ElementGeometry, x: ComplexArray, elements: IntArray, highest: int, length: float
) -> DisplacementMoments:
    """Return the moments of straight elements for displacements, in closed form.

    Parameters
    ----------
    geometry : ElementGeometry
    x : (n_pairs,) complex array [m]
        Points, none on its element.
    elements : (n_pairs,) int array
    highest : int
        Highest degree.
    length : float [m]
        Unit of length r0 in the logarithm.
    """
    plus, minus, eta = _local(geometry, x, elements)
    half, square = geometry.half[elements], geometry.tangent[elements] ** 2
    c, g = local_moments(plus, minus, highest + 1, 2)
    log_product = np.log(np.abs(plus)) + np.log(np.abs(minus))
    measure = np.zeros((highest + 1, half.size))
    measure[0] = 2.0 * half
    return DisplacementMoments(
        log=half * kernels.log_integrals(c, log_product) + measure * np.log(half / length),
        measure=measure,
        quotient=half * square * kernels.quotient_integrals(c[:-1], eta),
        cauchy=c[:-1],
        turn=np.stack([2j * eta * square * g_k.conj() for g_k in g[:-1]]),
    )


def straight_gradient_moments(
    geometry: ElementGeometry, x: ComplexArray, elements: IntArray, highest: int, at_end: float = AT_END
) -> GradientMoments:
    """Return the moments of straight elements for gradients; see `straight_displacement_moments`.

    For points within ``at_end`` half lengths of an end, densities are expanded about that end.
    """
    plus, minus, eta = _local(geometry, x, elements)
    half, tangent = geometry.half[elements], geometry.tangent[elements]
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
    """Replace Legendre polynomials by powers of t - e for chosen points with `zeta` relative to the end e."""
    for k in range(1, len(orders[0])):
        # the integral of (t - e)**(k - 1) over [-1, 1]
        moment = 2.0**k / k if end == START else -((-2.0) ** k) / k
        below: ComplexArray | float = moment
        for row in orders:
            row[k][chosen] = zeta[chosen] * row[k - 1][chosen] - below
            below = row[k - 1][chosen]


def _local(
    geometry: ElementGeometry, x: ComplexArray, elements: IntArray
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Return zeta + 1, zeta - 1 and eta, accurate near both ends."""
    to_local = geometry.to_local[elements]
    plus, minus = (x - geometry.start[elements]) * to_local, (x - geometry.end[elements]) * to_local
    return plus, minus, kernels.local_coordinate(plus, minus).imag
