"""How far several bodies in contact are from equilibrium, each by its own forces."""

from __future__ import annotations

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.operators.equilibrium import NOISE_FACTOR, Imbalance

LIGHTEST = 1e-3
"""Forces on a member below this share of the largest on any are measured by this share: one linear system finds them
all, and leaves its round-off everywhere."""


def imbalance_of(joined: CoupledMembers, state: ContactState) -> Imbalance:
    """Return how far a state is from a response of the members.

    Parameters
    ----------
    joined : CoupledMembers
    state : ContactState

    Returns
    -------
    Imbalance
        `force` is the largest relative displacement that no deformation and no motion of the members explains, as the
        force it would take (E' of the partner that yields more), or a force along an eliminated tangent; `moment` the
        work of load and contact forces on a rigid motion of a member, of largest entry one. The first is relative to
        the largest force on the lightest loaded member there, the second to the sum of all forces on the member.
        Members that carry nothing are measured by a thousandth of the largest forces on any.
    """
    contact = joined.contact_forces(state)
    displacement, missed = joined.recover(state)
    # of forces before they cancel: contact may press a rigid body from all sides, without a resultant
    nodal = np.abs(joined.weights[:, None] * state.traction).ravel()
    sizes, eps = abs(joined.relative).T @ nodal + np.abs(joined.load), float(np.finfo(float).eps)
    first = np.cumsum([0, *(member.n_components for member in joined.members)])[:-1]
    largest, total = np.maximum.reduceat(sizes, first), np.add.reduceat(sizes, first)
    # the terms whose differences the forces and the relative displacements are
    terms = np.empty_like(sizes)
    for shape in joined.shapes:
        terms[shape.rows] = shape.column_sizes * np.abs(displacement)[shape.rows]
    reach = abs(joined.relative) @ np.abs(displacement) + np.abs(joined.offset) + np.abs(state.displacement.ravel())
    per_length = joined.moduli * np.repeat(joined.weights / np.median(joined.weights), 2)
    if not np.abs(joined.load).sum() > 0.0 and total.sum() <= NOISE_FACTOR * eps * terms.sum():
        # nothing but motions: forces are round-off, and no measure
        largest, total = np.maximum.reduceat(terms, first), np.add.reduceat(terms, first)
    if not (largest.max() > 0.0 and np.isfinite(largest).all()):
        return Imbalance(0.0, 0.0) if not missed.any() else Imbalance(float("inf"), 0.0)
    largest = np.maximum(largest, LIGHTEST * largest.max())
    total = np.maximum(total, LIGHTEST * total.max())

    at_contact = joined.least_of_partners(largest)
    stray = np.where(joined.tangent_is_eliminated, joined.weights * np.abs(state.sigma_t), 0.0)
    missing = np.abs(missed) * per_length / at_contact
    missing[1::2] = np.maximum(missing[1::2], stray / at_contact[1::2])
    motions, owner = joined.motions, joined.motion_owner
    size = abs(motions).max(axis=0).toarray().ravel() if len(owner) else np.zeros(0)
    work = np.abs(motions.T @ (contact + joined.load)) / size / total[owner]
    of_sums = eps * np.add.reduceat(terms, first) / total
    return Imbalance(
        float(missing.max()),
        float(np.max(work, initial=0.0)),
        float(max((eps * reach * per_length / at_contact).max(), of_sums.max())),
    )
