"""Frictionless contact along one zone of two half-planes, or of one and a rigid body: Hertz, wedge, rounded punch.

x runs along the surface from the middle of the zone, pressures and loads (per unit of thickness) are positive, and the
modulus is that of the pair, 1 / E* = 1 / E'_1 + 1 / E'_2; against a rigid body it is E' of the other one. Valid for
zones that are small beside the bodies and for faces that are nearly flat; errors are of the order of the square of
half-width / radius for cylinders, and of half-width / size for bodies of another shape.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material


def check_positive(**values: float) -> None:
    """Raise InputError unless all numbers are positive and finite."""
    for name, value in values.items():
        if not (np.isfinite(value) and value > 0.0):
            raise InputError(f"{name} is {value}: give a positive, finite number")


def pair_modulus(one: Material, other: Material) -> float:
    """Return E* [Pa] of two elastic bodies, 1 / E* = 1 / E'_1 + 1 / E'_2."""
    return 1.0 / (1.0 / one.plane_modulus + 1.0 / other.plane_modulus)


@dataclass(frozen=True)
class LineContact(ABC):
    """A symmetric contact zone under a load.

    Parameters
    ----------
    load : float [N/m]
    """

    load: float

    def __post_init__(self) -> None:
        check_positive(**vars(self))

    @property
    @abstractmethod
    def half_width(self) -> float:
        """Half-width of the zone [m]: contact covers -half_width < x < half_width."""

    @abstractmethod
    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa] at places [m], zero outside of the zone."""

    def under(self, load: float) -> Self:
        """Return the same bodies under another load [N/m]."""
        return replace(self, load=load)


@dataclass(frozen=True)
class HertzLine(LineContact):
    """Two cylinders, or one on a flat.

    Parameters
    ----------
    load : float [N/m]
    radius : float [m]
        1 / R = 1 / R_1 + 1 / R_2; that of the cylinder if the other body is flat.
    modulus : float [Pa]
        E*; see `pair_modulus`.

    References
    ----------
    [Johnson1985] section 4.2(c): a^2 = 4 P R / (pi E*), p = p0 sqrt(1 - (x/a)^2), p0 = 2 P / (pi a).
    """

    radius: float
    modulus: float

    @property
    def half_width(self) -> float:
        """A [m]."""
        return float(np.sqrt(4.0 * self.load * self.radius / (np.pi * self.modulus)))

    @property
    def peak_pressure(self) -> float:
        """p0 [Pa]."""
        return 2.0 * self.load / (np.pi * self.half_width)

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa]."""
        return np.asarray(self.peak_pressure * np.sqrt(np.maximum(1.0 - (np.asarray(x) / self.half_width) ** 2, 0.0)))

    def approach(self, depth: float, material: Material) -> float:
        """Return the approach [m] of the middle of the zone to a point of one half-plane at a depth below it.

        Parameters
        ----------
        depth : float [m]
            Many half-widths: the error is about 3 (half_width / depth)^2 / 4 of the logarithm's factor.
        material : Material
            Of that half-plane.
        """
        nu = material.effective_poisson_ratio
        logarithm = 2.0 * np.log(2.0 * depth / self.half_width) - nu / (1.0 - nu)
        return float(self.load / (np.pi * material.plane_modulus) * logarithm)


@dataclass(frozen=True)
class BluntWedge(LineContact):
    """A symmetric wedge with a sharp edge.

    Parameters
    ----------
    load : float [N/m]
    slope : float [-]
        Tangent of the small angle between each face and the surface.
    modulus : float [Pa]
        E*.

    References
    ----------
    [Johnson1985] section 5.2(a): p = E* slope / pi arcosh(a / |x|), P = E* a slope.
    """

    slope: float
    modulus: float

    @property
    def half_width(self) -> float:
        """A [m]."""
        return self.load / (self.modulus * self.slope)

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa], infinite under the edge itself."""
        with np.errstate(divide="ignore"):
            ratio = np.maximum(self.half_width / np.abs(np.asarray(x, dtype=float)), 1.0)
        return np.asarray(self.modulus * self.slope / np.pi * np.arccosh(ratio))


@dataclass(frozen=True)
class RoundedPunch(LineContact):
    """A punch with a flat face and rounded edges: parabolas that begin where the flat ends.

    Parameters
    ----------
    load : float [N/m]
    flat : float [m]
        Half-width b of the flat face.
    radius : float [m]
        Of the edges.
    modulus : float [Pa]
        E*.

    Notes
    -----
    With b = a sin f: P = E* a^2 (pi - 2 f - sin 2f) / (4 R). Without a flat face this is `HertzLine`.

    References
    ----------
    [CiavarellaHillsMonno1998].
    """

    flat: float
    radius: float
    modulus: float

    @cached_property
    def half_width(self) -> float:
        """A [m]."""
        from scipy.optimize import brentq

        of_hertz = np.sqrt(4.0 * self.load * self.radius / (np.pi * self.modulus))
        high = 2.0 * (self.flat + float(of_hertz))
        return float(brentq(lambda a: self._load_on(a) / self.load - 1.0, self.flat, high, xtol=1e-300, rtol=1e-14))

    def pressure(self, x: FloatArray) -> FloatArray:
        """Return the pressure [Pa]; logarithms make its slope infinite where the flat ends."""
        a = self.half_width
        inside = np.clip(np.abs(np.asarray(x, dtype=float)) / a, 0.0, 1.0)
        angle, end = np.arcsin(inside), np.arcsin(self.flat / a)
        with np.errstate(divide="ignore", invalid="ignore"):
            towards = inside * np.log(np.abs(np.sin(angle + end) / np.sin(angle - end)))
            towards += np.sin(end) * np.log(np.abs(np.tan(0.5 * (angle + end)) * np.tan(0.5 * (angle - end))))
        # both logarithms are infinite where the flat ends; their sum is not
        towards = np.where(angle == end, 2.0 * np.sin(end) * np.log(np.sin(end)), towards)
        values = (np.pi - 2.0 * end) * np.cos(angle) + towards
        return np.asarray(np.where(inside < 1.0, self.modulus * a / (2.0 * np.pi * self.radius) * values, 0.0))

    def _load_on(self, a: float) -> float:
        end = float(np.arcsin(min(self.flat / a, 1.0)))
        return self.modulus * a**2 * (np.pi - 2.0 * end - float(np.sin(2.0 * end))) / (4.0 * self.radius)
