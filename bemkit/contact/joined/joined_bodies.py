"""Several elastic bodies in mutual contact as one `LinearBody`, and how far they are from equilibrium."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, FreeMotion, LinearBody, SingularResponse
from bemkit.contact.dense_body import DenseBody
from bemkit.contact.equilibrium import NOISE_FACTOR, Imbalance
from bemkit.contact.joined.coupled_members import CoupledMembers, for_all_loads
from bemkit.contact.joined.dense_form import RelativeStiffness
from bemkit.contact.joined.sparse_form import sparse_response
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import RigidMotions, as_dense

LIGHTEST = 1e-3
"""Least scale of the forces on a member, relative to the largest forces on any member: all belong to one linear system,
whose round-off affects each."""
MOST_DENSE = 2500
"""Largest number of contact components and rigid motions for which a dense stiffness is formed."""
MOST_CONTRAST = 1e6
"""Largest ratio of moduli for which it is formed: of stiffer bodies the sparse form keeps strain and motion apart."""

_ROUND_OFF = 1e-11
"""Imbalance of forces, a hundredth of the tolerance of solves, from which a response is refined."""
_MISSED = 1e-12
"""Round-off that displacements miss without any force, relative to the largest displacement."""


@dataclass(frozen=True, eq=False)
class JoinedBodies(CoupledMembers, LinearBody):
    """Several elastic bodies in mutual contact, seen from their contact nodes.

    Displacements of a state are those of one body relative to its partner, tractions those on this body; the partner
    feels the opposite. A rigid obstacle is a partner that contributes no displacement.

    Parameters
    ----------
    members : tuple of Member
    gap_operator : (2 n_contact, n) sparse array [-]
        The operator B of the relative displacements ``w = B u + prescribed`` with index ``2 node + component`` (n, t);
        u are the displacements of all members, one after the other. B.T takes nodal forces to the members.
    prescribed : (2 n_contact,) array [m]
        Relative displacements that supports prescribe.
    weights : (n_contact,) array [m]
    tangent_follows : (n_contact,) bool array, optional
        Nodes between two obstacles, whose tangential displacements follow from both normal ones. Those where one
        displacement gives both components, because supports hold the others, are found from `gap_operator`.
    is_dense : bool, optional
        Whether to form the dense stiffness of relative displacements; by default if there are few.

    Raises
    ------
    InputError
        If shapes do not fit, entries are not finite, a weight is not positive, or if neither supports nor all contacts
        together can hold a member; the message names it.

    Notes
    -----
    ``K u - f = gap_operator.T @ (weights t)`` with the stiffness K and load f of all members.
    """

    is_dense: bool | None = None

    def under(self, loads: Sequence[FloatArray], prescribed: FloatArray) -> JoinedBodies:
        """Return the same bodies under other loads, without another factorisation.

        Parameters
        ----------
        loads : sequence of (n,) arrays [N/m]
            One for each member.
        prescribed : (2 n_contact,) array [m]
        """
        members = tuple(replace(member, load=load) for member, load in zip(self.members, loads, strict=True))
        other = replace(self, members=members, prescribed=prescribed)
        kept = (name for name in self.__dict__ if isinstance(getattr(type(self), name, None), for_all_loads))
        other.__dict__.update({name: self.__dict__[name] for name in kept})
        return other

    @cached_property
    def accuracy(self) -> float:  # type: ignore[override]  # an attribute of the protocol
        """Relative error of a response."""
        return 1e-13 if self.responses_are_expensive else 1e-14

    @for_all_loads
    def responses_are_expensive(self) -> bool:
        """Whether a response takes a sparse factorisation."""
        if self.is_dense is not None:
            return not self.is_dense
        is_small = 2 * self.n_contact + self.motions.shape[1] <= MOST_DENSE
        moduli = [member.modulus for member in self.members]
        is_alike = max(moduli, default=1.0) <= MOST_CONTRAST * min(moduli, default=1.0)
        return not (is_small and is_alike)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return relative displacements and tractions; see `LinearBody.respond`."""
        if not self.responses_are_expensive:
            try:
                return self._refined(conditions, self._dense.respond(conditions))
            except SingularResponse:
                self._check_moved(conditions)
                raise
        self.held_friction.check(conditions)
        self._check_moved(conditions)
        return sparse_response(self, conditions)

    def _check_moved(self, conditions: LinearConditions) -> None:
        """Raise SingularResponse, which names them, if the conditions leave members free to move."""
        free = conditions.free_motions(self.rigid_motions())
        if free.shape[0]:
            fitted = [np.abs(self._motion_fit(motion.ravel())) for motion in as_dense(free, self.n_contact)]
            raise FreeMotion(self.moving_bodies(np.sum(fitted, axis=0)))

    def _refined(self, conditions: LinearConditions, state: ContactState) -> ContactState:
        """Return a response after one step of iterative refinement, against the round-off of the dense stiffness.

        Bodies may move many times as far as they deform, and on the smallest elements round-off of the motion causes
        forces.
        """
        _, missed = self.recover(state)
        largest = self._over_members(np.maximum, self._force_sizes(state))
        if not np.any(np.abs(missed) * self._stiffness_scale > _ROUND_OFF * self._scale_at_nodes(largest)):
            return state
        nothing = [np.zeros_like(member.load) for member in self.members]
        homogeneous = replace(conditions, value=np.zeros_like(conditions.value))
        correction = self.under(nothing, -missed)._dense.respond(homogeneous)
        traction = conditions.with_given_tractions(state.traction + correction.traction)
        return ContactState(state.displacement + correction.displacement, traction)

    def rigid_motions(self) -> RigidMotions:
        """Return the relative displacements of the rigid motions of each member that no support resists."""
        if self.responses_are_expensive:
            return self.relative_motions
        return self.relative_motions.toarray().reshape(-1, self.n_contact, 2)

    def rigid_load(self) -> FloatArray:
        """Return the work of the loads on these motions."""
        return np.asarray(self.motions.T @ self.load)

    def lacks_room(self, gap: FloatArray) -> bool:
        """Whether an incompressible member has more volume than fits between its supports and closed contacts."""
        return self.pressures.size > 0 and not self.responses_are_expensive and self._dense.lacks_room(gap)

    def shares(self, forces: FloatArray) -> FloatArray:
        """Return the largest of the forces on the partner that carries less, relative to the largest of all."""
        takes_part = self.owners[::2].tocoo()
        of_members = np.zeros(len(self.members))
        np.maximum.at(of_members, takes_part.col, forces[takes_part.row])
        return np.asarray(np.maximum(self.least_of_partners(of_members)[::2] / forces.max(), LIGHTEST))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far each member is from equilibrium, and the state from a response.

        Returns
        -------
        Imbalance
            `force` is the largest relative displacement that no deformation and no motion of the members explains, as
            the force it would take (E' of the more compliant partner); `moment` the work of load and contact forces
            on a rigid motion of a member, of largest entry one. The first is relative to the largest force on the
            lightest loaded member there, the second to the sum of all forces on the member. Members that carry nothing
            are measured by a thousandth of the largest forces on any.
        """
        displacement, missed = self.recover(state)
        terms = self._terms(displacement)
        largest, total = self._force_scales(state, terms)
        if not (largest.max() > 0.0 and np.isfinite(largest).all()):
            round_off = _MISSED * float(np.abs(state.displacement).max())
            return Imbalance(0.0 if np.abs(missed).max() <= round_off else float("inf"), 0.0)
        total = np.maximum(total, LIGHTEST * total.max())

        # the unexplained relative displacement of a node, as the force that it would take
        force_by_displacement = self._stiffness_scale / self._scale_at_nodes(largest)
        missing = np.abs(missed) * force_by_displacement
        work = self._work_on_rigid_motions(state, total)
        # round-off of both: of relative displacements, and of the sums of forces
        of_sums = float(np.finfo(float).eps) * self._over_members(np.add, terms) / total
        of_rows = self._displacement_round_off(state, displacement) * force_by_displacement
        round_off = max(of_rows.max(), of_sums.max())
        return Imbalance(float(missing.max()), float(np.max(work, initial=0.0)), float(round_off))

    @property
    def _stiffness_scale(self) -> FloatArray:
        """(2 n_contact,) array [Pa]: force that a relative displacement takes."""
        return np.asarray(self.moduli * np.repeat(self.weights / np.median(self.weights), 2))

    def _scale_at_nodes(self, largest: FloatArray) -> FloatArray:
        """Return the scale (2 n_contact,) of forces at contact nodes, from the largest force on each member."""
        return self.least_of_partners(np.maximum(largest, LIGHTEST * largest.max()))

    def _work_on_rigid_motions(self, state: ContactState, total: FloatArray) -> FloatArray:
        """Return the work of all forces on each rigid motion of largest entry one, relative to the forces `total`."""
        motions, owner = self.motions, self.motion_owner
        size = abs(motions).max(axis=0).toarray().ravel() if len(owner) else np.zeros(0)
        return np.asarray(np.abs(motions.T @ (self.contact_forces(state) + self.load)) / size / total[owner])

    def _displacement_round_off(self, state: ContactState, displacement: FloatArray) -> FloatArray:
        """Return the round-off (2 n_contact,) [m] of relative displacements: half an eps for each rounding of a row."""
        sizes = (
            abs(self.gap_operator) @ np.abs(displacement) + np.abs(self.prescribed) + np.abs(state.displacement.ravel())
        )
        n_roundings = 3 + np.diff(self.gap_operator.indptr)  # products and sums of a row, and the comparison
        return np.asarray(0.5 * float(np.finfo(float).eps) * n_roundings * sizes)

    def _over_members(self, operation: np.ufunc, values: FloatArray) -> FloatArray:
        """Return the sum or the largest of values (n,) on each member (n_members,); zero of one without components."""
        n_components = np.array([member.n_components for member in self.members])
        first, result = np.cumsum(n_components) - n_components, np.zeros(n_components.size)
        result[n_components > 0] = operation.reduceat(values, first[n_components > 0])
        return result

    def _terms(self, displacement: FloatArray) -> FloatArray:
        """Return the terms (n,) [N/m] whose differences the forces on the members are."""
        terms = np.empty_like(displacement)
        for shape in self.shapes:
            terms[shape.rows] = shape.column_sizes * np.abs(displacement)[shape.rows]
        return terms

    def _force_scales(self, state: ContactState, terms: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the largest force and the sum of all forces (n_members,) [N/m] on each member.

        Forces count before they cancel: contact may press a rigid body from all sides, without a resultant. Where
        nothing is loaded and all forces are round-off, so that members have only moved, the terms take their place.
        """
        sizes = self._force_sizes(state)
        noise = NOISE_FACTOR * float(np.finfo(float).eps) * terms.sum()
        if not np.abs(self.load).sum() > 0.0 and sizes.sum() <= noise:
            sizes = terms
        return self._over_members(np.maximum, sizes), self._over_members(np.add, sizes)

    def _force_sizes(self, state: ContactState) -> FloatArray:
        """Return the sizes (n,) [N/m] of the forces of contact and load on all members, before they cancel."""
        nodal = np.abs(self.weights[:, None] * state.traction).ravel()
        return np.asarray(abs(self.gap_operator).T @ nodal + np.abs(self.load))

    def member_displacements(self, state: ContactState) -> tuple[FloatArray, ...]:
        """Return the displacements (n,) [m] of each member that go with a state."""
        displacement, _ = self.recover(state)
        return tuple(np.split(displacement, np.cumsum([member.n_components for member in self.members])[:-1]))

    @for_all_loads
    def _relative_stiffness(self) -> RelativeStiffness:
        return RelativeStiffness(self)

    @cached_property
    def _dense(self) -> DenseBody:
        return self._relative_stiffness.body(self)
