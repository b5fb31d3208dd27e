"""Condensation of a Galerkin map by iteration, with products with S alone."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.linear.solvers import Factor
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare.free_stiffness import FreeStiffness
from bemkit.operators.steklov_poincare.protocol import CondensedMap
from bemkit.operators.steklov_poincare.volume_constraint import Volume, VolumeConstraint, without_round_off

_FREE_MOTION_TOLERANCE = 1e-9
"""A rigid motion that moves the held and retained directions by less, relative to its size, is free of them."""
_ROWS = 256


def check_is_held(stiffness: FreeStiffness, points: FloatArray, name: str) -> None:
    """Raise if the held and retained directions leave the body a rigid motion.

    A factorisation would meet a pivot of zero; an iteration does not notice.

    Raises
    ------
    SingularMatrixError
        Naming what is not held.
    """
    motions = stiffness.to_frames(traction_free_modes(stiffness.space.mesh, points))
    held = motions[~stiffness.conditions.is_free.ravel()]
    sizes = np.linalg.svd(held, compute_uv=False) if held.size else np.zeros(0)
    if motions.shape[1] and (
        sizes.size < motions.shape[1]
        or not sizes.min() > _FREE_MOTION_TOLERANCE * np.linalg.norm(motions, axis=0).max()
    ):
        raise SingularMatrixError(f"{name} is not positive definite: check for supports that leave the body free")


@dataclass(frozen=True, eq=False)
class IterativeCondensation:
    """A body reduced to its retained directions, in the frames of the nodes.

    Parameters
    ----------
    stiffness : FreeStiffness
    factor : Factor
        Solves for the free directions.
    volume : Volume

    Notes
    -----
    Let E hold the displacements of all directions for a unit displacement of each retained one, and u0 those under the
    given data with the retained ones at zero, both with free directions as the iteration left them. Then E^T S E is the
    stiffness and E^T (f - S u0) the load: their errors are products of two errors of the iteration, and the stiffness
    is symmetric and positive semidefinite whatever these are.
    """

    stiffness: FreeStiffness
    factor: Factor
    volume: Volume

    @cached_property
    def _retained(self) -> IntArray:
        return np.flatnonzero(self.stiffness.conditions.is_retained)

    @cached_property
    def _fixed(self) -> IntArray:
        return np.flatnonzero(self.stiffness.conditions.is_fixed)

    @cached_property
    def _held(self) -> VolumeConstraint:
        change = without_round_off(self.volume.change)[self.stiffness.free]
        return VolumeConstraint(self.factor, change, self.volume.yields)

    @cached_property
    def _sensitivity(self) -> FloatArray:
        """That of W, which is less than that of S."""
        hyper = self.stiffness.layers.hypersingular
        total = np.zeros(len(hyper))
        for begin in range(0, len(hyper), _ROWS):  # the absolute values of all at once would be a matrix more
            total += np.abs(hyper[begin : begin + _ROWS]).sum(axis=0)
        return total.reshape(-1, 2)

    def condense(self, force: FloatArray, work: OperationCounts) -> CondensedMap:
        """Solve for all retained directions and for the given data in one block.

        Parameters
        ----------
        force : (n_nodes, 2) array
            Given nodal forces.
        work : OperationCounts
            Done before.

        Returns
        -------
        CondensedMap
        """
        unit = np.zeros((self.stiffness.space.n_dofs, self._retained.size))
        unit[self._retained, np.arange(self._retained.size)] = 1.0
        moved, known = self._given(force, self.stiffness.conditions.displacement)
        solved = self._solved(np.column_stack([unit, moved]), known)
        own = OperationCounts(right_hand_sides=self._retained.size + 1 + self.volume.change.shape[1])
        return self._map(solved.columns(slice(None, -1)), solved.columns(-1), force, work + own)

    def _given(self, force: FloatArray, displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the prescribed displacements (n_dofs,) and the given forces on free directions (n_free,)."""
        moved = np.zeros(self.stiffness.space.n_dofs)
        moved[self._fixed] = displacement.ravel()[self._fixed]
        return moved, self.stiffness.to_frames(force.reshape(-1, 1))[self.stiffness.free, 0]

    def _solved(self, moved: FloatArray, known: FloatArray) -> _Fields:
        """Fill in the free directions of given displacements (n_dofs, m); `known` acts on those of the last column."""
        free = self.stiffness.free
        right = -self.stiffness.forces(moved)[free]
        right[:, -1] += known
        displacements = moved.copy()
        displacements[free], pressures = self._held.solve(right, -self.volume.change.T @ moved)
        return _Fields(displacements, self.stiffness.forces(displacements) + self.volume.change @ pressures)

    def _map(self, response: _Fields, at_rest: _Fields, force: FloatArray, work: OperationCounts) -> CondensedMap:
        given = self.stiffness.to_frames(force.reshape(-1, 1))[:, 0]
        # the pressure of an incompressible body does no work on displacements that keep the volume
        stiffness = response.displacements.T @ response.forces
        load = response.displacements.T @ (given - at_rest.forces)

        def recover(retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
            local = [
                at_rest.displacements + response.displacements @ retained_displacement,
                at_rest.forces + response.forces @ retained_displacement,
            ]
            both = self.stiffness.to_xy(np.column_stack(local))
            return both[:, 0].reshape(-1, 2), both[:, 1].reshape(-1, 2)

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            moved, known = self._given(force, displacement)
            solved = self._solved(moved[:, None], known)
            return self._map(response, solved.columns(0), force, OperationCounts(right_hand_sides=1))

        def follow(directions: IntArray) -> tuple[FloatArray, FloatArray]:
            return response.displacements[directions], at_rest.displacements[directions]

        stiffness = 0.5 * (stiffness + stiffness.T)
        counts = self.factor.iterations, work
        return CondensedMap(stiffness, load, recover, under, follow, self._sensitivity, *counts)


@dataclass(frozen=True, eq=False)
class _Fields:
    """Displacements and forces, (n_dofs,) or (n_dofs, m) each, in the frames of the nodes."""

    displacements: FloatArray
    forces: FloatArray

    def columns(self, chosen: int | slice) -> _Fields:
        """Return some of the columns."""
        return _Fields(self.displacements[:, chosen], self.forces[:, chosen])
