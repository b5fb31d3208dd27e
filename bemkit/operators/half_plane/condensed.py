"""A half-plane as one of several bodies: the inverse of its flexibility, with the far motion eliminated.

With the flexibility F, the far rigid motions R and their amplitudes a, the displacement is ``u = F f + R a``. The
amplitudes of load-controlled motions R_d are unknown: ``R_d^T f + load = 0``. With ``S = F^-1`` on the retained and
fixed directions, their elimination leaves the stiffness ``P = S - S R_d (R_d^T S R_d)^-1 R_d^T S``, which does not
resist them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.half_plane.far_motion import FarMotion
from bemkit.operators.linear_solvers import Cholesky
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, rotated


@dataclass(eq=False)
class CondensedHalfPlane:
    """A half-plane with unknown forces on its retained and fixed directions, together the acting ones.

    Parameters
    ----------
    conditions : NodalConditions
    far_motion : FarMotion
    flexibility : (n_dofs, n_dofs) array [1/Pa]
        In x and y.
    points : (n_nodes, 2) array [m]
    along : (2,) array
        Tangent of the surface.
    """

    conditions: NodalConditions
    far_motion: FarMotion
    flexibility: FloatArray
    points: FloatArray
    along: FloatArray

    def __post_init__(self) -> None:
        conditions, far_motion, frame = self.conditions, self.far_motion, self.conditions.frame
        self.acting = acting = np.flatnonzero(~conditions.is_free)
        self.retained = np.flatnonzero(conditions.is_retained.ravel()[acting])
        self.in_frames = rotated(self.flexibility, frame)
        self.motions = np.einsum("nkc,ncm->nkm", frame, far_motion.motions_at(self.points)).reshape(-1, 3)
        arms = ((self.points - np.array(far_motion.centre)) @ self.along)[:, None] * self.along
        self.strained = np.einsum("nkc,nc->nk", frame, far_motion.strain * arms).ravel()
        stiffness = np.zeros((0, 0))
        if acting.size:
            factor = Cholesky(self.in_frames[np.ix_(acting, acting)], "the flexibility of the half-plane")
            stiffness = factor.solve(np.eye(acting.size))
            stiffness = 0.5 * (stiffness + stiffness.T)
        forces = stiffness @ self.load_controlled[acting]  # S R_d
        # without acting directions nothing resists the far motion: any resistance will do
        n_load_controlled = len(far_motion.load_controlled)
        self.resistance = self.load_controlled[acting].T @ forces if acting.size else np.eye(n_load_controlled)
        # forces under unit far loads; its transpose maps displacements to the far motion
        self.far_response = np.linalg.solve(self.resistance, forces.T).T
        stiffness = stiffness - self.far_response @ forces.T
        self.stiffness = 0.5 * (stiffness + stiffness.T)  # P above

    @property
    def load_controlled(self) -> FloatArray:
        """(n_dofs, n_load_controlled) array: the load-controlled unit motions."""
        return np.asarray(self.motions[:, list(self.far_motion.load_controlled)])

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under nodal forces (n_nodes, 2) in x and y and fixed displacements in the frames."""
        data = GivenData.of(self.conditions, force, displacement)
        given, prescribed = data.force.ravel(), data.displacement.ravel()[self.acting]
        force_free = self.in_frames @ given + self.motions @ np.array(self.far_motion.motion) + self.strained
        load = self.load_controlled.T @ given + np.array(self.far_motion.load)[list(self.far_motion.load_controlled)]
        forces = self.stiffness @ (prescribed - force_free[self.acting]) - self.far_response @ load
        return _HalfPlaneMap(
            stiffness=self.stiffness[np.ix_(self.retained, self.retained)],
            load=-forces[self.retained],
            body=self,
            given=given,
            prescribed=prescribed,
            force_free=force_free,
            far_load=load,
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class _HalfPlaneMap(CondensedMap):
    """The half-plane under one load; arrays are in the frames."""

    body: CondensedHalfPlane
    given: FloatArray  # (n_dofs,) [N/m]
    prescribed: FloatArray  # (n_acting,) [m], zero on retained directions
    force_free: FloatArray  # (n_dofs,) [m]: displacements without forces on acting directions
    far_load: FloatArray  # (n_load_controlled,): work of all given forces on the load-controlled unit motions

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        acting_displacement = self.prescribed.copy()
        acting_displacement[self.body.retained] = retained_displacement
        displacement, force = map(self.body.conditions.in_plane, self._response(acting_displacement))
        return displacement, force

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.body.under(force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        body = self.body
        responses = body.in_frames[np.ix_(directions, body.acting)] @ body.stiffness
        responses += body.load_controlled[directions] @ body.far_response.T
        return responses[:, body.retained], self._response(self.prescribed)[0][directions]

    def _response(self, acting_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and forces (n_dofs,) in the frames under displacements (n_acting,)."""
        body = self.body
        stretch = acting_displacement - self.force_free[body.acting]
        acting_force = body.stiffness @ stretch - body.far_response @ self.far_load
        amplitudes = body.far_response.T @ stretch + np.linalg.solve(body.resistance, self.far_load)
        strain_displacement = body.in_frames[:, body.acting] @ acting_force
        displacement = self.force_free + strain_displacement + body.load_controlled @ amplitudes
        force = self.given.copy()
        displacement[body.acting], force[body.acting] = acting_displacement, acting_force
        return displacement, force
