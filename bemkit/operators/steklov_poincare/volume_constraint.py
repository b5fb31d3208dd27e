"""Solutions for the free displacements of a body under the uniform pressure that goes with its change of volume."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.solvers import Factor
from bemkit.operators.steklov_poincare.nodal_conditions import turn_columns


@dataclass(frozen=True, eq=False)
class Volume:
    """How the volume of a body changes; the pressure is one more unknown: ``change.T @ u == compliance * pressure``.

    Parameters
    ----------
    change : (n_dofs, 0 or 1) array
        By displacements; the pressure exerts the forces ``change * pressure``. No column for an exterior.
    compliance : float
        By a unit pressure; zero if the body is incompressible. Dividing by it instead would cost the digits of nearly
        incompressible bodies.
    """

    change: FloatArray
    compliance: float

    def in_frames(self, frame: FloatArray) -> Volume:
        """Return the same for displacements in the frames of the nodes."""
        change = self.change.copy()
        turn_columns(change.T, frame)
        return replace(self, change=change)


@dataclass(frozen=True, eq=False)
class VolumeConstraint:
    """Solves for the free displacements and the pressure.

    Parameters
    ----------
    stiffness : Factor
        Of the free directions.
    volume : (n_free, 0 or 1) array
        Their change of volume.
    compliance : float
        See `Volume`.
    """

    stiffness: Factor
    volume: FloatArray
    compliance: float

    @cached_property
    def _compliance(self) -> tuple[FloatArray, FloatArray]:
        """Displacements under a unit pressure, and the volume that they yield."""
        displacement = self.stiffness.solve(self.volume)
        total_compliance = self.volume.T @ displacement + self.compliance
        if total_compliance.size and not total_compliance.min() > 0.0:
            raise SingularMatrixError(
                "the incompressible body (poisson_ratio 0.5) has no free boundary to make room, as supports and "
                "contact take all of it: leave a part free, end the contact part by `where` before the boundary that "
                "never touches, or give a poisson_ratio of 0.4999"
            )
        return displacement, total_compliance

    def solve(self, right: FloatArray, volume: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and pressure for given forces (n_free, ...) and changes of volume (0 or 1, ...)."""
        free = self.stiffness.solve(right)
        if not self.volume.shape[1]:
            return free, np.zeros(volume.shape)
        displacement, total_compliance = self._compliance
        pressure = (self.volume.T @ free - volume) / total_compliance[0, 0]
        return free - displacement @ pressure, pressure


def without_round_off(volume: FloatArray) -> FloatArray:
    """Return the changes of volume (n_dofs, 0 or 1) without round-off.

    What tangential motions change the volume by is round-off, and no room for an incompressible body.
    """
    return np.where(np.abs(volume) > 1e-14 * np.abs(volume).max(initial=0.0), volume, 0.0)
