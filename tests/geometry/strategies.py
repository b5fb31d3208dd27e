"""Random bodies: simple polygons of any size, place and direction."""

import numpy as np
from hypothesis import strategies as st

from bemkit.arrays import FloatArray

sizes = st.floats(-9.0, 9.0).map(lambda exponent: 10.0**exponent)
angles = st.floats(0.0, 2.0 * np.pi)


@st.composite
def star_polygons(draw: st.DrawFn) -> FloatArray:
    """Return the vertices (n, 2) of a polygon about the origin, of radius 1 at most, anticlockwise.

    Every vertex is seen from the origin under less than half a turn from the one before, so the polygon is simple.
    """
    n = draw(st.integers(3, 12))
    steps = np.array(draw(st.lists(st.floats(0.6, 1.0), min_size=n, max_size=n)))
    radii = np.array(draw(st.lists(st.floats(0.1, 1.0), min_size=n, max_size=n)))
    directions = draw(angles) + 2.0 * np.pi * np.cumsum(steps) / steps.sum()
    return radii[:, None] * np.column_stack([np.cos(directions), np.sin(directions)])


def polygon_area(vertices: FloatArray) -> float:
    """Return the signed area by the shoelace formula."""
    x, y = (vertices - vertices[0]).T
    return 0.5 * float(x @ np.roll(y, -1) - y @ np.roll(x, -1))


def rotation(angle: float) -> FloatArray:
    """Return the matrix R with points @ R.T turned anticlockwise by the angle."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])


def closed(n: int, offset: int = 0) -> FloatArray:
    """Return the elements of one loop through n nodes in order."""
    return offset + np.column_stack([np.arange(n), np.roll(np.arange(n), -1)])
