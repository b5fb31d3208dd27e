"""Displacements that constant and linear densities on straight elements cause anywhere, in closed form.

In complex notation, with the element from a to b, its tangent tau and half length l, zeta = (x - c) / (l tau) = xi + i
eta, lambda = log(|x - a| / |x - b|), theta the angle from x - a to x - b and L = lambda - i theta:

    U p = A l ([1 - kappa (2 log(l / r0) + J)] p + tau^2 [1 + i eta conj(L)] conj(p)),     A = 1 / (8 pi mu (1 - nu))
    T v = -B ([(2 - 2 nu) theta + i (1 - 2 nu) lambda] v + tau^2 eta conj(G) conj(v)),     B = 1 / (4 pi (1 - nu))

with J = log|zeta^2 - 1| - 2 + xi lambda + eta theta and G = 2 / (zeta^2 - 1). For a density s times the local
coordinate, zeta L - 2 takes the place of L, and -L + 2 zeta / (zeta^2 - 1) that of G. These are the integrals of
`bemkit.operators.collocation`, which is made for all pairs of a mesh; here it is any points and any elements.

Far from the element differences of logarithms would lose their digits, which tight skeletons mistake for structure:
there L = 2 sum zeta^-(2k+1) / (2k+1), and the others follow from the same sum.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.series import FAR, REST, SERIES
from bemkit.operators.material import Material

Values = TypeVar("Values", FloatArray, ComplexArray)


@dataclass(frozen=True)
class Constants:
    """What the closed forms take of the material.

    Parameters
    ----------
    single : float [1/Pa]
        A = 1 / (8 pi mu (1 - nu)).
    double : float [-]
        B = 1 / (4 pi (1 - nu)).
    poisson_ratio : float [-]
        Of plane strain.
    log_length : float [m]
        r0, the unit of length of the logarithm.
    """

    single: float
    double: float
    poisson_ratio: float
    log_length: float

    @classmethod
    def of(cls, material: Material, log_length: float) -> Constants:
        """Return the constants of a material."""
        nu = material.effective_poisson_ratio
        double = 1.0 / (4.0 * np.pi * (1.0 - nu))
        return cls(0.5 * double / material.shear_modulus, double, nu, log_length)

    @property
    def numbers(self) -> FloatArray:
        """The same as an array (4,), for the compiled loops."""
        return np.array([self.single, self.double, self.poisson_ratio, self.log_length])


def element_fields(
    constants: Constants, x: ComplexArray, places: IntArray, start: ComplexArray, end: ComplexArray
) -> ComplexArray:
    """Return factors (6, n_points, n_elements) of p, conj(p) in U p and of v, conj(v), s, conj(s) in T (v + s t).

    Parameters
    ----------
    constants : Constants
    x : (n_points,) complex array
    places : (n_points,) array
        The element, counted in `start`, in whose middle the point is; there the integral T is a principal value. Any
        other number elsewhere.
    start, end : (n_elements,) complex arrays

    Notes
    -----
    p is a constant traction, v a constant displacement and s its slope by the coordinate t, from -1 to 1.
    """
    near = _Near(x, start, end, places)
    half = 0.5 * np.abs(end - start)
    tangent = (end - start) / (2.0 * half)
    zeta = (x[:, None] - 0.5 * (start + end)) * (tangent.conj() / half)
    zeta[near.pairs] = FAR  # anything far: these are replaced
    inverse = 1.0 / zeta
    square = inverse * inverse
    series, rest = _power_series(SERIES, square), _power_series(REST, square)
    log, moment = near.put(2.0 * (inverse + inverse * series), near.log), near.put(2.0 * series, near.moment)
    quotient: ComplexArray = near.put(2.0 * (series + rest), near.quotient)
    of_moment = near.put(2.0 * inverse * rest, near.of_moment)
    # log|zeta^2 - 1| + Re(zeta L)
    squared = (np.square(zeta.real) + np.square(zeta.imag)) * np.abs(1.0 - square)
    logs = near.put(np.log(squared) + 2.0 + moment.real, near.logs)
    eta = near.put(zeta.imag.copy(), near.zeta.imag)
    result = np.empty((6, *zeta.shape), complex)
    nu = constants.poisson_ratio
    a, kappa = constants.single * half, 3.0 - 4.0 * nu
    result[0] = a * (1.0 + kappa * (2.0 + 2.0 * np.log(constants.log_length / half) - logs))
    result[1].real, result[1].imag = 1.0 + eta * log.imag, eta * log.real
    result[1] *= a * tangent**2
    rates = -constants.double * (2.0 - 2.0 * nu), -constants.double * (1.0 - 2.0 * nu)
    result[2].real, result[2].imag = -rates[0] * log.imag, rates[1] * log.real
    result[4].real, result[4].imag = -rates[0] * moment.imag, rates[1] * moment.real
    turned = (-constants.double * tangent**2) * eta
    np.multiply(turned, quotient.conj(), out=result[3])
    np.multiply(turned, of_moment.conj(), out=result[5])
    return result


def _power_series(factors: tuple[float, ...], q: ComplexArray) -> ComplexArray:
    """Return f1 q + f2 q^2 + ...; the last factor comes first."""
    result = factors[0] * q
    for factor in factors[1:]:
        result += factor
        result *= q
    return result


class _Near:
    """Closed forms of all pairs of points and elements that are not far from each other.

    `pairs` are their indices; all other arrays are by pair: zeta, L, zeta L - 2, G, -L + zeta G, and log|zeta^2 - 1|
    with Re(zeta L).
    """

    def __init__(self, x: ComplexArray, start: ComplexArray, end: ComplexArray, places: IntArray) -> None:
        away, span = x[:, None] - 0.5 * (start + end), end - start
        of_span = np.square(span.real) + np.square(span.imag)
        self.pairs = np.nonzero(np.square(away.real) + np.square(away.imag) <= (0.25 * FAR**2) * of_span)
        point, element = self.pairs
        is_own, span = places[point] == element, span[element]
        half = 0.5 * np.abs(span)
        to_start, to_end = x[point] - start[element], x[point] - end[element]
        to_local = (span / (2.0 * half)).conj() / half
        # near an end node the coordinate across the element is known from there alone
        plus, minus = to_start * to_local, to_end * to_local
        self.zeta = 0.5 * (plus + minus)
        squared_start = np.square(to_start.real) + np.square(to_start.imag)
        squared_end = np.square(to_end.real) + np.square(to_end.imag)
        self.zeta.imag = np.where(squared_start < squared_end, plus.imag, minus.imag)
        self.zeta.imag[is_own] = 0.0
        turn = to_start.conj() * to_end
        angle = np.where(is_own, 0.0, np.arctan2(turn.imag, turn.real))
        log_start, log_end = np.log(squared_start), np.log(squared_end)
        self.log = 0.5 * (log_start - log_end) - 1j * angle
        turned = self.zeta * self.log
        self.moment = turned - 2.0
        self.quotient = np.asarray(2.0 / np.where(is_own, -1.0, plus * minus), complex)  # on the element eta is zero
        self.of_moment = self.zeta * self.quotient - self.log
        self.logs = 0.5 * (log_start + log_end) - 2.0 * np.log(half) + turned.real

    def put(self, of_all: Values, values: Values) -> Values:
        """Replace the values of these pairs in an array (n_points, n_elements)."""
        of_all[self.pairs] = values
        return of_all
