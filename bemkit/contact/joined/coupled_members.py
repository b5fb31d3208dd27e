"""Several elastic bodies and the matrix that couples them at their contact nodes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.held_friction import HeldFriction
from bemkit.contact.joined.member import Member, Shape, blocks_of_members, deformation, shapes_of
from bemkit.errors import InputError
from bemkit.operators.null_space import null_space

Value = TypeVar("Value")

_ROUNDS = 2
"""Number of fits of rigid motions: normal equations hold half of the digits, too few for stiff bodies."""
_DEPENDENT = 1e-12
"""Squared sine of the angle between the two rows of a node below which one displacement gives both components."""


class for_all_loads(cached_property[Value]):  # noqa: N801 - a decorator
    """A cached value that does not depend on loads, which the same bodies under other loads keep."""


@dataclass(frozen=True, eq=False)
class CoupledMembers:
    """Members in contact, and what follows from them without solving a contact system.

    Parameters
    ----------
    members, gap_operator, prescribed, weights, tangent_follows
        See `bemkit.contact.joined.joined_bodies.JoinedBodies`.
    """

    members: tuple[Member, ...]
    gap_operator: sparse.csr_array
    prescribed: FloatArray
    weights: FloatArray
    tangent_follows: BoolArray = None  # type: ignore[assignment]  # a value, to hide the property of the protocol

    def __post_init__(self) -> None:
        n_contact, n = len(self.weights), sum(member.n_components for member in self.members)
        gap_operator = sparse.csr_array(self.gap_operator)
        if self.tangent_follows is None:
            object.__setattr__(self, "tangent_follows", np.zeros(n_contact, bool))
        for name, array, shape in (
            ("gap_operator", gap_operator, (2 * n_contact, n)),
            ("prescribed", self.prescribed, (2 * n_contact,)),
            ("tangent_follows", self.tangent_follows, (n_contact,)),
        ):
            if array.shape != shape:
                raise InputError(f"{name} has the shape {array.shape}; {n_contact} contact nodes need {shape}")
        for name, values in (
            ("gap_operator", gap_operator.data),
            ("prescribed", self.prescribed),
            ("weights", self.weights),
        ):
            if not np.isfinite(values).all():
                raise InputError(f"{name} contains {values[~np.isfinite(values)][0]}; give finite numbers")
        if n_contact == 0 or not self.members:
            raise InputError(f"{len(self.members)} members with {n_contact} contact nodes; give at least one of each")
        if self.weights.min() <= 0.0:
            raise InputError(f"weights has the entry {self.weights.min():g}; the length of a node is positive")
        object.__setattr__(self, "gap_operator", gap_operator)
        self._check_held()
        object.__setattr__(self, "tangent_follows", self.tangent_follows | ~np.isnan(self.tangents[0]))

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.weights)

    @for_all_loads
    def stiffness_scale(self) -> float:
        """E' by the median weight [Pa/m]; see `modulus`."""
        return self.modulus / float(np.median(self.weights))

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return the displacements of the members under the tractions of a state.

        Returns
        -------
        displacement : (n,) array [m]
            Of all members, one after the other. Rigid motions make `missed` least, in the mean square weighted by
            `moduli`, so that errors of soft bodies do not move stiff ones.
        missed : (2 n_contact,) array [m]
            Relative displacements of the state less those of the members.
        """
        displacement = self.deformation(self.load + self.contact_forces(state))
        missed = state.displacement.ravel() - self.prescribed - self.gap_operator @ displacement
        for _ in range(_ROUNDS):
            displacement = displacement + self.motions @ self._motion_fit(missed)
            missed = state.displacement.ravel() - self.prescribed - self.gap_operator @ displacement
        return displacement, missed

    def contact_forces(self, state: ContactState) -> FloatArray:
        """Return the forces (n,) [N/m] of contact on all members."""
        return np.asarray(self.gap_operator.T @ (self.weights[:, None] * state.traction).ravel())

    def deformation(self, forces: FloatArray) -> FloatArray:
        """Return the displacements of all members under forces (n, ...) in equilibrium, but for rigid motions."""
        return deformation(self.shapes, forces)

    @cached_property
    def load(self) -> FloatArray:
        """(n,) array [N/m]: the loads of all members, one after the other."""
        return np.concatenate([member.load for member in self.members])

    @for_all_loads
    def pressures(self) -> IntArray:
        """(n_pressures,) array: the components that are pressures."""
        ends = np.cumsum([member.n_components for member in self.members])
        counts = [member.n_pressures for member in self.members]
        return np.concatenate([np.arange(end - count, end) for end, count in zip(ends, counts, strict=True)])

    @for_all_loads
    def shapes(self) -> tuple[Shape, ...]:
        """Members by shape."""
        return shapes_of(self.members)

    @for_all_loads
    def is_symmetric(self) -> bool:
        """Whether all stiffnesses are symmetric."""
        return all(np.array_equal(shape.member.stiffness, shape.member.stiffness.T) for shape in self.shapes)

    @for_all_loads
    def motions(self) -> sparse.csr_array:
        """(n, n_motions) sparse array: the rigid motions, orthonormal, member by member."""
        return blocks_of_members(self.shapes, lambda shape: shape.motions)

    @for_all_loads
    def relative_motions(self) -> sparse.csr_array:
        """(n_motions, 2 n_contact) sparse array: relative displacements of the rigid motions."""
        return sparse.csr_array((self.gap_operator @ self.motions).T)

    @for_all_loads
    def compliance(self) -> sparse.csr_array:
        """(2 n_contact, 2 n_contact) sparse array [1/Pa]: relative displacements by forces, but for rigid motions."""
        of_members = blocks_of_members(self.shapes, lambda shape: shape.flexibility)
        return sparse.csr_array(self.gap_operator @ of_members @ self.gap_operator.T)

    @cached_property
    def motion_owner(self) -> IntArray:
        """(n_motions,) array: the member that each of the motions moves."""
        return np.repeat(np.arange(len(self.members)), [len(member.motions) for member in self.members])

    @for_all_loads
    def owners(self) -> sparse.csr_array:
        """(2 n_contact, n_members) sparse array: the members that take part in each component of contact."""
        of_component = np.repeat(np.arange(len(self.members)), [member.n_components for member in self.members])
        where = (np.arange(of_component.size), of_component)
        sums = sparse.csr_array((np.ones(of_component.size), where), (of_component.size, len(self.members)))
        return sparse.csr_array(abs(self.gap_operator) @ sums)

    def least_of_partners(self, values: FloatArray) -> FloatArray:
        """Return (2 n_contact,) the smallest of the values (n_members,) of the members that meet in each component."""
        owners = self.owners
        least = np.full(owners.shape[0], values.max())
        np.minimum.at(least, np.repeat(np.arange(owners.shape[0]), np.diff(owners.indptr)), values[owners.indices])
        return least

    @for_all_loads
    def moduli(self) -> FloatArray:
        """(2 n_contact,) array: the E' of the more compliant partner, in each component of contact [Pa]."""
        return self.least_of_partners(np.array([member.modulus for member in self.members]))

    @for_all_loads
    def modulus(self) -> float:
        """Median of `moduli` over the contact nodes [Pa]."""
        return float(np.median(self.moduli[::2]))

    @for_all_loads
    def _motion_fit(self) -> Callable[[FloatArray], FloatArray]:
        """Least-squares fit of motions (n_motions,) to relative displacements (2 n_contact,)."""
        columns = sparse.csc_array(self.relative_motions.T)
        if not columns.shape[1]:
            return lambda missed: np.zeros(0)
        weighted = sparse.csc_array(columns.T * (self.moduli / self.modulus))
        factors = sparse.linalg.splu(
            sparse.csc_array(weighted @ columns), permc_spec="MMD_AT_PLUS_A", options={"SymmetricMode": True}
        )
        return lambda missed: np.asarray(factors.solve(weighted @ missed))

    def moving_bodies(self, coefficients: FloatArray) -> str:
        """Name the members that a combination (n_motions,) of the rigid motions moves."""
        return self._named(self._is_moved(coefficients))

    def partners_of(self, coefficients: FloatArray) -> str:
        """Name the members at rest in contact with these; if there are none, the obstacle or each other."""
        is_moved = self._is_moved(coefficients)
        has_moved_owner = self.owners @ is_moved.astype(float) > 0.0
        is_partner = (np.asarray(self.owners.T @ has_moved_owner.astype(float)) > 0.0) & ~is_moved
        if np.any(is_partner):
            return self._named(is_partner)
        has_one_owner = np.diff(self.owners.indptr) == 1
        return "the obstacle" if np.any(has_moved_owner & has_one_owner) else "each other"

    def _is_moved(self, coefficients: FloatArray) -> BoolArray:
        """Return (n_members,) bool: the members that a combination (n_motions,) of the rigid motions moves."""
        size = np.abs(coefficients)
        is_moved = np.zeros(len(self.members), bool)
        is_moved[self.motion_owner[size > 1e-6 * size.max()]] = True
        return is_moved

    def _named(self, is_named: BoolArray) -> str:
        if len(self.members) == 1 and not self.members[0].name:
            return "the body"
        numbers = np.flatnonzero(is_named)
        names = [f"{self.members[k].name!r}" if self.members[k].name else f"number {k + 1}" for k in numbers]
        if len(names) == 1:
            return f"body {names[0]}"
        return f"bodies {', '.join(names[:4])}" + (f" and {len(names) - 4} more" if len(names) > 4 else "")

    def _check_held(self) -> None:
        """Raise InputError if neither supports nor all contacts together can hold a member."""
        free = null_space(sparse.csr_array(self.relative_motions.T))
        if not free.shape[0]:
            return
        names = self.moving_bodies(np.asarray(abs(free).sum(axis=0), dtype=float))
        raise InputError(
            f"nothing holds {names}: no support, and no contact with anything that is held; make contacts or supports"
        )

    @cached_property
    def tangents(self) -> tuple[FloatArray, FloatArray]:
        """(n_contact,) arrays: slope and constant of ``w_t = slope w_n + constant``, NaN where both are independent."""
        normal, tangential = self.gap_operator[0::2], self.gap_operator[1::2]
        squares, product, other = (
            np.asarray(array.sum(axis=1)) for array in (normal * normal, normal * tangential, tangential * tangential)
        )
        is_dependent = squares * other - product**2 <= _DEPENDENT * squares * np.maximum(other, squares)
        slope = np.where(is_dependent, product, np.nan) / np.where(squares > 0.0, squares, 1.0)
        return slope, self.prescribed[1::2] - slope * self.prescribed[0::2]

    @cached_property
    def held_friction(self) -> HeldFriction:
        """How friction acts where the tangent follows."""
        return HeldFriction(self.tangent_follows, self.tangents[0])
