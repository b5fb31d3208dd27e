"""Overlaps of a contact that its nodes do not show: between them, and where supports hold them."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.testing.independent_check.boundary import mean_normals
from bemkit.testing.independent_check.contacts import GRAZING_COSINE, Facing, MeasuredContact, gap_of
from bemkit.testing.independent_check.obstacles import distance_to
from bemkit.testing.independent_check.scales import EPSILON, beyond
from bemkit.testing.independent_check.sides import sampled_overlap

_SAMPLED = 1.25
"""How much deeper an overlap may be found at other points of the same elements, also where those of the other side are
shorter than the points are apart."""

_DIRECTIONS = 1e-2
"""Angle [rad] by which directions of contact on curved sides may differ: a body that spins moves along them. Normals
that parabolas interpolate on an element which turns by t differ by t^3 / 125: 3e-2 of 90 degrees."""


def hidden_overlap(contact: MeasuredContact) -> float:
    """Return the deepest overlap [m] of both sides at points between nodes."""
    if contact.facing is not None:
        elements, body = contact.owner.elements, contact.owner.body
        displacement = body.boundary.interpolated(body.solved.boundary.displacement)
        fields = (body.boundary.points, body.boundary.normals, displacement)
        return _depth(contact, contact.facing, *(each[elements].reshape(-1, 2) for each in fields))
    if contact.flat is not None or contact.partner is None or contact.pair is None:
        return 0.0 if contact.flat is None else contact.flat.overlap
    reach = 0.25 * min(side.body.solved.mesh.diameter for side, _ in contact.sides)
    return sampled_overlap(contact.owner, contact.partner, contact.pair, reach)


def unsaid_overlap(contact: MeasuredContact, overlap: float, said: float) -> float:
    """Return how much deeper [-] a measured overlap [m] is than what the solution says."""
    sides = [side for side, _ in contact.sides]
    moved = max(float(np.abs(side.body.solved.boundary.displacement).max()) for side in sides)
    coordinates = 64.0 * EPSILON * max(float(np.abs(side.body.solved.mesh.nodes).max()) for side in sides)
    directions = 0.0 if contact.flat else max(_DIRECTIONS, max(side.turn for side in sides) ** 3 / 125.0)
    return beyond(np.array([overlap - _SAMPLED * said]), coordinates + directions * moved, contact.length)


def held_overlap(contact: MeasuredContact, known: IntArray) -> float:
    """Return the overlap with an obstacle at nodes without a row of the table (`known`), relative to the displacement.

    Supports hold the direction of contact there, so that only a warning can be required.
    """
    if contact.facing is None:
        return 0.0
    body, boundary = contact.owner.body.solved, contact.owner.body.boundary
    rows = np.setdiff1d(boundary.nodes[contact.owner.elements], known)
    normals = mean_normals(body, boundary, contact.owner.part)[rows]
    deepest = _depth(contact, contact.facing, body.boundary.points[rows], normals, body.boundary.displacement[rows])
    motion = float(np.abs(body.boundary.displacement).max())
    return deepest / motion if motion > 0.0 else deepest


def _depth(
    contact: MeasuredContact, facing: Facing, points: FloatArray, normals: FloatArray, displacement: FloatArray
) -> float:
    """Return how deep [m] points with normals and displacements, all (n, 2), are in an obstacle."""
    distance, direction = distance_to(facing.obstacle, points, normals)
    relative = displacement - facing.displacement(points + distance[:, None] * direction, facing.motion)
    overlap = np.sum(relative * direction, axis=1) - distance - gap_of(contact.pair, points)
    is_facing = np.sum(direction * normals, axis=1) > GRAZING_COSINE
    return float(np.max(overlap[is_facing], initial=0.0))
