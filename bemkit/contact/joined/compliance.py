"""What forces at the contact nodes and rigid motions of the members do to relative displacements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.contact.joined.member import blocks_of_members


@dataclass(frozen=True, eq=False)
class Compliance:
    """Members seen from their contact nodes: forces p and motions a move them by ``by_force p + by_motion a``.

    Strain and motion stand apart: a body of large modulus that soft ones carry moves far and hardly deforms, and no
    stiffness would tell the one from the other in the last digits.

    Parameters
    ----------
    by_force : (2 n_contact, 2 n_contact) sparse array [1/Pa]
    by_motion : (2 n_contact, n_motions) sparse array [-]
    force_unit : (2 n_contact,) array [Pa]
        E' of the partner that yields more: what makes the first array one of size one.
    motion_unit : (n_motions,) array [1/Pa]
        One by the E' of the member that moves.
    """

    by_force: sparse.csr_array
    by_motion: sparse.csr_array
    force_unit: FloatArray
    motion_unit: FloatArray

    @classmethod
    def of(cls, joined: CoupledMembers) -> Compliance:
        """Multiply the flexibilities of the members by their coupling."""
        of_members = blocks_of_members(joined.shapes, lambda shape: shape.flexibility)
        moduli = np.array([member.modulus for member in joined.members])
        return cls(
            sparse.csr_array(joined.relative @ of_members @ joined.relative.T),
            sparse.csr_array(joined.felt_motions.T),
            joined.moduli,
            1.0 / moduli[joined.motion_owner],
        )
