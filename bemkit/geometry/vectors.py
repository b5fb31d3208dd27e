"""Plane vectors, stored as (..., 2) arrays."""

import numpy as np

from bemkit.arrays import FloatArray


def norms(vectors: FloatArray) -> FloatArray:
    """Return the Euclidean lengths (...), without overflow or underflow."""
    lengths: FloatArray = np.hypot(vectors[..., 0], vectors[..., 1])
    return lengths


def cross(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return first_x second_y - first_y second_x (...), positive if `second` lies to the left of `first`."""
    product: FloatArray = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    return product


def angles_between(first: FloatArray, second: FloatArray) -> FloatArray:
    """Return the signed angles (...) from `first` to `second`, anticlockwise positive [rad]."""
    angles: FloatArray = np.arctan2(cross(first, second), (first * second).sum(axis=-1))
    return angles


def turned_right(vectors: FloatArray) -> FloatArray:
    """Turn vectors clockwise by a right angle: tangents to outward normals."""
    return np.stack([vectors[..., 1], -vectors[..., 0]], axis=-1)
