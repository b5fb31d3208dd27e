"""A half-plane as one of several bodies: its flexibility inverted, its motion far away solved for.

With the flexibility F, the motions R far away and their amounts a, the displacement is ``u = F f + R a``. Motions that
loads drive are unknown: ``R_d^T f + load = 0``. With ``S = F^-1`` on the directions retained or fixed, they leave the
stiffness ``P = S - S R_d (R_d^T S R_d)^-1 R_d^T S``, which does not resist them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.half_plane.far_drive import FarMotion
from bemkit.operators.linear.dense import Cholesky
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, rotated
from bemkit.operators.steklov_poincare.protocol import CondensedMap


@dataclass(frozen=True, eq=False)
class CondensedHalfPlane:
    """A half-plane whose forces on some directions are unknown.

    Parameters
    ----------
    conditions : NodalConditions
    drive : FarMotion
    flexibility : (n_dofs, n_dofs) array [1/Pa]
        In the frames of the nodes.
    motions : (n_dofs, 3) array
        The unit motions far away, in the frames.
    strained : (n_dofs,) array [m]
        Displacements by the strain far away.
    acting, retained : int arrays
        Indices of the directions retained or fixed, and which of these are retained.
    stiffness : (n_acting, n_acting) array [Pa]
        P above.
    spread : (n_acting, n_driven) array
        ``S R_d (R_d^T S R_d)^-1``: forces on acting directions for loads that drive motions; its transpose says how
        displacements of these directions move the half-plane far away.
    resistance : (n_driven, n_driven) array
        ``R_d^T S R_d``.
    """

    conditions: NodalConditions
    drive: FarMotion
    flexibility: FloatArray
    motions: FloatArray
    strained: FloatArray
    acting: IntArray
    retained: IntArray
    stiffness: FloatArray
    spread: FloatArray
    resistance: FloatArray

    @classmethod
    def of(
        cls,
        conditions: NodalConditions,
        drive: FarMotion,
        flexibility: FloatArray,
        points: FloatArray,
        along: FloatArray,
    ) -> CondensedHalfPlane:
        """Invert the flexibility (n_dofs, n_dofs) in x and y of nodes at points (n, 2), with the tangent (2,)."""
        acting = np.flatnonzero(~conditions.is_free)
        turned, frame = rotated(flexibility, conditions.frame), conditions.frame
        motions = np.einsum("nkc,ncm->nkm", frame, drive.motions_at(points)).reshape(-1, 3)
        strain = drive.strain * ((points - np.array(drive.centre)) @ along)[:, None] * along
        stiffness = np.zeros((0, 0))
        if acting.size:
            factor = Cholesky(turned[np.ix_(acting, acting)], "the flexibility of the half-plane")
            stiffness = factor.solve(np.eye(acting.size))
            stiffness = 0.5 * (stiffness + stiffness.T)
        driven = motions[acting][:, list(drive.driven)]
        held = stiffness @ driven
        # a half-plane that nothing touches is not driven against anything
        resistance = driven.T @ held if acting.size else np.eye(len(drive.driven))
        spread = np.linalg.solve(resistance, held.T).T
        stiffness = stiffness - spread @ held.T
        stiffness = 0.5 * (stiffness + stiffness.T)
        retained = np.flatnonzero(conditions.is_retained.ravel()[acting])
        strained = np.einsum("nkc,nc->nk", frame, strain).ravel()
        return cls(conditions, drive, turned, motions, strained, acting, retained, stiffness, spread, resistance)

    @property
    def driven(self) -> FloatArray:
        """(n_dofs, n_driven) array: the motions that loads drive."""
        return self.motions[:, list(self.drive.driven)]

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under nodal forces (n_nodes, 2) in x and y and fixed displacements in the frames."""
        data = GivenData.of(self.conditions, force, displacement)
        given, held = data.force.ravel(), data.displacement.ravel()[self.acting]
        rest = self.flexibility @ given + self.motions @ np.array(self.drive.motion) + self.strained
        load = self.driven.T @ given + np.array(self.drive.load)[list(self.drive.driven)]
        forces = self.stiffness @ (held - rest[self.acting]) - self.spread @ load
        return _HalfPlaneMap(
            stiffness=self.stiffness[np.ix_(self.retained, self.retained)],
            load=-forces[self.retained],
            body=self,
            given=given,
            held=held,
            rest=rest,
            far_load=load,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _HalfPlaneMap(CondensedMap):
    """The half-plane under one load.

    Parameters
    ----------
    body : CondensedHalfPlane
    given : (n_dofs,) array [N/m]
        Given forces in the frames.
    held : (n_acting,) array [m]
        Displacements of acting directions, the retained ones at rest.
    rest : (n_dofs,) array [m]
        Displacements by the given forces, motions and strains.
    far_load : (n_driven,) array
        Of the motions that loads drive, with the given forces.
    """

    body: CondensedHalfPlane
    given: FloatArray
    held: FloatArray
    rest: FloatArray
    far_load: FloatArray

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        displaced = self.held.copy()
        displaced[self.body.retained] = retained_displacement
        everywhere, total = map(self.body.conditions.in_plane, self._response(displaced))
        return everywhere, total

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.body.under(force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what free directions do."""
        body = self.body
        responses = body.flexibility[np.ix_(directions, body.acting)] @ body.stiffness
        responses += body.driven[directions] @ body.spread.T
        return responses[:, body.retained], self._response(self.held)[0][directions]

    def _response(self, displaced: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and forces (n_dofs,) in the frames, those of acting directions given."""
        body = self.body
        stretch = displaced - self.rest[body.acting]
        forces = body.stiffness @ stretch - body.spread @ self.far_load
        moved = body.spread.T @ stretch + np.linalg.solve(body.resistance, self.far_load)
        everywhere = self.rest + body.flexibility[:, body.acting] @ forces + body.driven @ moved
        total = self.given.copy()
        everywhere[body.acting], total[body.acting] = displaced, forces
        return everywhere, total
