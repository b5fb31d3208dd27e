"""The edge of a punch that sticks to a half-plane of its own material: a free wedge of both angles together."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.optimize import brentq

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material


@dataclass(frozen=True)
class CompleteContact:
    """The leading field at an edge at the origin; contact covers y = 0, x > 0, the half-plane lies below.

    The pressure is x^(lambda - 1), and so is the shear traction but for the factor `friction_limit`.

    Parameters
    ----------
    angle : float [rad]
        Of the punch at its edge, between 0 and pi.
    material : Material
        Of both bodies.

    Notes
    -----
    With the bisector of the wedge as the real axis, Kolosov's potentials are a z^lambda and b z^lambda. Both sides, at
    the angles +-alpha, are free where sin(2 lambda alpha) + lambda sin(2 alpha) = 0.

    References
    ----------
    [Williams1952]
    """

    angle: float
    material: Material

    def __post_init__(self) -> None:
        if not 0.0 < self.angle < np.pi:
            raise InputError(f"angle is {self.angle}: give an angle between 0 and pi")

    @cached_property
    def exponent(self) -> float:
        """The exponent lambda of the displacements."""
        whole = np.pi + self.angle
        return float(brentq(lambda power: np.sin(power * whole) + power * np.sin(whole), 0.5, 1.0 - 1e-9, xtol=1e-15))

    @property
    def friction_limit(self) -> float:
        """The friction coefficient from which on the contact sticks up to its edge."""
        stress = self._stress(np.array([[1.0, 0.0]]), 1.0)[0]
        return float(abs(stress[0, 1] / stress[1, 1]))

    def displacement(self, points: FloatArray) -> FloatArray:
        """Return the displacements (n, 2) [m] at points (n, 2)."""
        a, b = self._factors(self._size)
        z, power = self._turned(points), self.exponent
        moved = self.material.kappa * a * z**power - z * np.conj(power * a * z ** (power - 1.0)) - b * np.conj(z**power)
        moved /= 2.0 * self.material.shear_modulus * self._turn
        return np.stack([moved.real, moved.imag], axis=1)

    def stress(self, points: FloatArray) -> FloatArray:
        """Return the stresses (n, 2, 2) [Pa] at points (n, 2)."""
        return self._stress(points, self._size)

    @cached_property
    def _size(self) -> float:
        """The factor a for which the pressure at the distance 1 is 1."""
        return -1.0 / float(self._stress(np.array([[1.0, 0.0]]), 1.0)[0, 1, 1])

    @property
    def _turn(self) -> complex:
        """Turns the plane so that the bisector becomes the real axis."""
        return complex(np.exp(0.5j * (np.pi - self.angle)))

    def _turned(self, points: FloatArray) -> ComplexArray:
        return (points[:, 0] + 1j * points[:, 1]) * self._turn

    def _factors(self, a: float) -> tuple[float, float]:
        whole = np.pi + self.angle
        return a, -a * float(np.cos(self.exponent * whole) + self.exponent * np.cos(whole))

    def _stress(self, points: FloatArray, size: float) -> FloatArray:
        a, b = self._factors(size)
        z, power = self._turned(points), self.exponent
        slope = power * z ** (power - 1.0)
        mean = 2.0 * a * slope.real
        deviator = (a * (power - 1.0) * slope * np.conj(z) / z + b * slope) * self._turn**2
        stress = np.stack([mean - deviator.real, deviator.imag, deviator.imag, mean + deviator.real], axis=1)
        return stress.reshape(-1, 2, 2)
