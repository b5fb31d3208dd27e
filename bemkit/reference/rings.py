"""Rings and discs under pressures, interference, torque and rotation: fields that depend only on the radius.

Stresses are positive in tension, displacements outwards. Formulas are those of plane strain in kappa and the shear
modulus, so that they hold for plane stress and for incompressible bodies too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive


@dataclass(frozen=True)
class LameRing:
    """A ring under uniform pressures, or with no inner radius a disc.

    Parameters
    ----------
    inner_radius, outer_radius : float [m]
        a may be zero: then there is no inner pressure.
    inner_pressure, outer_pressure : float [Pa]
    material : Material

    References
    ----------
    [TimoshenkoGoodier1970] section 28: sigma_r = A - B / r^2, sigma_theta = A + B / r^2.
    """

    inner_radius: float
    outer_radius: float
    inner_pressure: float
    outer_pressure: float
    material: Material

    def __post_init__(self) -> None:
        if not 0.0 <= self.inner_radius < self.outer_radius < np.inf:
            raise InputError(
                f"inner_radius is {self.inner_radius}, outer_radius {self.outer_radius}: give 0 <= inner < outer"
            )
        if self.inner_radius == 0.0 and self.inner_pressure != 0.0:
            raise InputError(f"inner_pressure is {self.inner_pressure}, but a disc has no hole: give zero")

    @property
    def _constants(self) -> tuple[float, float]:
        a, b = self.inner_radius**2, self.outer_radius**2
        uniform = (self.inner_pressure * a - self.outer_pressure * b) / (b - a)
        return uniform, (self.inner_pressure - self.outer_pressure) * a * b / (b - a)

    def displacement(self, radius: FloatArray | float) -> FloatArray:
        """Return the radial displacement [m]."""
        r, (uniform, central) = np.asarray(radius, dtype=float), self._constants
        far = np.divide(central, r, out=np.zeros_like(r), where=r > 0.0)
        return np.asarray((0.5 * (self.material.kappa - 1.0) * uniform * r + far) / (2.0 * self.material.shear_modulus))

    def stresses(self, radius: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return the radial and the hoop stress [Pa]."""
        r, (uniform, central) = np.asarray(radius, dtype=float), self._constants
        far = np.divide(central, r**2, out=np.zeros_like(r), where=r > 0.0)
        return uniform - far, uniform + far


@dataclass(frozen=True)
class ShrinkFit:
    """Two rings pressed together by an interference; the inner one may be a solid shaft.

    Parameters
    ----------
    inner_radius, radius, outer_radius : float [m]
        Of the hole (zero for a shaft), of the joint, and of the outer ring.
    inner, outer : Material
    interference : float [m]
        Radius of the inner ring less that of the hole of the outer one, free of stress.

    References
    ----------
    [TimoshenkoGoodier1970] section 28.
    """

    inner_radius: float
    radius: float
    outer_radius: float
    inner: Material
    outer: Material
    interference: float

    def __post_init__(self) -> None:
        check_positive(interference=self.interference)
        if not 0.0 <= self.inner_radius < self.radius < self.outer_radius:
            radii = (self.inner_radius, self.radius, self.outer_radius)
            raise InputError(f"the radii are {radii}: give 0 <= inner_radius < radius < outer_radius")

    @property
    def pressure(self) -> float:
        """Pressure of the joint [Pa]."""
        inner, outer = self._rings(1.0)
        apart = outer.displacement(self.radius) - inner.displacement(self.radius)
        return float(self.interference / apart)

    def displacements(self) -> tuple[float, float]:
        """Return the radial displacements [m] of the two rims at the joint: of the inner ring, and of the outer one."""
        inner, outer = self._rings(self.pressure)
        return float(inner.displacement(self.radius)), float(outer.displacement(self.radius))

    def largest_torque(self, friction: float) -> float:
        """Return the torque [N] per unit of thickness below which the joint sticks; at it the whole joint slips.

        The shear of the joint is uniform, torque / (2 pi radius^2).
        """
        return 2.0 * np.pi * self.radius**2 * friction * self.pressure

    def _rings(self, pressure: float) -> tuple[LameRing, LameRing]:
        return (
            LameRing(self.inner_radius, self.radius, 0.0, pressure, self.inner),
            LameRing(self.radius, self.outer_radius, pressure, 0.0, self.outer),
        )


@dataclass(frozen=True)
class RotatingDisc:
    """A solid disc that turns about its centre.

    Parameters
    ----------
    radius : float [m]
    centrifugal : float [N/m4]
        Density times the square of the angular velocity: the body force per radius.
    material : Material

    Notes
    -----
    With nu of plane strain formulas and m = (3 - 2 nu) / (8 (1 - nu)): sigma_r = m c (R^2 - r^2) and
    u_r = c (1 - 2 nu) r ((3 - 2 nu) R^2 - r^2) / (16 mu (1 - nu)), c the centrifugal force.

    References
    ----------
    [TimoshenkoGoodier1970] section 32.
    """

    radius: float
    centrifugal: float
    material: Material

    def __post_init__(self) -> None:
        check_positive(radius=self.radius, centrifugal=self.centrifugal)

    def displacement(self, radius: FloatArray | float) -> FloatArray:
        """Return the radial displacement [m]."""
        r, nu = np.asarray(radius, dtype=float), self.material.effective_poisson_ratio
        size = self.centrifugal * (1.0 - 2.0 * nu) / (16.0 * self.material.shear_modulus * (1.0 - nu))
        return np.asarray(size * r * ((3.0 - 2.0 * nu) * self.radius**2 - r**2))

    def stresses(self, radius: FloatArray | float) -> tuple[FloatArray, FloatArray]:
        """Return the radial and the hoop stress [Pa]."""
        r, nu = np.asarray(radius, dtype=float), self.material.effective_poisson_ratio
        size = self.centrifugal / (8.0 * (1.0 - nu))
        radial = size * (3.0 - 2.0 * nu) * (self.radius**2 - r**2)
        return np.asarray(radial), np.asarray(size * ((3.0 - 2.0 * nu) * self.radius**2 - (1.0 + 2.0 * nu) * r**2))
