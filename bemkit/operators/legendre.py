r"""Legendre polynomials on one straight element, seen from a point: their Cauchy integrals, to round-off everywhere.

In the local coordinate zeta of `bemkit.operators.kernels` the element is the interval [-1, 1], and

    C_k(zeta) = int_{-1}^{1} P_k(t) / (zeta - t) dt = 2 Q_k(zeta),

twice the Legendre function of the second kind (DLMF 14.7, Neumann's formula). All of them satisfy the recurrence of the
Legendre polynomials, (k + 1) C_{k+1} = (2 k + 1) zeta C_k - k C_{k-1}, of which they are the smallest solution: upward
it loses digits like r^(2 k), where r = |zeta + sqrt(zeta^2 - 1)| is the sum of the half axes of the ellipse with foci
-1 and 1 through zeta, and downward it gains them. So points close to the element take it upwards from the logarithm,
the others downwards (Miller's algorithm, DLMF 3.6), and points far away from the power series of the two highest.
"""

from __future__ import annotations

import math

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray

LOST = 30.0
"""Factor of round-off that the upward recurrence may lose before the downward one takes over."""
BANDS = (1.6, 3.0, 1.0e2, 1.0e8)
"""Upper ends of the bands of r whose points go through the downward recurrence together, with as many steps as the
lower end needs."""
DIGITS = 17.0


def from_ends(plus: ComplexArray, minus: ComplexArray, highest: int) -> tuple[list[ComplexArray], FloatArray]:
    """Return C_0 ... C_highest at points at any distance from the element, exact to round-off.

    Parameters
    ----------
    plus, minus : (n,) complex arrays
        zeta + 1 and zeta - 1, each formed from the distance to its own end point so that it is exact near that end.
    highest : int

    Returns
    -------
    integrals : list of (n,) complex arrays
        C_0 ... C_highest. The angle -Im C_0 is the one under which the element is seen, in (-pi, pi].
    log_product : (n,) array
        log|zeta**2 - 1|.
    """
    abs_plus, abs_minus = np.abs(plus), np.abs(minus)
    log_plus, log_minus = np.log(abs_plus), np.log(abs_minus)
    near_start = abs_plus < abs_minus
    zeta = np.where(near_start, plus - 1.0, minus + 1.0)
    eta = np.where(near_start, plus.imag, minus.imag)
    # |zeta + 1|^2 - |zeta - 1|^2 = 4 Re zeta: log1p keeps the digits of the difference of two nearly equal logarithms
    is_even = np.abs(zeta.real) < abs_minus * abs_minus / 8.0
    ratio = np.divide(4.0 * zeta.real, abs_minus * abs_minus, out=np.zeros_like(abs_minus), where=is_even)
    real = np.where(is_even, 0.5 * np.log1p(ratio), log_plus - log_minus)
    angle = np.arctan2(2.0 * eta, plus.real * minus.real + eta * eta)
    integrals: list[ComplexArray] = [real - 1j * angle]
    if highest:
        integrals.append(zeta * integrals[0] - 2.0)
    for k in range(1, highest):
        integrals.append(((2 * k + 1) * zeta * integrals[k] - k * integrals[k - 1]) / (k + 1))
    # the sum of the half axes of an ellipse is half the sum of the distances to its foci, plus the other half axis
    half_axis = 0.5 * (abs_plus + abs_minus)
    size = half_axis + np.sqrt(np.maximum((half_axis - 1.0) * (half_axis + 1.0), 0.0))
    lower = LOST ** (0.5 / max(highest, 1))
    for upper in (*[band for band in BANDS if band > lower], math.inf):
        band = np.flatnonzero((size > lower) & (size <= upper))
        if highest and band.size:
            _downward(integrals, band, zeta[band], lower)
        lower = upper
    return integrals, log_plus + log_minus


def _downward(integrals: list[ComplexArray], chosen: np.ndarray, zeta: ComplexArray, size: float) -> None:
    """Replace C_1 ... by the downward recurrence at points whose ellipses are at least as large as `size`."""
    highest = len(integrals) - 1
    first = highest + math.ceil(DIGITS / (2.0 * math.log10(size)))
    ratio = np.zeros_like(zeta)  # C_k / C_{k-1}, which neither overflows nor underflows
    ratios = []
    for k in range(first, 0, -1):
        ratio = k / ((2 * k + 1) * zeta - (k + 1) * ratio)
        if k <= highest:
            ratios.append(ratio)
    for k, ratio in enumerate(reversed(ratios), start=1):
        integrals[k][chosen] = ratio * integrals[k - 1][chosen]


def far_coefficients(k: int, n_terms: int) -> list[float]:
    """Return the coefficients c_j of C_k = sum_j c_j zeta**(-k - 1 - 2 j) (DLMF 14.3.7 at infinity)."""
    coefficient = 2.0 * math.factorial(k) / math.prod(range(1, 2 * k + 2, 2))
    result = []
    for j in range(n_terms):
        result.append(coefficient)
        coefficient *= (k + 1 + 2 * j) * (k + 2 + 2 * j) / (2.0 * (j + 1) * (2 * k + 3 + 2 * j))
    return result


def far(zeta: ComplexArray, highest: int, n_terms: int) -> list[ComplexArray]:
    """Return C_0 ... C_highest at points far from the element, each to relative round-off.

    Parameters
    ----------
    zeta : complex array
        Local coordinates; `n_terms` must fit the smallest modulus (`terms_needed`).
    highest : int
        At least 1.
    n_terms : int
        Terms of the power series.
    """
    inverse = 1.0 / zeta
    w = inverse * inverse
    power = inverse
    for _ in range(highest - 1):
        power = power * inverse
    top, below = (_series(far_coefficients(k, n_terms), w) for k in (highest, highest - 1))
    below *= power
    top *= power
    top *= inverse
    integrals = [top, below]
    for k in range(highest - 1, 0, -1):
        next_one = ((2 * k + 1) / k) * zeta
        next_one *= integrals[-1]
        next_one -= ((k + 1) / k) * integrals[-2]
        integrals.append(next_one)
    return integrals[::-1]


def terms_needed(distance: float) -> int:
    """Return how many terms of the power series reach round-off at |zeta| >= distance > 1."""
    return max(1, math.ceil(16.5 / (2.0 * math.log10(distance))))


def _series(coefficients: list[float], w: ComplexArray) -> ComplexArray:
    result = np.full_like(w, coefficients[-1])
    for coefficient in coefficients[-2::-1]:
        result *= w
        result += coefficient
    return result
