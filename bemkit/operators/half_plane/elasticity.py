"""The half-plane as an elastic map: its flexibility, inverted where contact or supports act."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.spaces import dof_points
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.half_plane.far_drive import FarDrive
from bemkit.operators.half_plane.flexibility import strip_flexibility
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.linear.dense import Cholesky, SingularMatrixError
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, rotated
from bemkit.operators.steklov_poincare.protocol import CondensedMap

_ROUND_OFF = 1e-10
"""Share of a motion that counts as none."""


@dataclass(frozen=True, eq=False)
class HalfPlaneElasticity(SurfaceElasticity):
    """Elasticity of a half-plane seen from a strip of its surface; see `SurfaceElasticity`.

    Parameters
    ----------
    kept : dict
        The last condensation, to be used again under other loads.
    """

    kept: dict[str, _Condensation] = field(default_factory=dict, repr=False)

    @cached_property
    def flexibility(self) -> FloatArray:
        """(n_dofs, n_dofs) array [1/Pa] from forces to displacements, in x and y; see `strip_flexibility`."""
        return strip_flexibility(self.mesh, self.material)

    def strain_displacement(self, force: FloatArray) -> FloatArray:
        """Return the displacements (n_nodes, 2) that nodal forces (n_nodes, 2) cause, without those of the drive."""
        return np.asarray((self.flexibility @ force.ravel()).reshape(-1, 2))

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for the forces on retained and fixed directions; see `SteklovPoincare.condense`."""
        condensation = self.kept.get("condensation")
        if condensation is None or not condensation.is_of(self.drive, conditions):
            condensation = self.kept["condensation"] = _Condensation.of(self, conditions)
        condensed = replace(condensation, drive=self.drive).under(force, conditions.displacement)
        return replace(condensed, work=half_plane_work(self.mesh.n_elements, condensation.acting.size))


def half_plane_work(n_elements: int, n_acting: int) -> OperationCounts:
    """Return what a condensation takes with `n_acting` directions that are retained or fixed."""
    return OperationCounts(
        element_pairs=n_elements**2,
        single_layer=Entries.full(2 * n_elements, 2 * n_elements),
        factorisations=(Factorisation(FactorKind.CHOLESKY, n_acting),) if n_acting else (),
        right_hand_sides=n_acting,
    )


def _check_resisted(motions: FloatArray, drive: FarDrive) -> None:
    """Refuse loads far away that drive a motion which no direction (n_acting, 3) resists, and a turn about one node."""
    driven = motions[:, list(drive.driven)]
    if np.linalg.matrix_rank(driven, _ROUND_OFF * max(float(np.abs(driven).max(initial=0.0)), 1.0)) < len(drive.driven):
        loads = " and ".join(f"far.{('force_x', 'force_y', 'moment')[k]}" for k in drive.driven)
        raise SingularMatrixError(
            f"{loads} drive the half-plane along a motion that its {len(motions)} directions in contact or held leave "
            "free: give the motion instead of the load, or more elements in contact"
        )


