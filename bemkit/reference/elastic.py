"""Closed forms of elasticity without contact: the Brazilian disc and Kirsch's hole."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.material import Material
from bemkit.reference.hertz import check_positive


@dataclass(frozen=True)
class BrazilianDisc:
    """A disc pressed by two opposite arcs of uniform pressure, and by nothing else.

    Parameters
    ----------
    pressure : float [Pa]
    half_angle : float [rad]
        Of each arc, less than pi / 2.

    References
    ----------
    [Hondros1959]. Stresses depend on no elastic constant, nor on the radius.
    """

    pressure: float
    half_angle: float

    def stresses(self, distance: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return stresses [Pa] on the loaded diameter: along it and across it.

        Parameters
        ----------
        distance : (n,) array [-]
            From the centre, in radii, from 0 to 1 exclusive.
        """
        rho, angle = np.asarray(distance, dtype=float) ** 2, self.half_angle
        near = (1.0 - rho) * np.sin(2.0 * angle) / (1.0 - 2.0 * rho * np.cos(2.0 * angle) + rho**2)
        far = np.arctan((1.0 + rho) / (1.0 - rho) * np.tan(angle))
        size = 2.0 * self.pressure / np.pi
        return -size * (near + far), size * (near - far)


@dataclass(frozen=True)
class KirschHole:
    """A round hole, free of traction, in an infinite sheet under a uniform tension along x.

    Parameters
    ----------
    tension : float [Pa]
    radius : float [m]
    material : Material

    References
    ----------
    [Kirsch1898]; [TimoshenkoGoodier1970] section 35.
    """

    tension: float
    radius: float
    material: Material

    def __post_init__(self) -> None:
        check_positive(radius=self.radius)

    def rim_displacement(self, angle: FloatArray) -> FloatArray:
        """Return displacements (n, 2) [m] of the rim along x and y at angles [rad] from the x axis.

        u_r = S a / E' (1 + 2 cos 2 angle), u_theta = -2 S a / E' sin 2 angle, far field included.
        """
        angle = np.asarray(angle, dtype=float)
        size = self.tension * self.radius / self.material.plane_modulus
        return np.stack([3.0 * size * np.cos(angle), -size * np.sin(angle)], axis=-1)

    def far_displacement(self, points: FloatArray) -> FloatArray:
        """Return displacements (n, 2) [m] at points [m] from the centre without the hole."""
        nu = self.material.effective_poisson_ratio
        strain = self.tension / self.material.plane_modulus
        return np.asarray(points * np.array([strain, -strain * nu / (1.0 - nu)]))

    def hoop_stress(self, angle: FloatArray) -> FloatArray:
        """Return the hoop stress [Pa] of the rim, S (1 - 2 cos 2 angle)."""
        return np.asarray(self.tension * (1.0 - 2.0 * np.cos(2.0 * np.asarray(angle, dtype=float))))
