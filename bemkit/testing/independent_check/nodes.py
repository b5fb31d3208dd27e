"""The contact nodes of a solution in frames of their own: direction into the obstacle, and a quarter turn on."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import cKDTree

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.obstacle import DirectedObstacle, Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.formulas import evaluate_field
from bemkit.scene.conditions import Clamped, Contact, PrescribedDisplacement, Roller
from bemkit.testing.independent_check.boundary import Boundary, Scales, boundary_of, scales_of
from bemkit.testing.independent_check.views import BodyView

_GRAZING_COSINE = 2e-3
"""Largest cosine between the body's normal and the direction of contact of a node that may face away: it would slide
five hundred times as far as it approaches, and normals at nodes are means over elements."""
_ROUND_OFF = 1e-12
"""Distance from a corner, relative to the coordinates, that may be their round-off."""


@dataclass(frozen=True, eq=False)
class Nodes:
    """The rows of a contact table, measured again.

    Parameters
    ----------
    nodes : (n_contact,) int array
        Rows of ``solution.boundary.displacement``.
    points : (n_contact, 2) array [m]
    offset : (n_contact,) array [m]
        Distance of the points of the table from those rows' points.
    frame : (n_contact, 2, 2) array [-]
        Rows are the direction d of contact and its quarter turn t.
    distance : (n_contact,) array [m]
        To the obstacle; infinite where the body faces away from it.
    is_grazing : (n_contact,) bool array
        Nodes for which round-off decides whether they face the obstacle.
    is_supported : (n_contact,) bool array
        Nodes that belong to a support as well: part of their force is a reaction, which no friction law governs.
    displacement, traction : (n_contact, 2) arrays [m], [Pa]
        From the boundary field; from sigma_n and sigma_t of the table. In x and y.
    """

    nodes: IntArray
    points: FloatArray
    offset: FloatArray
    frame: FloatArray
    distance: FloatArray
    is_grazing: BoolArray
    is_supported: BoolArray
    displacement: FloatArray
    traction: FloatArray

    def components(self, vectors: FloatArray) -> FloatArray:
        """Return the (n_contact, 2) components along d and t of vectors in x and y."""
        return np.asarray(np.einsum("nkc,nc->nk", self.frame, vectors))


def contact_nodes_of(solution: BodyView, boundary: Boundary) -> Nodes:
    """Find the contact nodes of a solution on its boundary and measure their obstacles."""
    table, fields = solution.contact, solution.boundary
    points = np.column_stack([table.x, table.y])
    offset, nodes = (np.asarray(each) for each in cKDTree(fields.points).query(points))
    normals, direction = np.zeros((2, table.n_contact, 2))
    distance = np.full(table.n_contact, np.inf)
    for part in solution.scene.contact_parts:
        own = table.rows(part.name)
        if isinstance(part.condition, Contact) and own.any():
            normals[own] = mean_normals(solution, boundary, part.name)[nodes[own]]
            distance[own], direction[own] = distance_to(part.condition.obstacle, points[own], normals[own])
    facing = np.sum(direction * normals, axis=1)
    frame = np.stack([direction, np.column_stack([-direction[:, 1], direction[:, 0]])], axis=1)
    is_supported = np.isin(nodes, supported_nodes(solution, boundary))
    components = np.column_stack([table.sigma_n, table.sigma_t])
    return Nodes(
        nodes=nodes,
        points=points,
        offset=offset,
        frame=frame,
        distance=np.where(facing > _GRAZING_COSINE, distance, np.inf),
        is_grazing=np.abs(facing) <= _GRAZING_COSINE,
        is_supported=is_supported,
        displacement=fields.displacement[nodes],
        traction=np.einsum("nk,nkc->nc", components, frame),
    )


class Fields(NamedTuple):
    """A solution, the load step before it, and the quantities that are measured again."""

    solution: BodyView
    before: BodyView | None
    boundary: Boundary
    nodes: Nodes
    scales: Scales

    @classmethod
    def of(cls, solution: BodyView, before: BodyView | None = None) -> Fields:
        """Measure the fields of a solution."""
        boundary = boundary_of(solution)
        return cls(solution, before, boundary, contact_nodes_of(solution, boundary), scales_of(solution, before))


def hidden_overlap(fields: Fields) -> float:
    """Return the overlap with obstacles at nodes that are not in the table, relative to the displacement.

    Supports hold the direction of contact there, so that only a warning can be required.
    """
    solution, boundary, nodes = fields.solution, fields.boundary, fields.nodes
    points, displacement = solution.boundary.points, solution.boundary.displacement
    motion = float(np.abs(displacement).max())
    deepest = 0.0
    for part in solution.scene.contact_parts:
        rows = np.setdiff1d(boundary.nodes[solution.mesh.part(part.name)], nodes.nodes)
        normals = mean_normals(solution, boundary, part.name)[rows]
        if isinstance(part.condition, Contact) and rows.size:
            distance, direction = distance_to(part.condition.obstacle, points[rows], normals)
            overlap = np.sum(displacement[rows] * direction, axis=1) - distance
            is_facing = np.sum(direction * normals, axis=1) > _GRAZING_COSINE
            deepest = max(deepest, float(np.max(overlap[is_facing], initial=0.0)))
    return deepest / motion if motion > 0.0 else deepest


def mean_normals(solution: BodyView, boundary: Boundary, part: str) -> FloatArray:
    """Return (n_nodes, 2) normals: mean by length of a part's elements that meet at a node, zero elsewhere."""
    elements = solution.mesh.part(part)
    total = np.zeros_like(solution.boundary.points)
    weighted = boundary.node_normals[elements] * boundary.lengths[elements][:, None, None]
    np.add.at(total, boundary.nodes[elements], weighted)
    size = np.hypot(total[:, 0], total[:, 1])
    return np.asarray(total / np.where(size > 0.0, size, 1.0)[:, None])