@dataclass(frozen=True, eq=False)
class _Condensation:
    """A half-plane whose forces on some directions are unknown.

    With the flexibility F, unit motions R and their amounts q the displacements are ``u = F f + R q``. On the acting
    directions, those retained or fixed, ``f = stiffness (u - F f_given - R q)``, and of the driven motions
    ``R^T f = -load``.

    Parameters
    ----------
    drive : FarDrive
    conditions : NodalConditions
    flexibility : (n_dofs, n_dofs) array [1/Pa]
        In the frames of the nodes.
    motions : (n_dofs, 3) array
        In the frames of the nodes.
    acting, retained : int arrays
        Numbers of these directions, and which of the acting ones are retained.
    stiffness : (n_acting, n_acting) array [Pa]
        Of the acting directions while all motions are given.
    """

    drive: FarDrive
    conditions: NodalConditions
    flexibility: FloatArray
    motions: FloatArray
    acting: IntArray
    retained: IntArray
    stiffness: FloatArray

    @classmethod
    def of(cls, elastic: HalfPlaneElasticity, conditions: NodalConditions) -> _Condensation:
        frame = conditions.frame
        flexibility = rotated(elastic.flexibility, frame)
        motions = np.einsum("nkc,ncm->nkm", frame, elastic.drive.motions_at(dof_points(elastic.displacement_space)))
        acting = np.flatnonzero(~conditions.is_free)
        _check_resisted(motions.reshape(-1, 3)[acting], elastic.drive)
        retained = np.flatnonzero(conditions.is_retained.ravel()[acting])
        stiffness = np.zeros((0, 0))
        if acting.size:
            factor = Cholesky(flexibility[np.ix_(acting, acting)], "the flexibility of the half-plane")
            stiffness = factor.solve(np.eye(acting.size))
            stiffness = 0.5 * (stiffness + stiffness.T)
        return cls(elastic.drive, conditions, flexibility, motions.reshape(-1, 3), acting, retained, stiffness)

    def is_of(self, drive: FarDrive, conditions: NodalConditions) -> bool:
        """Whether other conditions and another drive differ only in numbers."""
        own = self.conditions
        return (
            (drive.driven, drive.centre) == (self.drive.driven, self.drive.centre)
            and np.array_equal(conditions.frame, own.frame)
            and np.array_equal(conditions.is_retained, own.is_retained)
            and np.array_equal(conditions.is_fixed, own.is_fixed)
        )

    @property
    def driven(self) -> FloatArray:
        """(n_dofs, n_driven) array: the motions that loads drive."""
        return self.motions[:, list(self.drive.driven)]

    @cached_property
    def yields(self) -> FloatArray:
        """(n_acting, n_driven) array [Pa]: forces that unit driven motions take."""
        return np.asarray(self.stiffness @ self.driven[self.acting])

    @cached_property
    def _per_load(self) -> FloatArray:
        """(n_driven, n_driven) array [1/Pa]: driven motions per load."""
        return np.asarray(np.linalg.inv(self.driven[self.acting].T @ self.yields))

    @cached_property
    def released(self) -> FloatArray:
        """(n_acting, n_acting) array [Pa]: the stiffness where driven motions follow."""
        return np.asarray(self.stiffness - self.yields @ self._per_load @ self.yields.T)

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under nodal forces (n_nodes, 2) in x and y and fixed displacements in the frames."""
        conditions, drive, retained = self.conditions, self.drive, self.retained
        data = GivenData.of(conditions, force, displacement)
        given = data.force.ravel()
        loaded = _Loaded(
            body=self,
            given=given,
            held=data.displacement.ravel()[self.acting],
            rest=self.flexibility @ given + self.motions @ np.array(drive.motion),
            load=np.array(drive.load)[list(drive.driven)] + self.driven.T @ given,
        )
        return CondensedMap(
            stiffness=self.released[np.ix_(retained, retained)],
            load=-loaded.acting_forces(loaded.held)[0][retained],
            recover=loaded.recover,
            under=self.under,
            follow=loaded.follow,
            volume_force=np.array(drive.load),
            inner_force=abs(drive.load[2]),  # lengths are measured by that of the strip
        )

    def forces(self, held: FloatArray, load: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the forces on acting directions displaced by `held` beside what they do at rest, and the motions."""
        motion = self._per_load @ (self.yields.T @ held + load)
        return self.stiffness @ held - self.yields @ motion, motion

    def responses(self, directions: IntArray) -> FloatArray:
        """Return the displacements (k, n_retained) of directions under those of the retained ones."""
        follows = self.flexibility[np.ix_(directions, self.acting)] @ self.released[:, self.retained]
        return np.asarray(follows + self.driven[directions] @ (self._per_load @ self.yields[self.retained].T))


@dataclass(frozen=True, eq=False)
class _Loaded:
    """A half-plane under one load.

    Parameters
    ----------
    body : _Condensation
    given : (n_dofs,) array [N/m]
        Forces in the frames.
    held : (n_acting,) array [m]
        Displacements of acting directions, the retained ones at rest.
    rest : (n_dofs,) array [m]
        Displacements that forces cause where nothing holds, and far motions.
    load : (n_driven,) array [N/m]
        On the driven motions.
    """

    body: _Condensation
    given: FloatArray
    held: FloatArray
    rest: FloatArray
    load: FloatArray

    def acting_forces(self, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the forces on acting directions displaced by `held`, and the driven motions."""
        return self.body.forces(held - self.rest[self.body.acting], self.load)

    def response(self, held: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and forces (n_dofs,) of all directions, in the frames."""
        body = self.body
        forces, motion = self.acting_forces(held)
        displaced = self.rest + body.flexibility[:, body.acting] @ forces + body.driven @ motion
        displaced[body.acting] = held
        total = self.given.copy()
        total[body.acting] = forces
        return displaced, total

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """See `CondensedMap`."""
        at = self.held.copy()
        at[self.body.retained] = retained_displacement
        displaced, total = map(self.body.conditions.in_plane, self.response(at))
        return displaced, total

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """See `CondensedMap`."""
        return self.body.responses(directions), self.response(self.held)[0][directions]
