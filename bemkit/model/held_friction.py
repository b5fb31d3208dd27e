"""Friction at contact nodes that a support holds along the tangent.

What acts there along the tangent is the sum of friction and the reaction of the support. So friction is no unknown of
the contact problem at such a node, and has no influence on the body. What it is follows from the displacement that the
support prescribes: where the node slips, the law says it. A node that rests carries none: a support that holds one
direction is free of shear, and shear stresses are equal on both sides of a right angle.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.body import ContactState
from bemkit.model.contact_model import Model
from bemkit.solvers.active_sets import NodeStatus

AT_REST = 1e-9
"""Slip below this share of the largest displacement is round-off of the frames of contact and support."""


def with_held_friction(model: Model, state: ContactState, node_status: IntArray) -> tuple[ContactState, IntArray]:
    """Complete a solution of the contact problem by the friction at nodes that supports hold.

    Parameters
    ----------
    model : Model
    state : ContactState
        Dimensionless; at these nodes without tangential traction.
    node_status : (n_contact,) array of `NodeStatus` values

    Returns
    -------
    state : ContactState
    node_status : (n_contact,) array of `NodeStatus` values
        Other nodes are as they were.
    """
    held = model.body.is_held
    if not held.any():
        return state, node_status
    law, is_closed = model.law, node_status != NodeStatus.SEPARATED
    sigma_n = np.minimum(state.sigma_n, 0.0)
    bound = np.where(is_closed | np.asarray(law.acts_across_gap), law.bound(sigma_n), 0.0)
    has_friction = held & ((bound > 0.0) | (law.bound_derivative(sigma_n) != 0.0))
    slip = state.u_t - model.problem.slip_origin
    slip = np.where(np.abs(slip) > AT_REST * np.abs(state.displacement).max(), slip, 0.0)
    sigma_t = np.where(has_friction, -bound * np.sign(slip), state.sigma_t)
    status = np.select([slip > 0.0, slip < 0.0], [NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD], NodeStatus.STICK)
    status = np.where(has_friction & is_closed, status, node_status)
    return ContactState(state.displacement, np.stack([state.sigma_n, sigma_t], axis=1)), status
