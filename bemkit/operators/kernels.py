r"""Formulas only: polynomial densities on one straight element, seen from a point.

Complex notation. The element runs from a to b with unit tangent tau, half length l and centre c; a point x has the
local coordinate zeta = (x - c) / (l tau), so that the element is the interval [-1, 1]. With

    T_k = int_{-1}^{1} t^k / (zeta - t) dt,    T_0 = log((zeta + 1) / (zeta - 1)),    T_k = zeta T_{k-1} - m_{k-1},

(m_k = int t^k dt) every integral that elasticity needs is a short combination, for rho = x - y:

    int t^k log|rho| ds        = l (m_k log l + [log|zeta - 1| - (-1)^{k+1} log|zeta + 1| + Re T_{k+1}] / (k + 1))
    int t^k rho / conj(rho) ds = l tau^2 (m_k + 2 i eta conj(T_k)),   eta = Im zeta
    int t^k k(x, y) ds         = Im T_k / (2 pi),   k = -(1/2 pi) d log|rho| / dn_y the Laplace double layer

The recursion loses digits like |zeta|^(2k), so far points take the series of the highest T and recurse downwards.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray

FAR = 6.0
"""Local distance |zeta| beyond which the series replaces the logarithms."""


def interval_moment(k: int) -> float:
    """Return m_k, the integral of t**k over [-1, 1]."""
    return 2.0 / (k + 1) if k % 2 == 0 else 0.0


def terms_needed(distance: float) -> int:
    """Return how many terms of the series in 1 / zeta**2 reach round-off at |zeta| >= distance > 1."""
    return max(1, math.ceil(16.5 / (2.0 * math.log10(distance))))


def far_moments(zeta: ComplexArray, highest: int, n_terms: int) -> list[ComplexArray]:
    """Return T_0 ... T_highest at points far from the element.

    Parameters
    ----------
    zeta : complex array
        Local coordinates; `n_terms` must fit the smallest modulus (`terms_needed`).
    highest : int
        At least 1.
    n_terms : int
        Terms of the series T_k = sum over j with j + k even of 2 / (j + k + 1) zeta**(-j-1).

    Returns
    -------
    list of complex arrays
        T_0 ... T_highest, each to relative round-off.
    """
    inverse = 1.0 / zeta
    w = inverse * inverse
    first = highest % 2  # the smallest j with j + highest even
    series = np.full_like(zeta, 2.0 / (first + 2 * (n_terms - 1) + highest + 1))
    for term in range(n_terms - 2, -1, -1):
        series *= w
        series += 2.0 / (first + 2 * term + highest + 1)
    series *= inverse if first == 0 else w
    moments = [series]
    for k in range(highest - 1, -1, -1):
        constant = interval_moment(k)
        moments.append((moments[-1] + constant) * inverse if constant else moments[-1] * inverse)
    return moments[::-1]


def far_log_product(zeta: ComplexArray) -> FloatArray:
    """Return log|zeta**2 - 1| where |zeta| is well above 1."""
    product = zeta * zeta
    product -= 1.0
    squared: FloatArray = np.square(product.real)
    squared += np.square(product.imag)
    np.log(squared, out=squared)
    squared *= 0.5
    return squared


def near_moments(
    plus: ComplexArray, minus: ComplexArray, highest: int
) -> tuple[list[ComplexArray], FloatArray, FloatArray]:
    """Return the moments at points at any distance from the element, exact to round-off.

    Parameters
    ----------
    plus, minus : (n,) complex arrays
        zeta + 1 and zeta - 1, each formed from the distance to its own end point so that it is exact near that end.
    highest : int
        Highest moment.

    Returns
    -------
    moments : list of (n,) complex arrays
        T_0 ... T_highest.
    log_minus, log_plus : (n,) arrays
        log|zeta - 1| and log|zeta + 1|.

    Notes
    -----
    The angle theta = -Im T_0 is the one under which the element is seen, in (-pi, pi].
    """
    abs_plus, abs_minus = np.abs(plus), np.abs(minus)
    log_plus, log_minus = np.log(abs_plus), np.log(abs_minus)
    near_a = abs_plus < abs_minus
    eta = np.where(near_a, plus.imag, minus.imag)
    zeta = np.where(near_a, plus - 1.0, minus + 1.0)
    xi = zeta.real
    # |zeta+1|^2 - |zeta-1|^2 = 4 xi: log1p keeps the digits of the difference of two nearly equal logarithms
    ratio = np.divide(
        4.0 * xi, abs_minus * abs_minus, out=np.zeros_like(xi), where=np.abs(xi) < abs_minus * abs_minus / 8.0
    )
    lam = np.where(ratio != 0.0, 0.5 * np.log1p(ratio), log_plus - log_minus)
    theta = np.arctan2(2.0 * eta, plus.real * minus.real + eta * eta)
    moments: list[ComplexArray] = [lam - 1j * theta]
    for k in range(1, highest + 1):
        moments.append(zeta * moments[-1] - interval_moment(k - 1))
    far = np.minimum(abs_plus, abs_minus) > FAR
    if far.any():
        for k, moment in enumerate(far_moments(zeta[far], max(highest, 1), terms_needed(FAR - 1.0))[: highest + 1]):
            moments[k][far] = moment
    return moments, log_minus, log_plus


def log_moment(k: int, moments: Sequence[ComplexArray], log_product: FloatArray) -> FloatArray:
    """Return Re int t**k log(zeta - t) dt, that is the log integral for an element of half length 1.

    `log_product` is log|zeta**2 - 1|; `moments` must reach T_{k+1}.
    """
    ends = log_product if k % 2 == 0 else -moments[0].real
    result: FloatArray = ends + moments[k + 1].real
    return result if k == 0 else result / (k + 1)


def quotient_moment(k: int, moments: Sequence[ComplexArray], eta: FloatArray) -> ComplexArray:
    """Return int t**k rho / conj(rho) dt for an element of half length 1 along the real axis."""
    result: ComplexArray = moments[k].conj() * (2j * eta)
    constant = interval_moment(k)
    if constant:
        result += constant
    return result
