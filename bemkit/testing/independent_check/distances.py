"""Gaps, relative displacements and overlaps of a solution, measured again on its fields."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.scene.conditions import Contact
from bemkit.testing.independent_check.boundary import EPSILON, beyond, largest
from bemkit.testing.independent_check.interfaces import Interfaces
from bemkit.testing.independent_check.nodes import distance_to, mean_normals
from bemkit.testing.independent_check.sides import measure_flat, sampled_overlap

_SAMPLED = 1.25
"""How much deeper an overlap may be found at other points of the same elements, also where those of the other side are
shorter than the points are apart."""

_DIRECTIONS = 1e-2
"""Angle [rad] by which directions of contact on curved sides may differ: a body that spins moves along them. Normals
that parabolas interpolate on an element which turns by t differ by t^3 / 125: 3e-2 of 90 degrees."""


def gap_mismatch(joints: Interfaces) -> float:
    """Return the largest difference [-] of gaps from distances measured again."""
    table, worst = joints.solution.contact, [0.0]
    length, _ = joints.units()
    for name in table.parts:
        rows = table.rows(name)
        scales = joints.side(joints.owner(name)).body.scales
        partner = joints.partner(name)
        if partner is not None:
            pair = joints.pairs[name]
            flat = measure_flat(joints.side(joints.owner(name)), joints.side(partner), pair)
            if flat is None:
                continue
            differences = np.abs(
                table.gap[rows] - flat.distance - pair.gap_at(np.column_stack([table.x, table.y])[rows])
            )
        else:
            differences = _from_obstacle(joints, name)
        coordinates = max(scales.coordinates, 64.0 * EPSILON * float(np.abs([table.x, table.y]).max()))
        worst.append(beyond(differences, coordinates, float(length[rows][0])))
    return float(np.max(worst))


def _from_obstacle(joints: Interfaces, name: str) -> FloatArray:
    """Return differences [m] of gaps from the distances of a rigid obstacle, in its position before it moves."""
    table, rows = joints.solution.contact, joints.solution.contact.rows(name)
    points = np.column_stack([table.x, table.y])[rows]
    body, part = joints.owner(name)
    measured = joints.bodies[body]
    nodes = np.linalg.norm(points[:, None] - measured.result.boundary.points, axis=2).argmin(axis=1)
    normals = mean_normals(measured.fields.solution, measured.boundary, part)[nodes]
    added, pair = np.zeros(len(points)), joints.moving.get(name)
    if pair is None:
        (condition,) = (each.condition for each in measured.result.scene.parts if each.name == part)
        assert isinstance(condition, Contact)
        obstacle = condition.obstacle
    else:
        added, obstacle = pair.gap_at(points), joints.solution.scene.rigid_body_of(pair).obstacle
    distance, _ = distance_to(obstacle, points, normals)
    known = np.isfinite(table.gap[rows])
    return np.abs(table.gap[rows][known] - distance[known] - added[known])


def mean_mismatch(joints: Interfaces) -> float:
    """Return the largest difference [-] of relative displacements of flat sides from their means in the table."""
    table, worst = joints.solution.contact, [0.0]
    lengths, _ = joints.units()
    known = np.isfinite(table.gap)
    clearance = np.abs(table.clearance[known] - (table.gap[known] - table.u_n[known]))
    worst.append(largest(clearance / lengths[known]))
    for name in table.parts:
        rows, partner = table.rows(name), joints.partner(name)
        if partner is None:
            continue
        flat = measure_flat(joints.side(joints.owner(name)), joints.side(partner), joints.pairs[name])
        weight = table.weight[rows]
        if flat is None or abs(weight.sum() - flat.length) > 1e-9 * flat.length:
            continue  # slivers beside nodes that others hold carry no multiplier
        sums = np.array([weight @ table.u_n[rows], weight @ table.u_t[rows]])
        turned = max(joints.side(side).body.scales.turned for side in joints.solution.contact_sides[name])
        worst.append(beyond(np.abs(sums - flat.means) / flat.length, turned, float(lengths[rows][0])))
    return float(np.max(worst))


def hidden_overlaps(joints: Interfaces) -> tuple[float, float]:
    """Return the overlap of both sides, relative to the displacement that strains the bodies.

    Returns
    -------
    float
        The deepest of all.
    float
        Their excess over the overlap that the solution reports.
    """
    deepest, unsaid = [0.0], [0.0]
    for pair in joints.pairs.values():
        one, two = (joints.side(name) for name in joints.solution.contact_sides[pair.name])
        flat = measure_flat(one, two, pair)
        reach = 0.25 * min(one.body.result.mesh.diameter, two.body.result.mesh.diameter)
        overlap = sampled_overlap(one, two, pair, reach) if flat is None else flat.overlap
        length = max(one.body.scales.length, two.body.scales.length)
        said = joints.solution.contacts_between_nodes[pair.name].penetration_depth
        moved = max(float(np.abs(side.body.result.boundary.displacement).max()) for side in (one, two))
        coordinates = 64.0 * EPSILON * float(np.abs(one.body.result.mesh.nodes).max())
        directions = max(_DIRECTIONS, max(one.turn, two.turn) ** 3 / 125.0)
        allowed = coordinates + (0.0 if flat is not None else directions * moved)
        deepest.append(overlap / length)
        unsaid.append(beyond(np.array([overlap - _SAMPLED * said]), allowed, length))
    return float(np.max(deepest)), float(np.max(unsaid))
