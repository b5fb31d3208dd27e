"""Field of all other elements at a cluster: near elements individually, all others as one circle around it.

Outside of a circle of twice the radius of a cluster every displacement that its elements cause follows from that on the
circle, and every displacement that comes from outside of it is, within, that of forces on the circle. So the near field
and the points of a proxy circle say all that the elements of a cluster do to the rest of the boundary, and the other
way round [MartinssonRokhlin2005].
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, IntArray
from bemkit.operators.hierarchy.clusters import Discs

PROXY_RATIO = 2.0
"""Radius of the proxy circle by that of the cluster: what varies m times along the circle decays like 2^-m inside."""


def near_clusters(discs: Discs, cluster: int) -> IntArray:
    """Return the other clusters of a level that reach into the proxy circle of one."""
    distance = np.abs(discs.centre - discs.centre[cluster])
    distance[cluster] = np.inf
    found: IntArray = np.flatnonzero(distance < discs.radius + PROXY_RATIO * discs.radius[cluster])
    return found


def proxy_points(discs: Discs, cluster: int, n_points: int) -> ComplexArray:
    """Return points on the proxy circle of a cluster."""
    turns = np.exp(2j * np.pi * np.arange(n_points) / n_points)
    points: ComplexArray = discs.centre[cluster] + PROXY_RATIO * discs.radius[cluster] * turns
    return points


def n_proxies(tolerance: float) -> int:
    """Return how many points of a proxy circle make the field on it known to a tolerance."""
    return int(2.2 * np.log(1.0 / tolerance) / np.log(PROXY_RATIO)) + 8
