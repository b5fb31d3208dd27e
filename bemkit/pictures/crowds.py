"""Which points of a crowd are drawn: more than can be seen apart would only hide each other."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray, IntArray

MANY = 300
"""Nodes of a contact that are seen one by one at most."""
_ACROSS = 80
"""Points of a crowd across a picture."""


def seen_apart(points: FloatArray, sizes: FloatArray, distance: float) -> IntArray:
    """Return of points (n, 2) that are closer to each other than a distance the one of the largest size (n,)."""
    largest = np.argsort(-sizes, kind="stable")
    _, first = np.unique(np.round(points[largest] / distance), axis=0, return_index=True)
    return np.sort(largest[first])


def marked(points: FloatArray, sizes: FloatArray, width: float) -> IntArray:
    """Return which of points (n, 2) are marked in a picture of a width: all if they are few, see `seen_apart`."""
    if len(points) <= MANY or width == 0.0:
        return np.arange(len(points))
    return seen_apart(points, sizes, width / _ACROSS)
