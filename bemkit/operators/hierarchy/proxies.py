"""What a cluster of elements sees of the others: those near it one by one, all others as one circle around it.

Outside of a circle of twice the radius of a cluster every displacement that its elements cause follows from that on the
circle, and every displacement that comes from outside of it is, within, that of forces on the circle. So the near field
and the points of a proxy circle say all that the elements of a cluster do to the rest of the boundary, and the other
way round [MartinssonRokhlin2005].
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray
from bemkit.operators.hierarchy.boundary_columns import BoundaryColumns
from bemkit.operators.hierarchy.clusters import Discs
from bemkit.operators.hierarchy.tree import ClusterTree

PROXY_RATIO = 2.0
"""Radius of the proxy circle by that of the cluster: what varies m times along the circle decays like 2^-m inside."""


def discs_of(columns: BoundaryColumns, tree: ClusterTree, level: int) -> Discs:
    """Return discs around the clusters of a level, with all elements on which their unknowns act."""
    ends = np.stack([columns.start, columns.centre, columns.end])
    n = columns.n_elements
    return Discs.around(tree, level, ends[:, :n], ends[:, columns.reach].reshape(-1, n))


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


def extents(columns: BoundaryColumns) -> FloatArray:
    """Return how far from the middle of each element its unknowns act [m]."""
    ends = np.stack([columns.start, columns.centre, columns.end])
    far: FloatArray = np.abs(ends[:, columns.reach] - columns.centre[: columns.n_elements]).max(axis=(0, 1))
    return far


def point_forces(x: ComplexArray, sources: ComplexArray, poisson_ratio: float, log_length: float) -> FloatArray:
    """Return displacements that unit forces along x and y cause, by 8 pi mu (1 - nu).

    Parameters
    ----------
    x : (n_points,) complex array
    sources : (n_sources,) complex array
    poisson_ratio, log_length : float

    Returns
    -------
    (2 n_sources, 2 n_points) array
        By 2 * source + component of the force and 2 * point + component of the displacement.
    """
    kappa = 3.0 - 4.0 * poisson_ratio
    arm = x - sources[:, None]
    squared = np.square(arm.real) + np.square(arm.imag)
    log = (-0.5 * kappa) * np.log(squared / log_length**2)
    turned = arm / squared
    result = np.stack([log + arm.real * turned, 1j * log + arm.imag * turned], axis=1)
    return result.reshape(2 * sources.size, x.size).view(float)
