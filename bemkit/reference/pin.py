"""A pin in a slightly larger hole of an infinite sheet, frictionless: Persson's conforming contact.

Angles count from the middle of the contact, loads are per unit of thickness. Valid for clearances that are small beside
the radius and for sheets of ten radii and more, whose size changes the contact by about (radius / size)^2. The pin is
loaded by a force at its centre and held by nothing else; the sheet carries it far away.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive
from bemkit.reference.pressure import N_TERMS, EvenPressure, half_width_for, solve_pressure

NEAT_FIT = np.radians(84.827946)
"""Half-angle [rad] of contact without clearance between equal materials, for any load."""


def persson_load(half_angle: float) -> float:
    """Return the load that belongs to a half-angle between equal materials.

    Parameters
    ----------
    half_angle : float [rad]
        Less than `NEAT_FIT`; at more the clearance is an interference and the load parameter negative.

    Returns
    -------
    float [-]
        Q / (E' clearance).

    References
    ----------
    [Persson1964]; [CiavarellaDecuzzi2001]: with b = tan(e / 2),
    E' clearance / Q = (2 - ln(b^2 + 1) - 2 b^4) / (pi b^2 (b^2 + 1)).
    """
    if not 0.0 < half_angle < np.pi:
        raise InputError(f"half_angle is {half_angle}: give one between 0 and pi, in radians")
    b = np.tan(0.5 * half_angle) ** 2
    return float(np.pi * b * (b + 1.0) / (2.0 - np.log(b + 1.0) - 2.0 * b**2))


def persson_pressure(angle: FloatArray, half_angle: float) -> FloatArray:
    """Return R p / Q [-] at angles [rad] between equal materials, zero outside of the contact."""
    b = np.tan(0.5 * half_angle)
    y = np.tan(0.5 * np.clip(angle, -half_angle, half_angle))
    root, size = np.sqrt(np.maximum(b**2 - y**2, 0.0)), np.sqrt(b**2 + 1.0)
    logarithm = np.log((size + root) / (size - root)) / (2.0 * np.pi * b**2 * (b**2 + 1.0))
    return np.asarray(2.0 * root / (np.pi * size * (1.0 + y**2)) + logarithm)


@dataclass(frozen=True)
class PinInHole:
    """A pin and a sheet of any two materials.

    Parameters
    ----------
    load : float [N/m]
        Q.
    radius : float [m]
        Of the hole.
    clearance : float [m]
        Radius of the hole less that of the pin, positive.
    pin, sheet : Material

    Notes
    -----
    A pressure cos(n angle), n >= 2, moves the surfaces of pin and sheet apart by R / (n^2 - 1) times
    n (2 / E'_1 + 2 / E'_2) + (kappa_2 - 1) / (4 mu_2) - (kappa_1 - 1) / (4 mu_1), by the complex symbols of the circle;
    a uniform one by R ((kappa_1 - 1) / (4 mu_1) + 1 / (2 mu_2)), and n = 1 is the approach of the bodies. The sums over
    n are known, and Chebyshev polynomials solve the integral equation to round-off.

    References
    ----------
    [Persson1964]; [CiavarellaDecuzzi2001] parts I and II.
    """

    load: float
    radius: float
    clearance: float
    pin: Material
    sheet: Material

    def __post_init__(self) -> None:
        check_positive(load=self.load, radius=self.radius, clearance=self.clearance)

    @cached_property
    def half_angle(self) -> float:
        """End of contact [rad]."""
        return half_width_for(self.load, self._load_on, 0.3)

    @property
    def peak_pressure(self) -> float:
        """Pressure in the middle [Pa]."""
        return float(self.pressure(np.zeros(1))[0])

    def pressure(self, angle: FloatArray) -> FloatArray:
        """Return the pressure [Pa] at angles [rad]."""
        return self._solved(self.half_angle).at(angle)

    def _load_on(self, half_angle: float) -> float:
        return self.radius * self._solved(half_angle).integral(np.cos)

    def _solved(self, half_angle: float) -> EvenPressure:
        pressure, _ = solve_pressure(
            self._apart, half_angle, lambda x: -np.cos(x), lambda x: np.full_like(x, -self.clearance), N_TERMS
        )
        return pressure

    def _apart(self, angle: FloatArray) -> FloatArray:
        """Return how far a line pressure [N/m per rad] at a distance moves the surfaces apart, less a cosine."""
        pin, sheet = self.pin, self.sheet
        common = 2.0 / pin.plane_modulus + 2.0 / sheet.plane_modulus
        of_pin = (pin.kappa - 1.0) / (4.0 * pin.shear_modulus)
        apart = (sheet.kappa - 1.0) / (4.0 * sheet.shear_modulus) - of_pin
        turn = np.abs(angle)
        cosine, sine = np.cos(turn), np.sin(turn)
        logarithm, sawtooth = -np.log(2.0 * np.sin(0.5 * turn)), 0.5 * (np.pi - turn)
        with_n = cosine * logarithm - 0.5 - 0.25 * cosine
        without_n = 0.5 + 0.25 * cosine - sine * sawtooth
        uniform = of_pin + 0.5 / sheet.shear_modulus
        return np.asarray(self.radius / np.pi * (common * with_n + apart * without_n + 0.5 * uniform))
