"""Estimated errors of the tractions on the surface of a half-plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.error_indicators import LOCAL_CALIBRATION, ky_fan_distance, mean_traction_errors


@dataclass(frozen=True, eq=False)
class SurfaceErrors:
    """Errors of constant tractions, and the sizes to which they are relative.

    Parameters
    ----------
    lengths : (n_elements,) array [m]
    sizes : (n_elements,) array [Pa]
        Of the tractions, zero where loads give them.
    errors : (n_elements,) array [N/m]
        Estimated, over each element; zero where loads give the tractions.
    total : float [N/m]
        The integral of the sizes; of several load steps the largest.
    """

    lengths: FloatArray
    sizes: FloatArray
    errors: FloatArray
    total: float

    @classmethod
    def of(cls, mesh: BoundaryMesh, traction: FloatArray, is_loaded: BoolArray) -> SurfaceErrors:
        """Estimate the errors of tractions (n_elements, 2) without loads."""
        sizes = np.where(is_loaded, 0.0, np.linalg.norm(traction, axis=1))
        errors = np.where(is_loaded, 0.0, mean_traction_errors(mesh, traction))
        return cls(mesh.lengths, sizes, errors, float(mesh.lengths @ sizes))

    def at_worst(self, others: Sequence[SurfaceErrors]) -> SurfaceErrors:
        """Return the largest errors of several load steps, relative to the largest of their totals."""
        largest = np.stack([other.errors for other in others]).max(axis=0)
        return replace(self, errors=largest, total=max(other.total for other in others))

    @property
    def in_the_mean(self) -> float | None:
        """The errors together, relative to the tractions; None without tractions."""
        return float(self.errors.sum()) / self.total if self.total > 0.0 else None

    @cached_property
    def local(self) -> FloatArray:
        """(n_elements,) array [-]: errors by the length of their element, relative to its traction.

        Tractions below their mean count as the mean.
        """
        carrying = float(self.lengths @ (self.sizes > 0.0))
        mean = self.total / carrying if carrying else 1.0
        return np.asarray(LOCAL_CALIBRATION * self.errors / (self.lengths * np.maximum(self.sizes, mean)))

    @property
    def largest(self) -> float | None:
        """The largest local error, except on a share of the length no larger than itself; None without tractions."""
        return ky_fan_distance(self.local, self.lengths) if self.total > 0.0 else None
