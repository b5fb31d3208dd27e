"""Selection of the points to draw: those too close to each other would hide each other."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray

MANY = 300
"""Largest number of nodes of a contact that are drawn one by one."""
_ACROSS = 80
"""Points of a crowd across a picture."""


def seen_apart(points: FloatArray, sizes: FloatArray, distance: float) -> IntArray:
    """Return the indices of points (n, 2), of those closer than a distance only the one of largest size (n,)."""
    largest = np.argsort(-sizes, kind="stable")
    _, first = np.unique(np.round(points[largest] / distance), axis=0, return_index=True)
    return np.sort(largest[first])


def marked(points: FloatArray, sizes: FloatArray, width: float) -> IntArray:
    """Return which of points (n, 2) are marked in a picture of a width: all if they are few, see `seen_apart`."""
    if len(points) <= MANY or width == 0.0:
        return np.arange(len(points))
    return seen_apart(points, sizes, width / _ACROSS)
