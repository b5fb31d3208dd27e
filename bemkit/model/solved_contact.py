"""What follows from a solved contact state: friction at nodes that supports hold, and doubts in sentences.

What acts along the tangent of a node that a support holds there is the sum of friction and the reaction of the support.
So friction is no unknown of the contact problem at such a node, and has no influence on the body. What it is follows
from the displacement that the support prescribes: where the node slips, the law says it. A node that rests carries
none: a support that holds one direction is free of shear, and shear stresses are equal on both sides of a right angle.
"""

from __future__ import annotations

import math

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.model.contact_model import Model
from bemkit.scene.unit_names import amount
from bemkit.solvers.active_sets import NodeStatus

SLIP_TOLERANCE = 1e-9
"""Slip below this share of the largest displacement is round-off of the frames of contact and support."""
LARGEST_ANGLE = 30.0
"""Degrees between the body's normal and the direction of contact. A side lies down on its obstacle by turning through
this angle, and small displacements hold for turns that are small against one: a half is not."""
SMALLEST_OVERLAP = 1e-6
"""Share of the largest displacement below which an overlap is round-off of coordinates and prescribed motions."""


def with_held_friction(
    model: Model, state: ContactState, node_status: IntArray, motion: SlipHistory | None = None
) -> tuple[ContactState, IntArray]:
    """Complete a solution of the contact problem by the friction at nodes that supports hold.

    Parameters
    ----------
    model : Model
    state : ContactState
        Dimensionless; at these nodes without tangential traction.
    node_status : (n_contact,) array of `NodeStatus` values
    motion : SlipHistory, optional
        For laws that depend on slip or time.

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
    law = law if motion is None else law.at_slip(motion)
    sigma_n = np.minimum(state.sigma_n, 0.0)
    bound = np.where(is_closed | np.asarray(law.acts_across_gap), law.bound(sigma_n), 0.0)
    has_friction = held & ((bound > 0.0) | (law.bound_derivative(sigma_n) != 0.0))
    slip = state.u_t - model.problem.slip_origin
    slip = np.where(np.abs(slip) > SLIP_TOLERANCE * np.abs(state.displacement).max(), slip, 0.0)
    sigma_t = np.where(has_friction, -bound * np.sign(slip), state.sigma_t)
    status = np.select([slip > 0.0, slip < 0.0], [NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD], NodeStatus.STICK)
    status = np.where(has_friction & is_closed, status, node_status)
    return ContactState(state.displacement, np.stack([state.sigma_n, sigma_t], axis=1)), status


def contact_warnings(model: Model, displacement: FloatArray, node_status: IntArray) -> tuple[str, ...]:
    """Say where contact is closed at a large angle, and where supports push the body into an obstacle.

    Parameters
    ----------
    model : Model
    displacement : (n_nodes, 2) array [m]
        Of all nodes of the displacement space.
    node_status : (n_contact,) array of `NodeStatus` values

    Returns
    -------
    tuple of str
        At most one sentence of either kind for each contact part.
    """
    return (*_oblique(model, node_status), *_pushed_in(model, displacement))


def _oblique(model: Model, node_status: IntArray) -> list[str]:
    contact = model.contact
    angle = np.degrees(np.arccos(np.clip(contact.facing, -1.0, 1.0)))
    is_oblique = (node_status != NodeStatus.SEPARATED) & (angle > LARGEST_ANGLE)
    worst: dict[str, float] = {}
    for node in np.flatnonzero(is_oblique).tolist():
        part = contact.parts[node]
        worst[part] = max(worst.get(part, 0.0), float(angle[node]))
    return [
        f"Part {part!r} touches its obstacle at up to {degrees:.0f} degrees to its own normal, where small "
        "displacements no longer describe how it lies down: describe the body in a position nearer to its final one."
        for part, degrees in worst.items()
    ]


def _pushed_in(model: Model, displacement: FloatArray) -> list[str]:
    candidates, nodes = model.prepared.candidates, model.prepared.candidates.nodes
    overlap = np.sum(displacement[nodes.nodes] * nodes.directions, axis=1) - candidates.gap
    overlap[np.isin(nodes.nodes, model.nodes.nodes)] = -math.inf
    found = []
    for part in dict.fromkeys(candidates.parts):
        node = int(np.argmax(np.where(np.equal(candidates.parts, part), overlap, -math.inf)))
        if overlap[node] > SMALLEST_OVERLAP * np.abs(displacement).max():
            x, y = candidates.points[node]
            depth = amount(overlap[node], "length", model.scene.units, 3)
            found.append(
                f"Supports push part {part!r} {depth} into its obstacle at ({x:.6g}, {y:.6g}), where "
                "contact cannot act: let them move with the obstacle, or leave a free element between them."
            )
    return found
