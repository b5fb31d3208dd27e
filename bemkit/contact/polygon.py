"""Polygons as obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import check_pair, unit_vectors
from bemkit.errors import InputError
from bemkit.geometry.vectors import enclosed_area, turned_left, winding_numbers

_ROUND_OFF = 1e-12
"""Largest distance from a corner, relative to the coordinates, that may be round-off."""


@dataclass(frozen=True)
class RigidPolygon:
    """The obstacle fills a polygon; the body is outside of it.

    Parameters
    ----------
    vertices : sequence of (x, y) [m]
        In order around the polygon, in either sense; sides must not cross.

    Raises
    ------
    ValueError
        If there are fewer than three vertices, two neighbours coincide, or a coordinate is not finite.

    Notes
    -----
    If the nearest point is a corner, contact acts along the line to the corner. A point inside is pushed out through
    the nearest side, the first one of several at the same distance.
    """

    vertices: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.vertices) < 3:
            raise InputError(f"vertices has {len(self.vertices)} points: give at least three")
        for index, vertex in enumerate(self.vertices):
            check_pair(f"vertices[{index}]", vertex)
            if tuple(vertex) == tuple(self.vertices[index - 1]):
                raise InputError(f"vertices[{index}] is {vertex}, as is the one before it: remove one of them")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the distance from the nearest side or corner; see `Obstacle.gap`."""
        towards, _, _ = self._nearest(points)
        distance = np.hypot(*towards.T)
        return np.asarray(np.where(self._holds(points), -distance, distance))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction to the nearest point, reversed for points inside the polygon."""
        towards, inward, is_beside = self._nearest(points)
        away = np.where(self._holds(points)[:, None], -towards, towards)
        # the vector of a point on the polygon is round-off: use the normal of the side, or of the body at a corner
        direction = np.where(is_beside[:, None], inward, unit_vectors(away, normals))
        return np.where(self._is_at_corner(points)[:, None], normals, direction)

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """Return start (n_sides, 2) and vector to the end (n_sides, 2) of each side, anticlockwise."""
        start = np.array(self.vertices, dtype=float)
        if enclosed_area(start) < 0.0:
            start = start[::-1]
        return start, np.roll(start, -1, axis=0) - start

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return vectors to the nearest points, inward normals there, and whether no corner is nearest."""
        start, along = self._sides()
        offset = start - points[:, None, :]
        share = np.clip(-np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
        to_side = offset + share[:, :, None] * along
        distance, is_beside = np.hypot(*np.moveaxis(to_side, -1, 0)), (share > 0.0) & (share < 1.0)
        # the first of several sides at the same distance, up to round-off
        is_as_near = distance <= distance.min(axis=1, keepdims=True) + self._round_off(points)
        rows, nearest = np.arange(len(points)), np.argmin(np.where(is_as_near & is_beside, -1.0, distance), axis=1)
        unit = along[nearest] / np.hypot(*along[nearest].T)[:, None]
        return to_side[rows, nearest], turned_left(unit), is_beside[rows, nearest]

    def _is_at_corner(self, points: FloatArray) -> BoolArray:
        """Return a mask (n,) of points so near to a corner that round-off decides which of its sides is nearest."""
        corners = np.array(self.vertices, dtype=float)
        distance = np.hypot(*np.moveaxis(corners - points[:, None], -1, 0))
        return np.asarray(distance.min(axis=1) <= self._round_off(points))

    def _round_off(self, points: FloatArray) -> float:
        return _ROUND_OFF * float(np.abs(np.concatenate([np.array(self.vertices, dtype=float), points])).max())

    def _holds(self, points: FloatArray) -> BoolArray:
        """Return a mask (n,) of points inside."""
        start, _ = self._sides()
        return np.asarray(winding_numbers(points, start, np.roll(start, -1, axis=0)) != 0)
