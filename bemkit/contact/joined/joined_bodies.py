"""Several elastic bodies in mutual contact as one `LinearBody`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.condensation.dense_body import DenseBody, refuse_other_tangents
from bemkit.contact.conditions import LinearConditions
from bemkit.contact.joined.balance import imbalance_of
from bemkit.contact.joined.dense_form import RelativeStiffness
from bemkit.contact.joined.member import Member, Shape, deformation, shapes_of
from bemkit.contact.joined.sparse_form import sparse_response
from bemkit.contact.rigid_motions import RigidMotions, null_space
from bemkit.errors import InputError
from bemkit.operators.equilibrium import Imbalance

MOST_DENSE = 2500
"""Contact components and rigid motions up to which the stiffness of relative displacements is formed."""

_WITHOUT_LOAD = (
    *("shapes", "motions", "_felt_motions", "stiffness", "is_symmetric", "_relative_stiffness", "_motion_fit"),
    *("owners", "modulus", "stiffness_scale", "is_costly"),
)
"""What stays as it is under another load."""


@dataclass(frozen=True, eq=False)
class JoinedBodies(LinearBody):
    """Several elastic bodies in mutual contact, seen from their contact nodes.

    Displacements of a state are those of one body relative to its partner, tractions those on this body; the partner
    feels the opposite. A rigid obstacle is a partner that contributes no displacement.

    Parameters
    ----------
    members : tuple of Member
    relative : (2 n_contact, n) sparse array [-]
        Relative displacements are ``w = relative @ u + offset``, with index ``2 node + component`` (n, t), of the
        displacements u of all members, one after the other; ``relative.T`` takes nodal forces to the members.
    offset : (2 n_contact,) array [m]
        What displacements given by supports contribute.
    weights : (n_contact,) array [m]
    tangent_is_eliminated : (n_contact,) bool array, optional
        None by default. Nodes without friction, or whose tangent supports hold: ``sigma_t = 0`` there. Where nothing else would hold the
        members a few of them are taken back.
    is_dense : bool, optional
        Whether to form the dense stiffness of relative displacements; by default if there are few.

    Raises
    ------
    InputError
        If shapes do not fit, entries are not finite, a weight is not positive, or if neither supports nor all contacts
        together can hold a member; the message names it.

    Notes
    -----
    ``K u - f = relative.T @ (weights t)`` with the stiffness K and load f of all members.
    """

    members: tuple[Member, ...]
    relative: sparse.csr_array
    offset: FloatArray
    weights: FloatArray
    tangent_is_eliminated: BoolArray = None  # type: ignore[assignment]  # a value, to hide the property of the protocol
    is_dense: bool | None = None

    def __post_init__(self) -> None:
        n_contact, n = len(self.weights), sum(member.n_components for member in self.members)
        relative = sparse.csr_array(self.relative)
        if self.tangent_is_eliminated is None:
            object.__setattr__(self, "tangent_is_eliminated", np.zeros(n_contact, bool))
        for name, array, shape in (
            ("relative", relative, (2 * n_contact, n)),
            ("offset", self.offset, (2 * n_contact,)),
            ("tangent_is_eliminated", self.tangent_is_eliminated, (n_contact,)),
        ):
            if array.shape != shape:
                raise InputError(f"{name} has the shape {array.shape}; {n_contact} contact nodes need {shape}")
        for name, values in (("relative", relative.data), ("offset", self.offset), ("weights", self.weights)):
            if not np.isfinite(values).all():
                raise InputError(f"{name} contains {values[~np.isfinite(values)][0]}; give finite numbers")
        if n_contact == 0 or not self.members:
            raise InputError(f"{len(self.members)} members with {n_contact} contact nodes; give at least one of each")
        if self.weights.min() <= 0.0:
            raise InputError(f"weights has the entry {self.weights.min():g}; the length of a node is positive")
        object.__setattr__(self, "relative", relative)
        self._check_held()
        object.__setattr__(self, "tangent_is_eliminated", self._eliminated_tangents())

    def under(self, loads: Sequence[FloatArray], offset: FloatArray) -> JoinedBodies:
        """Return the same bodies under other loads, without another factorisation.

        Parameters
        ----------
        loads : sequence of (n,) arrays [N/m]
            One for each member.
        offset : (2 n_contact,) array [m]
        """
        members = tuple(replace(member, load=load) for member, load in zip(self.members, loads, strict=True))
        other = replace(self, members=members, offset=offset)
        other.__dict__.update({name: self.__dict__[name] for name in _WITHOUT_LOAD if name in self.__dict__})
        return other

    @cached_property
    def accuracy(self) -> float:  # type: ignore[override]  # an attribute of the protocol
        """Relative error of a response."""
        return 1e-13 if self.is_costly else 1e-14

    @cached_property
    def is_costly(self) -> bool:  # type: ignore[override]  # an attribute of the protocol
        """Whether a response takes a sparse factorisation."""
        few = 2 * self.n_contact + self.motions.shape[1] <= MOST_DENSE
        return not (few if self.is_dense is None else self.is_dense)

    @cached_property
    def stiffness_scale(self) -> float:
        """E' by the median weight [Pa/m]; see `modulus`."""
        return self.modulus / float(np.median(self.weights))

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return relative displacements and tractions; see `LinearBody.respond`."""
        if not self.is_costly:
            return self._dense.respond(conditions)
        refuse_other_tangents(conditions, self.tangent_is_eliminated)
        if conditions.free_motions(self.rigid_motions()).shape[0]:
            raise SingularResponse("the contact conditions leave a rigid motion free")
        return sparse_response(self, conditions)

    def rigid_motions(self) -> RigidMotions:
        """Return the relative displacements of the rigid motions of each member that no support resists."""
        if self.is_costly:
            return self._felt_motions
        return self._felt_motions.toarray().reshape(-1, self.n_contact, 2)

    def rigid_load(self) -> FloatArray:
        """Return the work of the loads on these motions."""
        return np.asarray(self.motions.T @ self.load)

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far each member is from equilibrium, and the state from a response; see `imbalance_of`."""
        return imbalance_of(self, state)

    def member_displacements(self, state: ContactState) -> tuple[FloatArray, ...]:
        """Return the displacements (n,) [m] of each member that go with a state."""
        displacement, _ = self.recover(state)
        return tuple(np.split(displacement, np.cumsum([member.n_components for member in self.members])[:-1]))

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return what the members do under the tractions of a state.

        Returns
        -------
        displacement : (n,) array [m]
            Of all members, one after the other, rigid motions by least squares of what is missed.
        missed : (2 n_contact,) array [m]
            Relative displacements of the state less those of the members.
        """
        displacement = self.deformation(self.load + self.contact_forces(state))
        missed = state.displacement.ravel() - self.offset - self.relative @ displacement
        displacement = displacement + self.motions @ self._motion_fit(missed)
        return displacement, state.displacement.ravel() - self.offset - self.relative @ displacement

    def contact_forces(self, state: ContactState) -> FloatArray:
        """Return the forces (n,) [N/m] of contact on all members."""
        return np.asarray(self.relative.T @ (self.weights[:, None] * state.traction).ravel())

    def deformation(self, forces: FloatArray) -> FloatArray:
        """Return the displacements of all members under forces (n, ...) in equilibrium, but for rigid motions."""
        return deformation(self.shapes, forces)

    @cached_property
    def load(self) -> FloatArray:
        """(n,) array [N/m]: the loads of all members, one after the other."""
        return np.concatenate([member.load for member in self.members])

    @cached_property
    def shapes(self) -> tuple[Shape, ...]:
        """The members by shape."""
        return shapes_of(self.members)

    @cached_property
    def is_symmetric(self) -> bool:
        """Whether all stiffnesses are symmetric."""
        return all(np.array_equal(shape.member.stiffness, shape.member.stiffness.T) for shape in self.shapes)

    @cached_property
    def motions(self) -> sparse.csr_array:
        """(n, n_motions) sparse array: the rigid motions, orthonormal, member by member."""
        of_member: dict[int, FloatArray] = {}
        for shape in self.shapes:
            of_member.update(dict.fromkeys(shape.rows[:, 0].tolist(), shape.motions))
        first = np.cumsum([0, *(member.n_components for member in self.members)])[:-1].tolist()
        return sparse.csr_array(sparse.block_diag([of_member[number] for number in first], format="csr"))

    @cached_property
    def _felt_motions(self) -> sparse.csr_array:
        """(n_motions, 2 n_contact) sparse array: their relative displacements."""
        return sparse.csr_array((self.relative @ self.motions).T)

    @cached_property
    def stiffness(self) -> sparse.csr_array:
        """(n, n) sparse array [Pa]: the stiffnesses of all members."""
        return sparse.csr_array(sparse.block_diag([member.stiffness for member in self.members], format="csr"))

    @cached_property
    def motion_owner(self) -> IntArray:
        """(n_motions,) array: the member that each of the motions moves."""
        return np.repeat(np.arange(len(self.members)), [len(member.motions) for member in self.members])

    @cached_property
    def owners(self) -> sparse.csr_array:
        """(2 n_contact, n_members) sparse array: the members that take part in each component of contact."""
        of_component = np.repeat(np.arange(len(self.members)), [member.n_components for member in self.members])
        where = (np.arange(of_component.size), of_component)
        sums = sparse.csr_array((np.ones(of_component.size), where), (of_component.size, len(self.members)))
        return sparse.csr_array(abs(self.relative) @ sums)

    @cached_property
    def modulus(self) -> float:
        """Median over the contact nodes of the E' of the partner that yields more [Pa]."""
        owners = self.owners
        moduli = np.array([member.modulus for member in self.members])
        least = [moduli[owners.indices[i:j]].min() for i, j in zip(owners.indptr[:-1:2], owners.indptr[1::2]) if j > i]
        return float(np.median(least)) if least else float(moduli.min())

    @cached_property
    def _relative_stiffness(self) -> RelativeStiffness:
        return RelativeStiffness(self)

    @cached_property
    def _dense(self) -> DenseBody:
        return self._relative_stiffness.body(self)

    @cached_property
    def _motion_fit(self) -> Callable[[FloatArray], FloatArray]:
        """The function that finds the motions (n_motions,) nearest to relative displacements (2 n_contact,)."""
        felt = sparse.csc_array(self._felt_motions.T)
        if not felt.shape[1]:
            return lambda missed: np.zeros(0)
        factors = sparse.linalg.splu(
            sparse.csc_array(felt.T @ felt), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        return lambda missed: np.asarray(factors.solve(felt.T @ missed))

    def _check_held(self) -> None:
        """Refuse members that neither supports nor all contacts together can hold."""
        free = null_space(sparse.csr_array(self._felt_motions.T))
        if not free.shape[0]:
            return
        names = self.moving_bodies(np.asarray(abs(free).sum(axis=0), dtype=float))
        raise InputError(
            f"nothing holds {names}: no support, and no contact with anything that is held; make contacts or supports"
        )

    def moving_bodies(self, coefficients: FloatArray) -> str:
        """Name the members that a combination (n_motions,) of the rigid motions moves."""
        size = np.abs(coefficients)
        moved = np.unique(self.motion_owner[size > 1e-6 * size.max()])
        names = [f"{self.members[k].name!r}" if self.members[k].name else f"number {k + 1}" for k in moved]
        if len(names) == 1:
            return f"body {names[0]}"
        return f"bodies {', '.join(names[:4])}" + (f" and {len(names) - 4} more" if len(names) > 4 else "")

    def _eliminated_tangents(self) -> BoolArray:
        """Take back as many tangents as it needs to hold the members by what is kept."""
        is_eliminated = np.array(self.tangent_is_eliminated, bool)
        if not is_eliminated.any():
            return is_eliminated
        felt = sparse.csr_array(self._felt_motions.T)
        is_kept = np.ones((self.n_contact, 2), bool)
        is_kept[is_eliminated, 1] = False
        free = null_space(sparse.csr_array(felt[is_kept.ravel()]))
        if free.shape[0]:
            from scipy.linalg import qr

            tangents = np.flatnonzero(is_eliminated)
            along = (free @ felt[2 * tangents + 1].T).toarray()
            _, order = qr(along, mode="r", pivoting=True)
            is_eliminated[tangents[order[: free.shape[0]]]] = False
        return is_eliminated
