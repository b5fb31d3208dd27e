"""Distances to rigid obstacles, measured again."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import DirectedObstacle, Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.formulas import evaluate_field

_ROUND_OFF = 1e-12
"""Distance from a corner, relative to the coordinates, that may be their round-off."""


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
