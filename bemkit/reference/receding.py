"""A layer that a strip of pressure presses onto an elastic half-plane or a rigid base: receding contact.

Without friction and weight. The end of contact depends neither on the load nor on Poisson's ratios. It follows from
equal deflections in Fourier space, solved by Chebyshev polynomials.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.reference.hertz import check_positive
from bemkit.reference.pressure import N_TERMS, EvenPressure, half_width_for, solve_pressure

_N_PLACES = 60
"""Places at which transforms are computed."""
_LARGEST_FREQUENCY = 24.0
"""In 1 / thickness; beyond it the layer is a half-plane to 1e-17."""


@dataclass(frozen=True)
class RecedingLayer:
    """The layer 0 < y < thickness, pressed on |x| < load_half_width by a uniform pressure of the total `load`.

    Parameters
    ----------
    load : float [N/m]
    load_half_width, thickness : float [m]
        A load that is concentrated has the half-width zero.
    modulus_ratio : float [-]
        E'_1 / E'_2 of the layer and the half-plane below; zero for a rigid base.

    Notes
    -----
    With k = frequency times thickness, S(k) = (sinh k cosh k + k) / (sinh^2 k - k^2) and
    T(k) = (k cosh k + sinh k) / (sinh^2 k - k^2), pressures p below and q above deflect the lower side of the layer
    by 2 / (E'_1 frequency) (S p - T q), and p the half-plane by 2 / (E'_2 frequency) p. What is singular at frequency
    zero is common to S and T and cancels once both pressures have the same resultant.

    References
    ----------
    [KeerDundursTsai1972].
    """

    load: float
    load_half_width: float
    thickness: float
    modulus_ratio: float = 0.0

    def __post_init__(self) -> None:
        check_positive(load=self.load, thickness=self.thickness)
        for name in ("load_half_width", "modulus_ratio"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise InputError(f"{name} is {value}: give a finite number, not negative")

    @cached_property
    def half_width(self) -> float:
        """End of contact [m]."""
        return self.thickness * half_width_for(0.0, lambda c: self._solved(c)[1], 1.0)

    @property
    def peak_pressure(self) -> float:
        """Pressure in the middle [Pa]."""
        return float(self.pressure(np.zeros(1))[0])

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the contact pressure [Pa] at places [m] from the middle."""
        pressure, _ = self._solved(self.half_width / self.thickness)
        return self.load / self.thickness * pressure.at(np.asarray(x) / self.thickness)

    def _solved(self, half_width: float) -> tuple[EvenPressure, float]:
        """Return the pressure on some zone below a unit load on the layer of unit thickness, and the excess curvature.

        With a curvature more of the surfaces the pressure vanishes at any ends; the zone is right if there is none.
        """
        under_load, _ = solve_pressure(self._below, half_width, np.ones_like, self._above, N_TERMS)
        of_curvature, _ = solve_pressure(self._below, half_width, np.ones_like, np.square, N_TERMS)
        curvature = (1.0 - under_load.integral(np.ones_like)) / of_curvature.integral(np.ones_like)
        sum_of_both = under_load.coefficients + curvature * of_curvature.coefficients
        return EvenPressure(half_width, sum_of_both), curvature

    def _below(self, x: FloatArray) -> FloatArray:
        """Deflection by a line of contact pressure, of both bodies together, in units of 2 / (pi E'_1)."""
        x = np.abs(x)
        return np.asarray(_transform(_of_pressure(_FREQUENCIES) - 1.0, x) - (1.0 + self.modulus_ratio) * np.log(x))

    def _above(self, x: FloatArray) -> FloatArray:
        """Deflection by the unit load on top, in the same units."""
        strip = np.sinc(_FREQUENCIES * self.load_half_width / (np.pi * self.thickness))
        return _transform(_of_load(_FREQUENCIES) * strip, x)


def _of_pressure(k: FloatArray) -> FloatArray:
    return np.asarray((np.sinh(k) * np.cosh(k) + k) / _determinant(k))


def _of_load(k: FloatArray) -> FloatArray:
    return np.asarray((k * np.cosh(k) + np.sinh(k)) / _determinant(k))


def _determinant(k: FloatArray) -> FloatArray:
    """Return sinh^2 k - k^2 without cancellation."""
    less = np.sinh(k) - k
    small = k**3 / 6.0 * (1.0 + k**2 / 20.0 * (1.0 + k**2 / 42.0 * (1.0 + k**2 / 72.0 * (1.0 + k**2 / 110.0))))
    return np.asarray(np.where(k < 0.5, small, less) * (np.sinh(k) + k))


def _transform(spectrum: FloatArray, x: FloatArray) -> FloatArray:
    """Integrate spectrum(k) cos(k x) / k over the frequencies, but for constants and a multiple of x^2.

    The multiple is the same for all spectra that begin with 6 / k^3 + 6 / (5 k), as those of the layer do.
    """
    # a smooth even function of x: at few places, then by its polynomial in x^2
    furthest = float(np.abs(x).max())
    at = furthest**2 * (0.5 + 0.5 * np.cos(np.pi * (np.arange(_N_PLACES) + 0.5) / _N_PLACES))
    k, phase = _FREQUENCIES, np.sqrt(at)[:, None] * _FREQUENCIES
    # split off the singular part at k = 0, whose first terms are constants and multiples of x^2
    singular = np.where(k < 1.0, 6.0 / k**3 + 1.2 / k, 0.0)
    fall = -2.0 * np.sin(0.5 * phase) ** 2
    # cos(phase) - 1 + phase^2 / 2 without cancellation: its series where the phase is small
    z = phase**2
    fourth = z**2 / 24.0 * (1.0 - z / 30.0 * (1.0 - z / 56.0 * (1.0 - z / 90.0 * (1.0 - z / 132.0))))
    fourth = np.where(z < 0.5, fourth, fall + 0.5 * z)
    values = ((spectrum - singular) * fall + singular * fourth) @ (_WEIGHTS / k)
    fitted = np.polynomial.Chebyshev.fit(at, values, _N_PLACES - 1, domain=[0.0, furthest**2])
    return np.asarray(fitted(x**2))


def _frequencies() -> tuple[FloatArray, FloatArray]:
    """Gauss points and weights on intervals of length one."""
    xi, weights = gauss_legendre(12)
    starts = np.arange(_LARGEST_FREQUENCY)[:, None]
    return (starts + 0.5 * (1.0 + xi)).ravel(), np.tile(0.5 * weights, starts.size)


_FREQUENCIES, _WEIGHTS = _frequencies()
