"""Fields inside a body from two complex potentials; see `bemkit.operators.somigliana.fields`."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray
from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.operators.somigliana.stress import gradient_of, stress_of


class Background(Protocol):
    """A field in the whole body that is added to that of the boundary data, such as a particular solution."""

    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2) displacement [m] at (n, 2) points [m]."""

    def displacement_gradient(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) displacement gradient [-]."""

    def stress(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) stress [Pa]."""


class PotentialFields(ABC):
    """Displacement, its gradient, strain and stress at points inside a body.

    Attributes
    ----------
    material : Material
    background : Background or None
        Field to be added.
    """

    material: Material
    background: Background | None

    @abstractmethod
    def is_inside(self, points: FloatArray) -> BoolArray:
        """Return the (n,) mask of the (n, 2) points [m] that lie strictly inside the body."""

    @abstractmethod
    def displacement(self, points: FloatArray) -> FloatArray:
        """Evaluate the displacement.

        Parameters
        ----------
        points : (n, 2) array [m]
            Points strictly inside the body.

        Returns
        -------
        (n, 2) array [m]

        Raises
        ------
        PointNotInsideError
            If a point is not inside; the message gives the first one.
        """

    @abstractmethod
    def potentials(self, points: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Return Phi and D (n,) [Pa], without the background."""

    def displacement_gradient(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) displacement gradient, [:, i, j] = du_i / dx_j; see `displacement`."""
        potential, shear = self.potentials(points)
        kappa, two_mu = self.material.kappa, 2.0 * self.material.shear_modulus
        gradient = gradient_of((kappa * potential - potential.conj()) / two_mu, shear / two_mu)
        return gradient if self.background is None else gradient + self.background.displacement_gradient(points)

    def strain(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) strain, the symmetric part of the gradient; see `displacement`."""
        gradient = self.displacement_gradient(points)
        return 0.5 * (gradient + np.swapaxes(gradient, 1, 2))

    def stress(self, points: FloatArray) -> FloatArray:
        """Evaluate the (n, 2, 2) stress [Pa]; see `displacement`."""
        potential, shear = self.potentials(points)
        stress = stress_of(2.0 * potential.real, shear)
        return stress if self.background is None else stress + self.background.stress(points)


def as_points(points: FloatArray) -> FloatArray:
    """Return points as an (n, 2) array, or raise InputError."""
    points = np.asarray(points, dtype=float)
    if points.ndim != 2 or points.shape[1] != 2 or not np.isfinite(points).all():
        raise InputError(f"points has the shape {points.shape}: give an (n, 2) array of finite coordinates")
    return points
