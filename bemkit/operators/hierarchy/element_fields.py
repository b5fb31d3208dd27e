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

from bemkit.arrays import BoolArray, ComplexArray
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


def single_layer_fields(
    constants: Constants, x: ComplexArray, start: ComplexArray, end: ComplexArray, is_own: BoolArray
) -> ComplexArray:
    """Return the factors (2, n_points, n_elements) of p and conj(p) in U p, p a constant traction.

    Parameters
    ----------
    constants : Constants
    x : (n_points,) complex array
    start, end : (n_elements,) complex arrays
    is_own : (n_points, n_elements) bool array
        Where the point is the middle of the element.
    """
    if (fast := compiled.functions()) is not None:
        numbers = constants.single, constants.poisson_ratio, constants.log_length
        values: ComplexArray = fast.single_layer_fields(*numbers, x, start, end, is_own)
        return values
    place = _Place(x, start, end, is_own)
    a, kappa = constants.single * place.half, 3.0 - 4.0 * constants.poisson_ratio
    j = 0.5 * (place.log_start + place.log_end) - 2.0 * np.log(place.half) - 2.0
    j += place.zeta.real * place.log_ratio + place.eta * place.angle
    result = np.empty((2, *place.eta.shape), complex)
    result[0] = a * (1.0 - kappa * (2.0 * np.log(place.half / constants.log_length) + j))
    result[1].real = 1.0 - place.eta * place.angle
    result[1].imag = place.eta * place.log_ratio
    result[1] *= a * place.tangent**2
    return result


def double_layer_fields(
    constants: Constants, x: ComplexArray, start: ComplexArray, end: ComplexArray, is_own: BoolArray
) -> ComplexArray:
    """Return the factors (4, n_points, n_elements) of v, conj(v), s and conj(s) in T (v + s t), t from -1 to 1.

    Parameters are those of `single_layer_fields`. On the element itself the integral is a principal value.
    """
    if (fast := compiled.functions()) is not None:
        numbers = constants.double, constants.poisson_ratio
        values: ComplexArray = fast.double_layer_fields(*numbers, x, start, end, is_own)
        return values
    place = _Place(x, start, end, is_own)
    nu, zeta = constants.poisson_ratio, place.zeta
    rates = -constants.double * (2.0 - 2.0 * nu), -constants.double * (1.0 - 2.0 * nu)
    quotient = 2.0 / np.where(is_own, -1.0, place.product)  # on the element eta is zero
    log = place.log_ratio - 1j * place.angle
    moment = zeta * log - 2.0
    of_moment = zeta * quotient - log
    far = np.nonzero(np.square(zeta.real) + np.square(zeta.imag) > FAR**2)
    inverse = 1.0 / zeta[far]
    square = inverse * inverse
    series = np.zeros_like(square)
    for factor in SERIES:
        series = (series + factor) * square
    log[far], moment[far] = 2.0 * inverse * (1.0 + series), 2.0 * series
    of_moment[far] = 2.0 * inverse * (square / (1.0 - square) - series)
    result = np.empty((4, *place.eta.shape), complex)
    result[0].real, result[0].imag = -rates[0] * log.imag, rates[1] * log.real
    result[2].real, result[2].imag = -rates[0] * moment.imag, rates[1] * moment.real
    turned = (-constants.double * place.tangent**2) * place.eta
    result[1] = turned * quotient.conj()
    result[3] = turned * of_moment.conj()
    return result


class _Place:
    """Where points are, seen from elements: all arrays (n_points, n_elements) but those of elements alone."""

    def __init__(self, x: ComplexArray, start: ComplexArray, end: ComplexArray, is_own: BoolArray) -> None:
        span = end - start
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
