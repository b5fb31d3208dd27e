"""Lengths whose squares are still numbers."""

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.errors import GeometryError

SMALLEST, LARGEST = 1e-140, 1e140
"""With their squares, and those times a few powers of ten, these lie within the range of numbers, 1e-308 to 1e308."""


def check_magnitude(points: FloatArray, owner: str) -> None:
    """Raise unless (n, 2) points are neither so far out nor so close together that areas overflow or vanish."""
    farthest, size = float(np.abs(points).max()), float(np.ptp(points, axis=0).max())
    if not (farthest <= LARGEST and size >= SMALLEST):
        raise GeometryError(
            f"{owner}: the boundary measures {size:.3g} and its coordinates reach {farthest:.3g}, the squares of which "
            f"are no numbers any more: choose a unit of length in which both lie between {SMALLEST:g} and {LARGEST:g}"
        )
