"""The change of volume of a body, and the uniform pressure that belongs to it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.steklov_poincare.nodal_conditions import SLIDES, NodalConditions, turn_columns


@dataclass(frozen=True, eq=False)
class Volume:
    """Change of volume of a body, with the uniform pressure as unknown: ``change.T @ u == compliance * pressure``.

    Parameters
    ----------
    change : (n_dofs, 0 or 1) array
        Change of volume per displacement; the pressure exerts the forces ``change * pressure``. An exterior has no
        column.
    compliance : float
        Change of volume per pressure, zero for an incompressible body. Without the pressure as unknown, a division by
        it would cost digits in nearly incompressible bodies.
    is_stiff : bool
        Whether a division by the compliance costs too many digits; see `Material.is_nearly_incompressible`.
    """

    change: FloatArray
    compliance: float
    is_stiff: bool

    def in_frames(self, frame: FloatArray) -> Volume:
        """Return the change of volume per displacement in the frames of the nodes."""
        change = self.change.copy()
        turn_columns(change.T, frame)
        return replace(self, change=change)

    def retained_pressure(self, conditions: NodalConditions, stiffness: float) -> FloatArray:
        """Return the unit of a pressure that only retained displacements determine, as column of an array.

        This is so if the body is nearly incompressible and all its free directions slide along the boundary. Until
        contact is known, nothing then decides whether a displacement of the retained directions keeps the volume.

        Parameters
        ----------
        conditions : NodalConditions
            In whose frames this change of volume is.
        stiffness : float [Pa]
            Largest force of the body by a unit displacement; a unit of the pressure causes forces of this size.

        Returns
        -------
        (0 or 1, 0 or 1) array [Pa]
            Without column if the pressure can be eliminated.

        Raises
        ------
        SingularMatrixError
            If no retained displacement changes the volume of an incompressible body, either.
        """
        n_pressures = self.change.shape[1]
        if not (self.is_stiff and n_pressures):
            return np.zeros((n_pressures, 0))
        at_nodes = without_round_off(self.change).reshape(-1, 2, n_pressures)
        sizes = np.linalg.norm(at_nodes, axis=1, keepdims=True)
        is_changing = np.any(np.abs(at_nodes) > SLIDES * sizes, axis=2)
        if np.any(is_changing & conditions.is_free):
            return np.zeros((n_pressures, 0))
        if not np.any(is_changing & conditions.is_retained):
            if self.compliance:
                return np.zeros((n_pressures, 0))
            raise SingularMatrixError(
                "the incompressible body (poisson_ratio 0.5) has no free boundary, because supports take all of it: "
                "leave a part free, or give a poisson_ratio of 0.499999"
            )
        return np.array([[stiffness / np.abs(self.change).max()]])


def without_round_off(volume: FloatArray) -> FloatArray:
    """Return the changes of volume (n_dofs, 0 or 1) with round-off replaced by zero.

    Tangential motions change the volume by round-off only, which must not appear as compliance of an incompressible
    body.
    """
    return np.where(np.abs(volume) > 1e-14 * np.abs(volume).max(initial=0.0), volume, 0.0)
