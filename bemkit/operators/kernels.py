r"""Integrals of polynomial densities on one straight element for a point.

Complex notation: the element runs from a to b with unit tangent tau, half length l and centre c. A point x has the
local coordinate zeta = (x - c) / (l tau), so that the element is the interval [-1, 1]. Let P_k be the Legendre
polynomials, with their Cauchy integrals

    C_k = int_{-1}^{1} P_k(t) / (zeta - t) dt = 2 Q_k(zeta),    C_0 = log((zeta + 1) / (zeta - 1)),

where Q_k is the Legendre function of the second kind [DLMF, 14.12.13]. For rho = x - y and m_k = int P_k dt, which is 2
for k = 0 and 0 otherwise, the integrals of elasticity are

    int P_k log|rho| ds        = l (m_k log l + Re (C_{k+1} - C_{k-1}) / (2 k + 1)),   k > 0
    int P_0 log|rho| ds        = l (m_0 log l + log|zeta^2 - 1| + Re C_1)
    int P_k rho / conj(rho) ds = l tau^2 (m_k + 2 i eta conj(C_k)),   eta = Im zeta
    int P_k k(x, y) ds         = Im C_k / (2 pi),   k = -(1/2 pi) d log|rho| / dn_y the Laplace double layer

The C_k are the minimal solution of the recurrence of the P_k, (k + 1) C_{k+1} = (2 k + 1) zeta C_k - k C_{k-1}. The
upward recurrence loses digits like r^(2 k), where r = |zeta + sqrt(zeta^2 - 1)| is the sum of the half axes of the
ellipse through zeta with foci -1 and 1; the downward recurrence gains them. So near points use the upward recurrence
from the logarithm, other points the downward recurrence from arbitrary values at a high k ([DLMF, 3.6]), and far points
the downward recurrence from the power series of the two highest C_k.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, read_only
from bemkit.geometry.quadrature import gauss_legendre

LOST = 30.0
"""Largest amplification of round-off by the upward recurrence."""
FAR = 12.0
"""Smallest r for which the power series takes fewer operations than the downward recurrence."""
BANDS = (1.6, 3.0, FAR, 1.0e2, math.inf)
"""Upper ends of bands of r; points of a band use the number of downward steps of its lower end."""
DIGITS = 17.0
"""Digits of the downward recurrence."""


def terms_needed(distance: float) -> int:
    """Return the number of terms of the series in 1 / zeta**2 for round-off at |zeta| >= distance > 1."""
    return max(1, math.ceil(16.5 / (2.0 * math.log10(distance))))


def far_integrals(zeta: ComplexArray, highest: int, n_terms: int) -> ComplexArray:
    """Return C_0 ... C_highest at points far from the element.

    Parameters
    ----------
    zeta : complex array
        Local coordinates.
    highest : int
        At least 1.
    n_terms : int
        Terms of the power series in 1 / zeta**2; see `terms_needed` for the smallest modulus of `zeta`.

    Returns
    -------
    (highest + 1, *shape of zeta) complex array
        C_0 ... C_highest, each to relative round-off.
    """
    integrals = np.empty((highest + 1, *zeta.shape), complex)
    inverse = 1.0 / zeta
    w = inverse * inverse
    # power series of the two highest, downward recurrence for the others, C_0 from C_1 = zeta C_0 - 2
    np.multiply(_series(highest, w, n_terms), w, out=integrals[highest])
    if highest > 1:
        power = inverse.copy()
        for _ in range(highest - 2):
            power *= inverse
        integrals[highest] *= power
        power *= inverse
        np.multiply(_series(highest - 1, w, n_terms), power, out=integrals[highest - 1])
    for k in range(highest - 1, 1, -1):
        np.multiply(zeta, integrals[k], out=integrals[k - 1])
        integrals[k - 1] *= (2 * k + 1) / k
        integrals[k - 1] -= ((k + 1) / k) * integrals[k + 1]
    np.add(integrals[1], 2.0, out=integrals[0])
    integrals[0] *= inverse
    return integrals


def _series(k: int, w: ComplexArray, n_terms: int) -> ComplexArray:
    """Return zeta**(k + 1) C_k as a power series in w = 1 / zeta**2 [DLMF, 14.3.7 and 15.2.1]."""
    coefficients = [2.0 * math.factorial(k) / math.prod(range(1, 2 * k + 2, 2))]
    for j in range(n_terms - 1):
        factor = (k + 1 + 2 * j) * (k + 2 + 2 * j) / (2.0 * (j + 1) * (2 * k + 3 + 2 * j))
        coefficients.append(coefficients[-1] * factor)
    result = np.full_like(w, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        result *= w
        result += coefficient
    return result


def far_log_product(zeta: ComplexArray) -> FloatArray:
    """Return log|zeta**2 - 1| for |zeta| well above 1."""
    product = zeta * zeta
    product -= 1.0
    squared: FloatArray = np.square(product.real)
    squared += np.square(product.imag)
    np.log(squared, out=squared)
    squared *= 0.5
    return squared


def near_integrals(plus: ComplexArray, minus: ComplexArray, highest: int) -> tuple[ComplexArray, FloatArray]:
    """Return the Cauchy integrals for points at any distance from the element, exact to round-off.

    Parameters
    ----------
    plus, minus : (n,) complex arrays
        zeta + 1 and zeta - 1, each computed from the position relative to its end and accurate near it.
    highest : int
        Highest degree.

    Returns
    -------
    integrals : (highest + 1, n) complex array
        C_0 ... C_highest; -Im C_0 is the angle between the lines from the point to both ends, in (-pi, pi].
    log_product : (n,) array
        log|zeta^2 - 1|.
    """
    zeta = local_coordinate(plus, minus)
    integrals = np.empty((highest + 1, zeta.size), complex)
    integrals[0], log_product = _logarithm(plus, minus, zeta)
    if highest:
        np.multiply(zeta, integrals[0], out=integrals[1])
        integrals[1] -= 2.0
        for k in range(1, highest):
            np.multiply(zeta, integrals[k], out=integrals[k + 1])
            integrals[k + 1] *= (2 * k + 1) / (k + 1)
            integrals[k + 1] -= (k / (k + 1)) * integrals[k - 1]
        _replace_far(integrals, zeta, _sum_of_half_axes(plus, minus))
    return integrals, log_product


def local_coordinate(plus: ComplexArray, minus: ComplexArray) -> ComplexArray:
    """Return zeta from the smaller of zeta + 1 and zeta - 1, accurate near both ends."""
    zeta: ComplexArray = np.where(np.abs(plus) < np.abs(minus), plus - 1.0, minus + 1.0)
    return zeta


def _logarithm(plus: ComplexArray, minus: ComplexArray, zeta: ComplexArray) -> tuple[ComplexArray, FloatArray]:
    """Return log((zeta + 1) / (zeta - 1)) and log|zeta**2 - 1|."""
    abs_plus, abs_minus, xi, eta = np.abs(plus), np.abs(minus), zeta.real, zeta.imag
    result = np.empty(plus.shape, complex)
    # angle between the lines from the point to both ends
    np.negative(np.arctan2(2.0 * eta, plus.real * minus.real + eta * eta), out=result.imag)
    # |zeta + 1|^2 - |zeta - 1|^2 = 4 xi: log1p avoids the difference of two nearly equal logarithms
    squared = abs_minus * abs_minus
    ratio = np.divide(4.0 * xi, squared, out=np.zeros_like(xi), where=np.abs(xi) < squared / 8.0)
    log_plus, log_minus = np.log(abs_plus, out=abs_plus), np.log(abs_minus, out=abs_minus)
    result.real = np.where(ratio != 0.0, 0.5 * np.log1p(ratio), log_plus - log_minus)
    return result, log_plus + log_minus


def _sum_of_half_axes(plus: ComplexArray, minus: ComplexArray) -> FloatArray:
    """Return r from the distances to the foci, whose mean is one half axis."""
    axis = np.abs(plus)
    axis += np.abs(minus)
    axis *= 0.5
    other = np.sqrt(np.maximum((axis - 1.0) * (axis + 1.0), 0.0))
    other += axis
    return other


def _replace_far(integrals: ComplexArray, zeta: ComplexArray, size: FloatArray) -> None:
    """Replace the integrals where the upward recurrence loses digits; `size` is r."""
    highest = len(integrals) - 1
    lower = LOST ** (0.5 / highest)
    for upper in BANDS:
        chosen = np.flatnonzero((size > lower) & (size <= upper))
        if chosen.size and lower < FAR:
            steps = math.ceil(DIGITS / (2.0 * math.log10(lower)))
            integrals[1:, chosen] = _downward(zeta[chosen], integrals[0, chosen], highest, steps)
        elif chosen.size:
            # |zeta| >= (r - 1 / r) / 2
            n_terms = terms_needed(0.5 * (lower - 1.0 / lower))
            integrals[:, chosen] = far_integrals(zeta[chosen], highest, n_terms)
        lower = max(lower, upper)


def _downward(zeta: ComplexArray, first: ComplexArray, highest: int, steps: int) -> ComplexArray:
    """Return C_1 ... C_highest from C_0 by the downward recurrence, which begins `steps` above with 0 and 1.

    For C_k / f_k with the factors f_k = f_{k-1} k / (2 k + 1), a step is one product and one difference.
    """
    above, value = np.zeros_like(zeta), np.ones_like(zeta)
    integrals = np.empty((highest, zeta.size), complex)
    for k in range(highest + steps, 0, -1):
        if k <= highest:
            integrals[k - 1] = value
        above *= -((k + 1) ** 2) / (4.0 * (k + 1) ** 2 - 1.0)
        above += zeta * value
        above, value = value, above
    scaled = first / value
    for k, integral in enumerate(integrals, start=1):
        scaled *= k / (2.0 * k + 1.0)
        integral *= scaled
    return integrals


def log_integrals(integrals: ComplexArray, log_product: FloatArray) -> FloatArray:
    """Return Re int P_k log(zeta - t) dt: the log integrals of an element of half length 1.

    Parameters
    ----------
    integrals : (highest + 2, ...) complex array
        C_0 ... C_{highest + 1}.
    log_product : array
        log|zeta**2 - 1|.

    Returns
    -------
    (highest + 1, ...) array
    """
    result = np.empty((len(integrals) - 1, *log_product.shape))
    for k, values in enumerate(result):
        if k:
            np.subtract(integrals[k + 1].real, integrals[k - 1].real, out=values)
            values /= 2 * k + 1
        else:
            np.add(log_product, integrals[1].real, out=values)
    return result


def quotient_integrals(integrals: ComplexArray, eta: FloatArray) -> ComplexArray:
    """Return int P_k rho / conj(rho) dt for an element of half length 1 along the real axis."""
    twice = 2.0 * eta
    result = np.empty(integrals.shape, complex)
    np.multiply(integrals.imag, twice, out=result.real)
    np.multiply(integrals.real, twice, out=result.imag)
    result[:1] += 2.0  # m_0
    return result


def log_on_itself(a: int, b: int) -> float:
    """Return the integral of P_a(s) P_b(t) log|s - t| over [-1, 1]**2, from int P_a Q_c [DLMF, 14.17.8]."""
    if a == b == 0:
        return 4.0 * math.log(2.0) - 6.0
    if (a + b) % 2:
        return 0.0
    low, high = sorted((a, b))
    # int P_a Q_c = 2 / ((a - c) (a + c + 1)) for odd a - c; the inner integral is 2 (Q_{b+1} - Q_{b-1}) / (2 b + 1)
    products = [2.0 / ((low - c) * (c + low + 1)) for c in (high + 1, high - 1)]
    return 2.0 * (products[0] - products[1]) / (2 * high + 1)


@lru_cache(maxsize=64)
def legendre_weights(n_polynomials: int, n_points: int) -> FloatArray:
    """Return the read-only products of P_0, P_1, ... at Gauss points and weights, (n_polynomials, n_points)."""
    points, weights = gauss_legendre(n_points)
    return read_only(weights * legendre_values(max(n_polynomials - 1, 0), points)[:n_polynomials])


def legendre_values(highest: int, t: FloatArray | float) -> FloatArray:
    """Return P_0 ... P_highest at points t of [-1, 1], (highest + 1, ...) with the shape of t behind."""
    values = np.polynomial.legendre.legvander(np.asarray(t, float), highest)
    return np.moveaxis(values, -1, 0).reshape(highest + 1, *np.shape(t))
