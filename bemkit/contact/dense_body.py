"""A body given by its dense stiffness matrix."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import AnyArray, BoolArray, FloatArray, IntArray, read_only, spread_fractions
from bemkit.contact.body import ClosedVolume, ContactState, FreeMotion, LinearBody, SingularResponse
from bemkit.contact.equilibrium import Imbalance, Unbalanced
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import orthonormal
from bemkit.operators.steklov_poincare.nodal_conditions import SLIDES

if TYPE_CHECKING:
    from bemkit.contact.held_friction import HeldFriction

_SMALLEST_RCOND = 1e-13
"""Below this reciprocal condition number of a row-scaled system its matrix counts as singular. The condensed stiffness
of a floating body leaves 1e-15 of its free motions; solvers that are refused without need only take other steps."""
_NO_ROOM = 1e-3
"""Change of volume that errors of normals explain, see `DenseBody._enclosed`: squares of angles."""
_NO_CHANGE = 1e-6
"""Change of a volume by displacements that counts as small, relative to the largest one."""
_LEFT_OVER = 1e-9
"""Stiffness that may be round-off of zero, relative to the largest."""


@dataclass(frozen=True, eq=False)
class FollowingTangents:
    """Tangential displacements that follow from the unknowns of a body, because supports or two obstacles give them.

    Parameters
    ----------
    nodes : (n_following,) array
        Indices of the contact nodes, ascending.
    response, at_rest : (n_following, n) array [-], (n_following,) array [m]
        Their tangential displacements are ``at_rest + response @ unknowns``. Friction may act where the normal
        displacement of the node itself is the only unknown; see `bemkit.contact.held_friction`.
    """

    nodes: IntArray
    response: FloatArray
    at_rest: FloatArray


@dataclass(frozen=True, eq=False)
class DenseBody(LinearBody):
    """Body with ``weights * t = stiffness @ u - load`` at its contact nodes; see `LinearBody`.

    Parameters
    ----------
    stiffness : (n, n) array [Pa]
        Condensed stiffness, index ``2 node + component`` with component 0 = normal, 1 = tangential, without the
        tangents that follow; then pressures, n = n_unknowns + n_pressures. It need not be symmetric.
    load : (n,) array [N/m]
        Condensed load: the nodal forces that would act on the contact nodes of the clamped body, reversed.
    weights : (n_contact,) array [m]
        Length that belongs to each node.
    motions : (n_motions, n_contact, 2) array, optional
        Rigid motions that only contact holds; none by default.
    following_tangents : FollowingTangents, optional
        Nodes whose tangential displacement is not an unknown; none by default.
    modulus : float, optional [Pa]
        E' of the material: force per displacement of one node. By default the median of the diagonal normal
        stiffnesses, of those that are more than round-off.
    n_pressures : int
        Number of further unknowns, which no contact condition concerns and on which no force acts: uniform pressures of
        incompressible bodies; see `bemkit.operators.steklov_poincare.CondensedMap`.
    largest_modulus : float, optional [Pa]
        The largest modulus, of shape or volume, of the bodies that make room for others; by default `modulus`.

    Raises
    ------
    InputError
        If shapes do not fit or entries are not finite, if a weight or the modulus is not positive, or if the modulus is
        excluded where the stiffness vanishes without the motions.
    """

    stiffness: FloatArray
    load: FloatArray
    weights: FloatArray
    motions: FloatArray | None = None
    following_tangents: FollowingTangents | None = None
    modulus: float | None = None
    n_pressures: int = 0
    largest_modulus: float | None = None

    def __post_init__(self) -> None:
        n_contact, n_unknowns = self.n_contact, self.n_unknowns
        motions = np.zeros((0, n_contact, 2)) if self.motions is None else self.motions
        shapes = {
            "weights": (n_contact,),
            "stiffness": (n_unknowns + self.n_pressures, n_unknowns + self.n_pressures),
            "load": (n_unknowns + self.n_pressures,),
            "motions": (len(motions), n_contact, 2),
        }
        for name, shape in shapes.items():
            array = np.array(motions if name == "motions" else getattr(self, name), dtype=float)
            if array.shape != shape:
                raise InputError(f"{name} has the shape {array.shape}; {n_contact} contact nodes need {shape}")
            if not np.isfinite(array).all():
                raise InputError(f"{name} contains {array[~np.isfinite(array)][0]}; give finite numbers")
            object.__setattr__(self, name, read_only(array))
        if n_contact == 0:
            raise InputError("weights is empty; a body needs at least one contact node")
        if self.weights.min() <= 0.0:
            raise InputError(f"weights has the entry {self.weights.min():g}; the length of a node is positive")
        if self.modulus is None and len(motions) >= n_unknowns:
            raise InputError(
                f"a stiffness of {n_unknowns} unknowns with {len(motions)} rigid motions has no scale of its own: "
                "give modulus, the E' of the material"
            )
        if self.modulus is not None and not (math.isfinite(self.modulus) and self.modulus > 0.0):
            raise InputError(f"modulus = {self.modulus:g}; give the E' of the material, a positive number")

    @property
    def n_unknowns(self) -> int:
        """Two for each contact node, less the tangents that follow."""
        return 2 * self.n_contact - (0 if self.following_tangents is None else len(self.following_tangents.nodes))

    @cached_property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: where the tangential displacement is not an unknown."""
        follows = np.zeros(self.n_contact, bool)
        if self.following_tangents is not None:
            follows[self.following_tangents.nodes] = True
        return follows

    @cached_property
    def held_friction(self) -> HeldFriction:
        """How friction acts where the tangent follows."""
        slope = np.full(self.n_contact, np.nan)
        if self.following_tangents is not None:
            for node, row in zip(self.following_tangents.nodes, self.following_tangents.response, strict=True):
                normal = int(np.searchsorted(self.unknown_dofs, 2 * node))
                if not np.delete(row, normal).any():
                    slope[node] = row[normal]
        from bemkit.contact.held_friction import HeldFriction

        return HeldFriction(self.tangent_follows, slope)

    @cached_property
    def stiffness_scale(self) -> float:
        """Modulus per median weight [Pa/m], or the median of the diagonal normal stiffnesses per weight."""
        if self.modulus is not None:
            return self.modulus / float(np.median(self.weights))
        weights = self.weights[self.unknown_dofs // 2]
        stiffness = self.stiffness[: self.n_unknowns, : self.n_unknowns]
        diagonal = np.diagonal(stiffness) / weights
        largest = float((np.abs(stiffness).max(axis=1) / weights).max())
        stiff = diagonal[(diagonal > _LEFT_OVER * largest) & (self.unknown_dofs % 2 == 0)]
        return float(np.median(stiff)) if stiff.size else largest or 1.0

    @cached_property
    def unknown_dofs(self) -> IntArray:
        """(n_unknowns,) array: the numbers ``2 node + component`` of the unknown displacements, ascending."""
        is_unknown = np.ones((self.n_contact, 2), bool)
        is_unknown[self.tangent_follows, 1] = False
        return np.flatnonzero(is_unknown)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response; one LU factorisation of the order of the displacements that are not given.

        Prescribed displacements, zero tractions and slip tractions are met exactly, not just to round-off, so that
        ties such as ``|sigma_t| = s |sigma_n|`` are decided alike in all units.
        """
        if self.following_tangents is None:
            return self._response(conditions)
        state = self._response(self.held_friction.substituted(conditions))
        return self.held_friction.restored(conditions, state)

    def _response(self, conditions: LinearConditions) -> ContactState:
        own = [0, 1]
        acts_on_displacement = np.any(conditions.on_displacement != 0.0, axis=2)
        acts_on_traction = np.any(conditions.on_traction != 0.0, axis=2)
        couples = np.any(conditions.on_displacement[:, own, [1, 0]] != 0.0, axis=1)
        gives_displacement = acts_on_displacement & ~acts_on_traction & ~couples[:, None]

        displacement = np.zeros_like(conditions.value)
        np.divide(conditions.value, conditions.on_displacement[:, own, own], out=displacement, where=gives_displacement)
        unknowns = self._with_pressures(displacement.ravel()[self.unknown_dofs])
        is_given = self._with_pressures(gives_displacement.ravel()[self.unknown_dofs])
        if not is_given.all():
            unknowns[~is_given] = self._solved(conditions, unknowns, is_given)
            displacement.flat[self.unknown_dofs] = unknowns[: self.n_unknowns]
        displacement[self.tangent_follows, 1] = self._followed(unknowns)

        traction = np.zeros_like(displacement)
        traction.flat[self.unknown_dofs] = (self.stiffness @ unknowns - self.load)[: self.n_unknowns]
        traction /= self.weights[:, None]
        return ContactState(displacement, conditions.with_given_tractions(traction))

    def rigid_motions(self) -> FloatArray:
        """Return the motions given to the constructor."""
        return np.zeros((0, self.n_contact, 2)) if self.motions is None else self.motions

    def rigid_load(self) -> FloatArray:
        """Return the work of the load on these motions."""
        return self.motions_of_unknowns @ self.load

    def lacks_room(self, gap: FloatArray) -> bool:
        """Whether an incompressible body has more volume than fits between its supports and closed contacts."""
        if not self.n_pressures:
            return False
        changes = self._enclosed @ self.stiffness[self.n_unknowns :, : self.n_unknowns]
        for room, change, needed in zip(
            self._room, changes, self._enclosed @ self.load[self.n_unknowns :], strict=True
        ):
            moved = np.flatnonzero(room)
            if (self.unknown_dofs[moved] % 2 == 0).all() and room[moved].min() > 0.0:
                largest = change[moved] * gap[self.unknown_dofs[moved] // 2]
                if needed > largest.sum() + _LEFT_OVER * (np.abs(largest).sum() + abs(needed)):
                    return True
        return False

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far the state is from equilibrium, relative to load and contact forces; see `unbalanced`."""
        return self.unbalanced(state).relative_to(self.load)

    def unbalanced(self, state: ContactState) -> Unbalanced:
        """Return the largest nodal force out of balance, and the work of load and tractions on rigid motions.

        Notes
        -----
        The first number is the residual of ``weights * t = stiffness @ u - load`` (and of tangents that do not follow),
        so it also detects states that are not responses of this body. Round-off is what the stiffness makes
        of the rigid part of the displacements, and that of the sums.
        """
        contact = (self.weights[:, None] * state.traction).ravel()
        forces, unknowns = self._forces_on_unknowns(contact), self.unknowns_of(state)
        missing = np.abs(self.stiffness @ unknowns - self.load - forces).max()
        motions, basis = self.motions_of_unknowns, self._orthonormal_motions
        left_by_motions = float(np.abs(self.stiffness @ (basis @ (basis.T @ unknowns))).max(initial=0.0))
        largest_terms, all_terms = self._column_sizes * np.abs(unknowns)
        eps = np.finfo(float).eps
        work, defect = 0.0, 0.0
        if len(motions):
            work = float(np.abs(motions @ (self.load + forces)).max() / np.abs(motions).max())
            defect = float(self._motion_defect @ np.abs(unknowns))
        return Unbalanced(
            contact=contact,
            at_nodes=float(np.maximum(missing, self._stray_forces(state, unknowns))),
            on_motions=work,
            nodes_round_off=left_by_motions + float(eps * largest_terms.sum()),
            motions_round_off=defect + float(eps * all_terms.sum()),
            terms=float(largest_terms.max()),
        )

    def unknowns_of(self, state: ContactState) -> FloatArray:
        """Return the unknowns (n,) of a state, with the pressures that best explain its tractions."""
        unknowns = self._with_pressures(state.displacement.ravel()[self.unknown_dofs])
        if self.n_pressures:
            forces = self._forces_on_unknowns((self.weights[:, None] * state.traction).ravel())
            missing = forces + self.load - self.stiffness @ unknowns
            by_pressures = self.stiffness[:, self.n_unknowns :]
            unknowns[self.n_unknowns :] = np.linalg.lstsq(by_pressures, missing, rcond=None)[0]
        return unknowns

    def _with_pressures(self, values: AnyArray) -> AnyArray:
        """Return values (n_unknowns, ...) followed by zeros for the pressures, as a new array."""
        return np.concatenate([values, np.zeros((self.n_pressures, *values.shape[1:]), values.dtype)])

    @cached_property
    def _column_sizes(self) -> FloatArray:
        """(2, n) array [Pa]: the largest entry of each column of the stiffness, and the sum of all."""
        sizes = np.abs(self.stiffness)
        return np.stack([sizes.max(axis=0), sizes.sum(axis=0)])

    @cached_property
    def motions_of_unknowns(self) -> FloatArray:
        """(n_motions, n) array: what the rigid motions are in the unknowns."""
        return self._with_pressures(self.rigid_motions().reshape(-1, 2 * self.n_contact)[:, self.unknown_dofs].T).T

    @cached_property
    def _rigid_basis(self) -> FloatArray:
        """(n_motions, n_contact, 2) array: orthonormal rigid motions."""
        return orthonormal(self.rigid_motions())

    @cached_property
    def _orthonormal_motions(self) -> FloatArray:
        """(n_unknowns, n_motions) array."""
        return np.asarray(np.linalg.qr(self.motions_of_unknowns.T)[0])

    @cached_property
    def _motion_defect(self) -> FloatArray:
        """(n_unknowns,) array [Pa]: what round-off of the stiffness adds to the balance of forces."""
        return np.asarray(
            np.abs(self.motions_of_unknowns @ self.stiffness).max(axis=0) / np.abs(self.motions_of_unknowns).max()
        )

    def _forces_on_unknowns(self, contact: FloatArray) -> FloatArray:
        """Return the forces (n,) on the unknowns of nodal forces (2 n_contact,) [N/m]."""
        tangents, forces = self.following_tangents, self._with_pressures(contact[self.unknown_dofs])
        return forces if tangents is None else forces + contact[2 * tangents.nodes + 1] @ tangents.response

    def _followed(self, unknowns: FloatArray) -> FloatArray:
        """Return the displacements of the tangents that follow."""
        tangents = self.following_tangents
        return np.zeros(0) if tangents is None else tangents.at_rest + tangents.response @ unknowns

    def _stray_forces(self, state: ContactState, unknowns: FloatArray) -> float:
        """Return the largest force that a tangential displacement which does not follow would take."""
        rows = self.tangent_follows
        missed = np.abs(state.u_t[rows] - self._followed(unknowns))
        return float(np.max(self.weights[rows] * self.stiffness_scale * missed, initial=0.0))

    def _solved(self, conditions: LinearConditions, unknowns: FloatArray, is_given: BoolArray) -> FloatArray:
        """Solve ``(A_u + A_t T) u = c + A_t t_free`` for the unknowns that are not given, every row scaled to one.

        Parameters
        ----------
        conditions : LinearConditions
        unknowns : (n,) array [m]
            The given displacements among them.
        is_given : (n,) bool array
        """
        # before any matrix, whose rows may hold nothing but what round-off leaves of rigid motions
        if not conditions.hold(self._rigid_basis):
            raise FreeMotion
        if self.n_pressures:
            room = self._room[:, ~is_given[: self.n_unknowns]]
            if np.linalg.matrix_rank(room, _NO_ROOM) < len(room):
                raise ClosedVolume
        # one equation, the condition of the same index, for each displacement that is sought
        sought = np.flatnonzero(~is_given)
        n_displacements = sought.size - self.n_pressures
        node, component = np.divmod(self.unknown_dofs[sought[:n_displacements]], 2)
        unknown_of = np.full((self.n_contact, 2), -1)  # index among the unknowns of each displacement
        unknown_of.flat[self.unknown_dofs] = np.arange(self.n_unknowns)
        column_of = np.cumsum(~is_given) - 1  # index among those sought of each unknown
        # displacements and nodal forces where all that is sought vanishes
        given = np.where(is_given, unknowns, 0.0)
        forces = self.stiffness @ given - self.load
        right_side = np.append(conditions.value[node, component], -forces[self.n_unknowns :])
        matrix = np.zeros((sought.size, sought.size))
        matrix[n_displacements:] = self.stiffness[self.n_unknowns :, sought]  # the volume must not change
        for other in (component, 1 - component):  # a condition may couple both components of its node
            on_displacement = conditions.on_displacement[node, component, other]
            on_traction = conditions.on_traction[node, component, other]
            row = np.flatnonzero((unknown_of[node, other] >= 0) & ((on_displacement != 0.0) | (on_traction != 0.0)))
            unknown, factor = unknown_of[node[row], other[row]], (on_traction / self.weights[node])[row]
            # A_t t, the traction by the stiffness, and A_u u, the displacement itself if it is sought
            matrix[row] += factor[:, None] * self.stiffness[np.ix_(unknown, sought)]
            is_sought = np.flatnonzero(~is_given[unknown])
            matrix[row[is_sought], column_of[unknown[is_sought]]] += on_displacement[row[is_sought]]
            right_side[row] -= factor * forces[unknown] + on_displacement[row] * given[unknown]
        # rows of size one, so that pivots compare in any units of the conditions
        sizes = np.abs(matrix)
        row_size = sizes.max(axis=1)
        if not row_size.all():
            raise SingularResponse("a condition at a contact node involves neither displacement nor stiffness")
        matrix /= row_size[:, None]
        right_sides = np.stack([right_side / row_size, self._probe[sought]], axis=1)
        try:
            solution, probed = np.linalg.solve(matrix, right_sides).T
        except np.linalg.LinAlgError as error:
            raise SingularResponse("the contact conditions do not hold the body (a pivot is zero)") from error
        # One more right-hand side is a cheap estimate of the inverse. (LAPACK's own estimate is only in scipy, whose
        # BLAS threads and numpy's get in each other's way: factors of 10 to 100 in time for systems of this size.)
        rcond = 1.0 / (float((sizes.sum(axis=1) / row_size).max()) * float(np.abs(probed).max()))
        if rcond < _SMALLEST_RCOND:
            raise SingularResponse(f"the contact conditions do not hold the body (reciprocal condition {rcond:.1e})")
        return np.ascontiguousarray(solution)

    @cached_property
    def _probe(self) -> FloatArray:
        """(n,) array around one: not orthogonal to rigid motions, and without any pattern."""
        return 0.5 + spread_fractions(len(self.load))

    @cached_property
    def _enclosed(self) -> FloatArray:
        """(n_enclosed, n_pressures) array: combinations of volumes for which no body makes room by yielding.

        A boundary that yields like the stiffest of these bodies has the size one, errors of normals that of their
        squares.
        """
        change, coupled = np.split(self.stiffness[self.n_unknowns :], [self.n_unknowns], axis=1)
        sizes = np.abs(change).sum(axis=1)
        sizes = np.maximum(sizes, _NO_CHANGE * sizes.max(initial=0.0))  # contact on both sides of a body may leave none
        modulus = self.largest_modulus or self.modulus or self.stiffness_scale * float(np.median(self.weights))
        combinations, yielding, _ = np.linalg.svd(coupled * modulus / sizes / sizes[:, None])
        enclosed = (combinations / sizes[:, None]).T[yielding < _NO_ROOM]
        return np.asarray(enclosed * np.sign((enclosed @ change).sum(axis=1, keepdims=True)))

    @cached_property
    def _room(self) -> FloatArray:
        """(n_enclosed, n_unknowns) array [-]: change of these volumes by displacements, per length.

        Displacements along the boundary, which change the volume by the errors of its normals, count as zero.
        """
        change = self._enclosed @ self.stiffness[self.n_unknowns :, : self.n_unknowns]
        per_length = change / self.weights[self.unknown_dofs // 2]
        per_length /= np.abs(per_length).max(axis=1, keepdims=True, initial=0.0)
        return np.where(np.abs(per_length) > SLIDES, per_length, 0.0)
