"""Conformance of rigid obstacles."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import DirectedObstacle, Obstacle
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.testing.failure import class_name, demand, evaluated

_STEP = 1e-5
"""Length of steps, relative to the size of the boundary: the curvature of a surface changes gaps by their squares."""
_SLOPE = 1e-3
"""Error of slopes from differences of gaps: curvature radii down to a hundredth of the size of the boundary."""


def check_obstacle(obstacle: Obstacle, mesh: BoundaryMesh, *, is_everywhere: bool = True) -> None:
    """Check everything that `Obstacle` promises, and `DirectedObstacle` of one with a method ``approach``.

    Parameters
    ----------
    obstacle : Obstacle
    mesh : BoundaryMesh
        Of a body that may touch it.
    is_everywhere : bool
        Whether the gap is a distance at all points near the boundary, not only on the boundary: then it falls by the
        length of a step towards the obstacle, and a small step across that direction does not change it.

    Raises
    ------
    CheckFailed
        Naming the obstacle, the promise broken, where, and by how much.
    """
    name = class_name(obstacle)
    for member in ("gap", "approach") if hasattr(obstacle, "approach") else ("gap",):
        demand(callable(getattr(obstacle, member, None)), f"{name} has no method {member}(points, normals)")
    random = np.random.default_rng(0)
    elements = random.integers(0, mesh.n_elements, 40)
    xi = random.uniform(-1.0, 1.0, (40, 1))
    points, normals = mesh.points(elements, xi)[:, 0], mesh.normals_at(elements, xi)[:, 0]
    gap = _evaluated(obstacle, "gap", points, normals)
    direction = normals
    if isinstance(obstacle, DirectedObstacle):
        direction = _evaluated(obstacle, "approach", points, normals)
        excess = np.abs(np.hypot(*direction.T) - 1.0)
        worst = int(np.argmax(excess))
        demand(
            excess[worst] <= 1e-12,  # round-off
            f"{name}.approach at {_shown(points[worst])} is no unit vector: its length is off by {excess[worst]:.3g}",
        )
    if is_everywhere:
        _check_slopes(obstacle, points, normals, gap, direction, _STEP * mesh.diameter)


def _evaluated(obstacle: Obstacle, member: str, points: FloatArray, normals: FloatArray) -> FloatArray:
    """Return gaps, infinite ones as zero after their check, or directions."""
    label = f"{type(obstacle).__name__}.{member}"
    before = normals.copy()

    def finite(places: FloatArray) -> FloatArray:
        values = np.asarray(getattr(obstacle, member)(places, normals[: len(places)]))
        return np.where(np.isposinf(values), 0.0, values) if member == "gap" else values

    shape = (len(points),) if member == "gap" else points.shape
    values = evaluated(label, finite, points, shape)
    demand(np.array_equal(normals, before), f"{label} changes its argument normals")
    method = getattr(obstacle, member)
    every = np.asarray(method(points, normals))
    half = np.asarray(method(points[::2], normals[::2]))
    is_finite = np.isfinite(half)
    same = np.array_equal(is_finite, np.isfinite(every[::2]))
    difference = float(np.abs(half[is_finite] - every[::2][is_finite]).max(initial=0.0)) if same else np.inf
    # nearest points that are found by differences and iterations have fewer digits
    size = float(np.abs(values).max(initial=0.0)) + float(np.abs(points).max())
    demand(difference <= 1e-7 * size, f"{label} at some points depends on the others: it differs by {difference:.3g}")
    return every


def _check_slopes(
    obstacle: Obstacle, points: FloatArray, normals: FloatArray, gap: FloatArray, direction: FloatArray, step: float
) -> None:
    """Check that the gap falls by a step along the direction of contact, and not across it."""
    name = type(obstacle).__name__
    is_finite = np.isfinite(gap)
    across = np.stack([-direction[:, 1], direction[:, 0]], axis=1)
    ways = [("towards the obstacle", direction, -1.0)]
    if isinstance(obstacle, DirectedObstacle):  # otherwise the direction is that of the body, not of a distance
        ways.append(("across the direction of contact", across, 0.0))
    for words, way, expected in ways:
        ahead, behind = (obstacle.gap(points + sign * step * way, normals) for sign in (1.0, -1.0))
        slope = np.where(is_finite, (ahead - behind) / (2.0 * step), expected)
        error = np.abs(slope - expected)
        worst = int(np.argmax(np.where(np.isfinite(error), error, -1.0)))
        demand(
            error[worst] <= _SLOPE,
            f"{name}.gap changes by {slope[worst]:.4g} times a step {words} at {_shown(points[worst])}, not by "
            f"{expected:g}: gap is the distance along approach, and approach points into the obstacle",
        )


def _shown(point: FloatArray) -> str:
    return f"({point[0]:.6g}, {point[1]:.6g})"
