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

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.series import FAR, SERIES
from bemkit.operators.material import Material


@dataclass(frozen=True)
class Constants:
    """What the closed forms take of the material.

    Parameters
    ----------
    single : float [1/Pa]
        A / (2 pi) and so on: 1 / (8 pi mu (1 - nu)).
    double : float [-]
        1 / (4 pi (1 - nu)).
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
    if (fast := compiled.functions()) is not None:
        values: ComplexArray = fast.element_fields(constants.numbers, x, places, start, end)
        return values
    place = _Place(x, start, end, places[:, None] == np.arange(start.size))
    result = np.empty((6, *place.eta.shape), complex)
    log, moment, quotient, of_moment = place.integrals()
    nu = constants.poisson_ratio
    a, kappa = constants.single * place.half, 3.0 - 4.0 * nu
    logs = 0.5 * (place.log_start + place.log_end) + place.zeta.real * log.real - place.eta * log.imag
    result[0] = a * (1.0 + kappa * (2.0 + 2.0 * np.log(constants.log_length) - logs))
    result[1].real, result[1].imag = 1.0 + place.eta * log.imag, place.eta * log.real
    result[1] *= a * place.tangent**2
    rates = -constants.double * (2.0 - 2.0 * nu), -constants.double * (1.0 - 2.0 * nu)
    result[2].real, result[2].imag = -rates[0] * log.imag, rates[1] * log.real
    result[4].real, result[4].imag = -rates[0] * moment.imag, rates[1] * moment.real
    turned = (-constants.double * place.tangent**2) * place.eta
    result[3] = turned * quotient.conj()
    result[5] = turned * of_moment.conj()
    return result


class _Place:
    """Where points are, seen from elements: all arrays (n_points, n_elements) but those of elements alone."""

    def __init__(self, x: ComplexArray, start: ComplexArray, end: ComplexArray, is_own: BoolArray) -> None:
        span = end - start
        self.is_own = is_own
        self.half = 0.5 * np.abs(span)
        self.tangent = span / (2.0 * self.half)
        to_start, to_end = x[:, None] - start, x[:, None] - end
        to_local = self.tangent.conj() / self.half
        # near an end node the coordinate across the element is known from there alone
        plus, minus = to_start * to_local, to_end * to_local
        self.product = plus * minus  # zeta^2 - 1
        self.zeta = 0.5 * (plus + minus)
        squared_start = np.square(to_start.real) + np.square(to_start.imag)
        squared_end = np.square(to_end.real) + np.square(to_end.imag)
        self.log_start, self.log_end = np.log(squared_start), np.log(squared_end)
        self.log_ratio = 0.5 * (self.log_start - self.log_end)
        turn = to_start.conj() * to_end
        self.angle = np.where(is_own, 0.0, np.arctan2(turn.imag, turn.real))
        is_nearer_start = squared_start < squared_end
        eta = np.where(is_own, 0.0, np.where(is_nearer_start, plus.imag, minus.imag))
        self.zeta.imag = eta
        self.eta = eta

    def integrals(self) -> tuple[ComplexArray, ComplexArray, ComplexArray, ComplexArray]:
        """Return L, zeta L - 2, G and -L + zeta G, far from the element by the series."""
        quotient = np.asarray(2.0 / np.where(self.is_own, -1.0, self.product), complex)  # on the element eta is zero
        log = np.asarray(self.log_ratio - 1j * self.angle, complex)
        moment = self.zeta * log - 2.0
        of_moment: ComplexArray = self.zeta * quotient - log
        far = np.nonzero(np.square(self.zeta.real) + np.square(self.zeta.imag) > FAR**2)
        inverse = 1.0 / self.zeta[far]
        square = inverse * inverse
        series = np.zeros_like(square)
        for factor in SERIES:
            series = (series + factor) * square
        log[far], moment[far] = 2.0 * inverse * (1.0 + series), 2.0 * series
        of_moment[far] = 2.0 * inverse * (square / (1.0 - square) - series)
        return log, moment, quotient, of_moment
