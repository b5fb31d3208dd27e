"""Few members: the dense stiffness of their relative displacements, computed once."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray
from bemkit.contact.dense_body import DenseBody, FollowingTangents
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.contact.joined.member import Member
from bemkit.operators.linear_solvers import DenseLU

_TIED = "the bodies tied to each other at all contact nodes (remove a tie that follows from the others)"


class RelativeStiffness:
    """Stiffness of the contact nodes: forces by relative displacements. It does not depend on the loads.

    Raises
    ------
    SingularMatrixError
        If a tie is redundant.

    Notes
    -----
    With the flexibility G of the members, their motions R and the coupling B the unknowns p (nodal forces) and a
    (motions) solve ``B G B^T p + B R a = w - o - B G f`` and ``R^T B^T p = -R^T f``; the inverse of this matrix holds
    the stiffness of w. The rows of tangents that follow are not equations. Pressures of incompressible members are
    further rows of B and entries of w, so that the stiffness is that of both.
    """

    def __init__(self, joined: CoupledMembers) -> None:
        is_kept = np.ones((joined.n_contact, 2), bool)
        is_kept[joined.tangent_follows, 1] = False
        self._is_kept = is_kept.ravel()
        of_pressures = sparse.eye_array(joined.gap_operator.shape[1], format="csr")[joined.pressures]
        self._coupling = sparse.vstack([joined.gap_operator[self._is_kept], of_pressures], format="csr")
        self._followers = joined.gap_operator[~self._is_kept]
        self._follows, self._slope = joined.tangent_follows, joined.tangents[0][joined.tangent_follows]
        self._unit_deformation = joined.deformation(self._coupling.T.toarray())
        n_kept, motions = self._coupling.shape[0], (self._coupling @ joined.motions).toarray()
        n_motions = motions.shape[1]
        matrix = np.zeros((n_kept + n_motions, n_kept + n_motions))
        matrix[:n_kept, :n_kept] = joined.modulus * (self._coupling @ self._unit_deformation)
        matrix[:n_kept, n_kept:] = motions
        self._following_motions = (self._followers @ joined.motions).toarray()
        matrix[n_kept:, :n_kept] = motions.T
        scale = np.append(np.full(n_kept, joined.modulus), np.ones(n_motions))  # of the unknowns: p / E', a
        inverse = scale[:, None] * DenseLU(matrix, _TIED).solve(np.eye(n_kept + n_motions))
        self._inverse = inverse  # from w - o - B G f and -R^T f / E' to p and a
        self._stiffness = inverse[:n_kept, :n_kept]
        if joined.is_symmetric:
            self._stiffness = 0.5 * (self._stiffness + self._stiffness.T)

    def body(self, joined: CoupledMembers) -> DenseBody:
        """Return the body under the loads and offsets of `joined`."""
        n_kept, load = self._coupling.shape[0], joined.load
        loaded = joined.deformation(load)
        offset = np.append(joined.prescribed[self._is_kept], np.zeros(joined.pressures.size))
        right_side = np.append(-(offset + self._coupling @ loaded), -(joined.motions.T @ load) / joined.modulus)
        at_rest = self._inverse @ right_side  # p and a where no relative displacement is allowed
        return DenseBody(
            stiffness=self._stiffness,
            load=-at_rest[:n_kept],
            weights=joined.weights,
            motions=(joined.gap_operator @ joined.motions).T.toarray().reshape(-1, joined.n_contact, 2),
            following_tangents=self._followed(joined, loaded, at_rest),
            modulus=joined.stiffness_scale * float(np.median(joined.weights)),
            n_pressures=joined.pressures.size,
            largest_modulus=_modulus_of_room(joined.members),
        )

    def _followed(self, joined: CoupledMembers, loaded: FloatArray, at_rest: FloatArray) -> FollowingTangents | None:
        if not self._follows.any():
            return None
        n_kept = self._coupling.shape[0]
        displacement = joined.prescribed[~self._is_kept] + self._followers @ loaded
        displacement = displacement + self._by_force @ at_rest[:n_kept] + self._following_motions @ at_rest[n_kept:]
        slope, constant = (array[self._follows] for array in joined.tangents)
        return FollowingTangents(
            np.flatnonzero(self._follows), self._following, np.where(np.isnan(slope), displacement, constant)
        )

    @cached_property
    def _by_force(self) -> FloatArray:
        """(n_following, n_kept) array: displacements of tangents that follow by unit forces."""
        return np.asarray(self._followers @ self._unit_deformation)

    @cached_property
    def _following(self) -> FloatArray:
        """(n_following, n_kept) array: displacements of tangents that follow by unit kept relative displacements."""
        n_kept = self._coupling.shape[0]
        by_motions = self._following_motions @ self._inverse[n_kept:, :n_kept]
        response = np.asarray(self._by_force @ self._stiffness + by_motions)
        # where the normal displacement of the node itself gives the tangent nothing else takes part, not by round-off
        own = np.flatnonzero(~np.isnan(self._slope))
        response[own] = 0.0
        normal = np.cumsum(self._is_kept)[2 * np.flatnonzero(self._follows)] - 1
        response[own, normal[own]] = self._slope[own]
        return response


def _modulus_of_room(members: Sequence[Member]) -> float:
    """Return the largest modulus of members that make room for others; if there are none, the smallest of all."""
    yielding = [max(each.modulus, each.bulk_modulus) for each in members if each.bulk_modulus or not each.n_pressures]
    return max(yielding, default=min(member.modulus for member in members))
