"""How far enlarged displacements draw elastic bodies into each other, which sliding along curved sides brings about."""

from __future__ import annotations

from itertools import permutations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.pictures.shown import Shown, ShownBody


def drawn_overlap(shown: Shown, factor: float) -> float:
    """Return how much deeper [m] bodies reach into each other as they are drawn than where they stand.

    Parameters
    ----------
    shown : Shown
    factor : float
        By which displacements are enlarged.
    """
    bodies = [body for body in shown.bodies if body.mesh.surface is None]
    if len(bodies) < 2:
        return 0.0
    moved, initial = ([body.outlines(by) for body in bodies] for by in (factor, 0.0))
    boxes = np.array([[points.min(axis=0), points.max(axis=0)] for points in map(np.concatenate, moved)])
    deepest = 0.0
    for first, second in _near(boxes):
        for one, other in permutations((first, second)):
            now = _depth(np.concatenate(moved[one]), bodies[other], moved[other])
            if now.max() > deepest:
                before = _depth(np.concatenate(initial[one]), bodies[other], initial[other])
                deepest = max(deepest, float((now - before).max()))
    return deepest


def _near(boxes: FloatArray) -> list[tuple[int, int]]:
    """Return the pairs of boxes (n, 2, 2), least and largest coordinates, that meet."""
    low, high = boxes[:, 0], boxes[:, 1]
    meet = np.all((low[:, None] <= high) & (low <= high[:, None]), axis=2)
    return [(int(i), int(j)) for i, j in np.argwhere(np.triu(meet, 1))]


def _depth(points: FloatArray, body: ShownBody, loops: list[FloatArray]) -> FloatArray:
    """Return how deep (n,) [m] points (n, 2) are inside a body with these loops, zero outside."""
    depth = np.zeros(len(points))
    inside = np.flatnonzero(_is_inside(points, body, loops))
    starts = np.concatenate([loop[:-1] for loop in loops])
    ways = np.concatenate([np.diff(loop, axis=0) for loop in loops])
    for k in inside:  # few, if any
        share = np.sum((points[k] - starts) * ways, axis=1) / np.maximum(np.sum(ways**2, axis=1), np.finfo(float).tiny)
        nearest = starts + np.clip(share, 0.0, 1.0)[:, None] * ways
        depth[k] = np.hypot(*(points[k] - nearest).T).min()
    return depth


def _is_inside(points: FloatArray, body: ShownBody, loops: list[FloatArray]) -> BoolArray:
    from matplotlib.path import Path

    is_inside = np.full(len(points), body.mesh.is_exterior)
    for loop in loops:
        is_inside ^= Path(loop).contains_points(points)
    return is_inside
