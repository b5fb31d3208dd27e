"""Condensation of a Galerkin map by a Schur complement of its matrix."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from bemkit.arrays import FloatArray, IntArray, block_of
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import Factor, LinearSolver, multiply
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, rotated
from bemkit.operators.steklov_poincare.volume_constraint import Volume, without_round_off

_ROWS = 128
"""Rows of a matrix that are copied at a time."""


@dataclass(eq=False)
class SchurCondensation:
    """A body reduced to its retained directions; the free ones are eliminated from S.

    So is the uniform pressure, unless it is one more retained unknown; see `Volume.retained_pressure`.

    Parameters
    ----------
    matrix : (n_dofs, n_dofs) array
        S in x and y, without the uniform pressure.
    volume : Volume
        Change of volume per displacement in x and y.
    conditions : NodalConditions
    solver : LinearSolver
    name : str
        Name of the free block in error messages.

    Raises
    ------
    SingularMatrixError
        If the body can move while its supports and its retained directions are held, or if supports leave an
        incompressible body no free boundary.
    """

    matrix: FloatArray
    volume: Volume
    conditions: NodalConditions
    solver: LinearSolver
    name: str
    factor: Factor = field(init=False)

    def __post_init__(self) -> None:
        conditions = self.conditions
        matrix = rotated(self.matrix, conditions.frame)
        self._free, self._retained, self._fixed = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_retained, conditions.is_fixed)
        )
        self.factor = self.solver.factor(block_of(matrix, self._free, self._free), self.name)
        self._of_fixed = matrix[:, self._fixed]
        volume = self.volume.in_frames(conditions.frame)
        unit = volume.retained_pressure(conditions, float(np.abs(np.diagonal(matrix)).max()))
        self._volume, self._by_pressure = volume.change, volume.change @ unit
        # of a pressure that is eliminated: its free forces, their displacements, and the change of volume
        self._of_pressure = pressed = without_round_off(volume.change)[self._free, : 0 if unit.size else None]
        self._under_pressure = self.factor.solve(pressed) if pressed.size else pressed
        self._compliance = self._of_pressure.T @ self._under_pressure + volume.compliance
        coupling, stiffness = (block_of(matrix, rows, self._retained) for rows in (self._free, self._retained))
        if unit.size:
            forces = self._by_pressure[self._retained]
            coupling = np.hstack([coupling, self._by_pressure[self._free]])
            stiffness = np.block([[stiffness, forces], [forces.T, -volume.compliance * unit**2]])
        self._coupling = coupling
        self._of_volume = np.pad(volume.change[self._retained], ((0, unit.shape[1]), (0, 0)))
        self._response, self._pressures = self._solve(-coupling, -self._of_volume.T)
        stiffness = stiffness + multiply(coupling.T, self._response)
        stiffness += self._of_volume @ self._pressures
        self._stiffness = 0.5 * (stiffness + stiffness.T)
        self._pressures[:, self._retained.size :] = unit
        rows = (self.matrix[first : first + _ROWS] for first in range(0, len(self.matrix), _ROWS))
        self._sensitivity = sum(np.abs(chunk).sum(axis=0) for chunk in rows).reshape(-1, 2)

    def _solve(self, right: FloatArray, volume: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return free displacements and pressure for forces (n_free, ...) and changes of volume (0 or 1, ...)."""
        free = self.factor.solve(right)
        if not self._of_pressure.shape[1]:
            return free, np.zeros(volume.shape)
        pressure = (self._of_pressure.T @ free - volume) / self._compliance[0, 0]
        return free - self._under_pressure @ pressure, pressure

    @property
    def work(self) -> OperationCounts:
        """Return the operation counts of the elimination."""
        n_columns = self._retained.size + self._volume.shape[1]  # a pressure is retained or eliminated
        return OperationCounts(factorisations=self.factor.factorisations, right_hand_sides=n_columns)

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the condensed map under given forces (n_nodes, 2), and displacements (n_nodes, 2) in the frames."""
        prescribed = displacement.ravel()[self._fixed]
        known = self.conditions.in_frames(force).ravel() - self._of_fixed @ prescribed
        at_rest, pressure = self._solve(known[self._free], -self._volume[self._fixed].T @ prescribed)
        load = np.append(known[self._retained], -self._by_pressure[self._fixed].T @ prescribed)
        load -= self._coupling.T @ at_rest + self._of_volume @ pressure
        return _SchurMap(
            stiffness=self._stiffness,
            load=load,
            n_pressures=self._by_pressure.shape[1],
            sensitivity=self._sensitivity,
            work=OperationCounts(right_hand_sides=1),
            condensation=self,
            prescribed=prescribed,
            at_rest=at_rest,
            pressure=pressure,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _SchurMap(CondensedMap):
    """The body under one load."""

    condensation: SchurCondensation
    prescribed: FloatArray  # (n_fixed,) [m]
    at_rest: FloatArray  # (n_free,) [m], while the retained directions are at rest
    pressure: FloatArray  # (n_pressures,), zero unless it is eliminated

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all nodes."""
        body = self.condensation
        local = np.empty(len(body.matrix))
        local[body._fixed], local[body._retained] = self.prescribed, retained_displacement[: body._retained.size]
        local[body._free] = self.at_rest + body._response @ retained_displacement
        displacement = body.conditions.in_plane(local)
        force = body.matrix @ displacement.ravel()
        force += body.volume.change @ (self.pressure + body._pressures @ retained_displacement)
        return displacement, force.reshape(-1, 2)

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.condensation.under(force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        rows = np.searchsorted(self.condensation._free, directions)
        return self.condensation._response[rows], self.at_rest[rows]
