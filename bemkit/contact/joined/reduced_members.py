"""Members reduced to the displacement components that contacts feel, for systems that are factored again and again."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse
from scipy.linalg import qr

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.contact.joined.member import Member
from bemkit.operators.linear.blocks import diagonal_blocks

_WORTHWHILE = 0.8
"""Share of the components of a member that contacts may feel for the others to be eliminated."""


@dataclass(frozen=True, eq=False)
class ReducedMembers:
    """What is left of members whose components outside of contacts follow from the others.

    Parameters
    ----------
    stiffness : (n_kept, n_kept) sparse array [Pa]
    relative : (2 n_contact, n_kept) sparse array [-]
        The coupling of what is kept.
    on_kept : (n_kept, n) sparse array [-]
        From loads on all components to loads on what is kept.
    """

    stiffness: sparse.csr_array
    relative: sparse.csr_array
    on_kept: sparse.csr_array

    @classmethod
    def of(cls, joined: CoupledMembers) -> ReducedMembers:
        """Eliminate what no contact feels: a disc that touches others in a few places keeps a few components."""
        is_felt = np.zeros(joined.relative.shape[1], bool)
        is_felt[joined.relative.indices] = True
        kept_columns, stiffnesses, transfers = [], [], []
        first = 0
        for member in joined.members:
            last = first + member.n_components
            kept = _kept(member, is_felt[first:last])
            kept_columns.append(first + kept)
            stiffness, transfer = _condensed(member.stiffness, kept)
            stiffnesses.append(stiffness)
            transfers.append(transfer)
            first = last
        return cls(
            diagonal_blocks(stiffnesses),
            sparse.csr_array(joined.relative[:, np.concatenate(kept_columns)]),
            diagonal_blocks(transfers),
        )


def _kept(member: Member, is_felt: BoolArray) -> IntArray:
    """Return the components that are kept: what is felt, and what holds the rigid motions while the others follow."""
    if np.count_nonzero(is_felt) > _WORTHWHILE * is_felt.size:
        return np.arange(is_felt.size)
    is_kept = is_felt.copy()
    if len(member.motions):
        _, order = qr(member.motions, mode="r", pivoting=True)
        is_kept[order[: len(member.motions)]] = True
    return np.flatnonzero(is_kept)


def _condensed(stiffness: FloatArray, kept: IntArray) -> tuple[FloatArray, sparse.csr_array]:
    """Return the Schur complement of the kept components, and what loads on the others are worth there."""
    n = len(stiffness)
    others = np.setdiff1d(np.arange(n), kept)
    on_kept = np.zeros((kept.size, n))
    on_kept[np.arange(kept.size), kept] = 1.0
    if not others.size:
        return stiffness, sparse.csr_array(on_kept)
    coupling = stiffness[np.ix_(kept, others)]
    on_kept[:, others] = -np.linalg.solve(stiffness[np.ix_(others, others)].T, coupling.T).T
    condensed = stiffness[np.ix_(kept, kept)] + on_kept[:, others] @ stiffness[np.ix_(others, kept)]
    if np.array_equal(stiffness, stiffness.T):
        condensed = 0.5 * (condensed + condensed.T)
    return condensed, sparse.csr_array(on_kept)