def supported_nodes(solution: BodyView, boundary: Boundary) -> IntArray:
    """Return the nodes on supports and on symmetry lines, which hold a body like rollers."""
    mesh = solution.mesh
    found = [np.zeros(0, np.intp)]
    for part in solution.scene.parts:
        if isinstance(part.condition, Clamped | Roller | PrescribedDisplacement):
            found.append(boundary.nodes[mesh.part(part.name)].ravel())
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:  # midpoints of elements lie on no line
        found.append(np.flatnonzero(mesh.on_symmetry_lines.any(axis=1)))
    return np.unique(np.concatenate(found))


def distance_to(obstacle: Obstacle, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure distances (n,) [m] of points to an obstacle, negative inside it, and unit vectors (n, 2) towards it.

    The vectors point into the obstacle at its nearest point. An obstacle that is not built in measures itself.

    Parameters
    ----------
    obstacle : Obstacle
    points, normals : (n, 2) arrays [m], [-]
        Of the body; the normals point out of it.
    """
    match obstacle:
        case RigidHalfPlane(point, normal):
            outward = np.array(normal) / np.hypot(*normal)
            return (points - np.array(point)) @ outward, np.broadcast_to(-outward, points.shape)
        case RigidCircle(centre, radius):
            away, distance = _polar(points, centre, normals)
            return distance - radius, -away
        case RigidCavity(centre, radius):
            away, distance = _polar(points, centre, -normals)
            return radius - distance, away
        case RigidPolygon(vertices):
            return _to_polygon(np.array(vertices, dtype=float), points, normals)
        case Gap(value=value, direction=None):
            return evaluate_field(value, points), normals
        case Gap(value=value, direction=(x, y)):
            towards = np.column_stack([evaluate_field(x, points), evaluate_field(y, points)])
            return evaluate_field(value, points), towards / np.hypot(towards[:, 0], towards[:, 1])[:, None]
    direction = obstacle.approach(points, normals) if isinstance(obstacle, DirectedObstacle) else normals
    return obstacle.gap(points, normals), direction


def _to_polygon(vertices: FloatArray, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return distance and direction to the nearest side or corner of a polygon, side by side.

    At a corner itself any direction between the normals of its sides is right; the body's normal is taken. Of sides
    that are equally near inside, such as those of a wedge, the first one counts.
    """
    round_off = _ROUND_OFF * np.abs(np.concatenate([vertices, points])).max()
    x, y = (vertices - vertices[0]).T
    if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0.0:
        vertices = vertices[::-1]
    to_corners = vertices[None] - points[:, None]
    (x0, y0), (x1, y1) = np.moveaxis(to_corners, -1, 0), np.moveaxis(np.roll(to_corners, -1, axis=1), -1, 0)
    turns = np.arctan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1)
    is_inside = np.abs(turns.sum(axis=1)) > np.pi  # the corners go once around a point inside
    nearest, direction = np.full(len(points), np.inf), np.zeros_like(points)
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        length = np.hypot(*(end - start))
        along = (end - start) / length
        inward = np.array([-along[1], along[0]])
        place, beside = (points - start) @ along, np.abs((points - start) @ inward)
        is_beside = (place >= 0.0) & (place <= length)
        is_beside &= beside < nearest - round_off
        _keep_nearer(nearest, direction, beside, np.broadcast_to(inward, points.shape), is_beside)
    for start in vertices:
        to_start = np.hypot(*(start - points).T)
        sign = np.where(is_inside, -1.0, 1.0)[:, None]
        towards = sign * (start - points) / np.where(to_start > 0.0, to_start, 1.0)[:, None]
        _keep_nearer(nearest, direction, to_start, towards, to_start > 0.0)
    is_corner = np.hypot(*np.moveaxis(to_corners, -1, 0)).min(axis=1) <= round_off
    return np.where(is_inside, -nearest, nearest), np.where(is_corner[:, None], normals, direction)


def _keep_nearer(
    nearest: FloatArray, direction: FloatArray, distance: FloatArray, towards: FloatArray, is_meant: BoolArray
) -> None:
    is_nearer = is_meant & (distance < nearest)
    nearest[is_nearer], direction[is_nearer] = distance[is_nearer], towards[is_nearer]


def _polar(points: FloatArray, centre: tuple[float, float], otherwise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors away from a centre, others at the centre itself, and distances from it."""
    offset = points - np.array(centre)
    distance = np.hypot(offset[:, 0], offset[:, 1])
    is_apart = distance > 0.0
    unit = np.where(is_apart[:, None], offset / np.where(is_apart, distance, 1.0)[:, None], otherwise)
    return unit, distance
