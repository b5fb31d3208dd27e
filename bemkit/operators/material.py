"""Isotropic linear elasticity in the plane."""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass

from bemkit.errors import InputError

_LEAST_COMPRESSIBILITY = 1e-4
"""1 - 2 nu below which volume and shape are kept apart: one stiffness of both loses the digits of the shape, and an
error of its pressures, of the square of the length of an element, has negative energy on coarse meshes."""


class Plane(enum.Enum):
    """The two plane states: strain (long bodies) and stress (thin plates)."""

    STRAIN = "strain"
    STRESS = "stress"


@dataclass(frozen=True)
class Material:
    """An isotropic elastic material in a plane state.

    Parameters
    ----------
    youngs_modulus : float [Pa]
        Positive and finite.
    poisson_ratio : float [-]
        Larger than -1 and at most 1/2; 1/2 is incompressible.
    plane : Plane
        Plane strain by default.

    Raises
    ------
    ValueError
        If the modulus is not positive and finite, Poisson's ratio is outside of (-1, 1/2], or `plane` is no `Plane`.

    Notes
    -----
    Plane stress is plane strain with nu / (1 + nu) in place of nu and the same shear modulus. So operators depend only
    on `shear_modulus` and `effective_poisson_ratio`.
    """

    youngs_modulus: float
    poisson_ratio: float
    plane: Plane = Plane.STRAIN

    def __post_init__(self) -> None:
        if not (math.isfinite(self.youngs_modulus) and self.youngs_modulus > 0.0):
            msg = f"youngs_modulus is {self.youngs_modulus}: give a positive, finite number of pascals"
            raise InputError(msg)
        if not -1.0 < self.poisson_ratio <= 0.5:
            msg = f"poisson_ratio is {self.poisson_ratio}: it must lie in (-1, 0.5]"
            raise InputError(msg)
        if not isinstance(self.plane, Plane):
            raise InputError(f"plane is {self.plane!r}: give Plane.STRAIN or Plane.STRESS")

    @property
    def shear_modulus(self) -> float:
        """Shear modulus mu [Pa]."""
        return self.youngs_modulus / (2.0 * (1.0 + self.poisson_ratio))

    @property
    def effective_poisson_ratio(self) -> float:
        """The Poisson ratio [-] of the plane-strain formulas."""
        if self.plane is Plane.STRESS:
            return self.poisson_ratio / (1.0 + self.poisson_ratio)
        return self.poisson_ratio

    @property
    def is_incompressible(self) -> bool:
        """Whether the volume cannot change: plane strain with Poisson's ratio 1/2 to round-off."""
        return self.effective_poisson_ratio > 0.5 - 1e-12

    @property
    def is_nearly_incompressible(self) -> bool:
        """Whether a change of volume takes 1e4 times the stress of a change of shape, or is impossible."""
        return 1.0 - 2.0 * self.effective_poisson_ratio < _LEAST_COMPRESSIBILITY

    @property
    def bulk_modulus(self) -> float:
        """Tension along x and y by the strain along both [Pa]; zero of an incompressible body, which has no strain."""
        return 0.0 if self.is_incompressible else 1.0 / self.plane_compressibility

    @property
    def plane_compressibility(self) -> float:
        """Strain along x and y under a unit tension along both [1/Pa]: (1 - 2 nu) / (2 mu) in plane strain."""
        return (1.0 - 2.0 * self.effective_poisson_ratio) / (2.0 * self.shear_modulus)

    @property
    def kappa(self) -> float:
        """Kolosov's constant [-]: 3 - 4 nu in plane strain, (3 - nu) / (1 + nu) in plane stress."""
        return 3.0 - 4.0 * self.effective_poisson_ratio

    @property
    def plane_modulus(self) -> float:
        """E' [Pa]: E / (1 - nu^2) in plane strain, E in plane stress."""
        return 2.0 * self.shear_modulus / (1.0 - self.effective_poisson_ratio)

    def scaled(self, stress: float) -> Material:
        """Return the same material with `stress` [Pa] as unit of stress."""
        return Material(self.youngs_modulus / stress, self.poisson_ratio, self.plane)
