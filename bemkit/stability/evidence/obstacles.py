"""Distance and direction of obstacles, from their own geometry."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import Cavity, Circle, Gap, HalfPlane, Obstacle
from bemkit.expression import evaluate_field


def distance_to(obstacle: Obstacle, points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Measure the way from points of the body to an obstacle.

    Parameters
    ----------
    obstacle : Obstacle
        One that is not built in is asked itself.
    points, normals : (n, 2) arrays [m], [-]
        Of the body; the normals point out of it.

    Returns
    -------
    distance : (n,) array [m]
        To the nearest point of the obstacle, negative inside it.
    direction : (n, 2) array [-]
        Unit vectors into the obstacle at its nearest point.
    """
    match obstacle:
        case HalfPlane(point, normal):
            outward = np.array(normal) / np.hypot(*normal)
            return (points - np.array(point)) @ outward, np.broadcast_to(-outward, points.shape)
        case Circle(centre, radius):
            away, distance = _polar(points, centre, normals)
            return distance - radius, -away
        case Cavity(centre, radius):
            away, distance = _polar(points, centre, -normals)
            return radius - distance, away
        case Gap(value=value):
            return evaluate_field(value, points), normals
    return obstacle.gap(points, normals), normals


def _polar(points: FloatArray, centre: tuple[float, float], otherwise: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return unit vectors away from a centre, others at the centre itself, and distances from it."""
    offset = points - np.array(centre)
    distance = np.hypot(offset[:, 0], offset[:, 1])
    is_apart = distance > 0.0
    unit = np.where(is_apart[:, None], offset / np.where(is_apart, distance, 1.0)[:, None], otherwise)
    return unit, distance
