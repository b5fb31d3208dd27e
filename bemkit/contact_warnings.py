"""Where the contact conditions of a scene say less than its reader may think, in sentences."""

from __future__ import annotations

import math

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.model import Model
from bemkit.solvers.active_sets import NodeStatus

LARGEST_ANGLE = 30.0
"""Degrees between the body's normal and the direction of contact. A side lies down on its obstacle by turning through
this angle, and small displacements hold for turns that are small against one: a half is not."""
SMALLEST_OVERLAP = 1e-6
"""Share of the largest displacement below which an overlap is round-off of coordinates and prescribed motions."""


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
    candidates, nodes = model.candidates, model.candidates.nodes
    overlap = np.sum(displacement[nodes.nodes] * nodes.directions, axis=1) - candidates.gap
    overlap[np.isin(nodes.nodes, model.nodes.nodes)] = -math.inf
    found = []
    for part in dict.fromkeys(candidates.parts):
        own = np.array([name == part for name in candidates.parts])
        node = int(np.argmax(np.where(own, overlap, -math.inf)))
        if overlap[node] > SMALLEST_OVERLAP * np.abs(displacement).max():
            x, y = candidates.points[node]
            found.append(
                f"Supports push part {part!r} {overlap[node]:.3g} m into its obstacle at ({x:.6g}, {y:.6g}), where "
                "contact cannot act: let them move with the obstacle, or leave a free element between them."
            )
    return found
