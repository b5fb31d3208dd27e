"""Polygons as obstacles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import check_pair, unit_vectors
from bemkit.errors import InputError
from bemkit.geometry.vectors import turned_left

_ROUND_OFF = 1e-12
"""Distance from a corner, relative to the coordinates, that may be their round-off."""


@dataclass(frozen=True)
class RigidPolygon:
    """The obstacle fills a polygon; the body lies outside it.

    Parameters
    ----------
    vertices : sequence of (x, y) [m]
        In order around the polygon, either way, without crossing itself.

    Raises
    ------
    ValueError
        If there are fewer than three vertices, two neighbours coincide, or a coordinate is not finite.

    Notes
    -----
    At a corner that a point is nearest to, contact acts along the line from the point to the corner; a point inside is
    pushed out through the nearest side, the first one of several that are equally near.
    """

    vertices: tuple[tuple[float, float], ...]

    def __post_init__(self) -> None:
        if len(self.vertices) < 3:
            raise InputError(f"vertices has {len(self.vertices)} points: give at least three")
        for number, vertex in enumerate(self.vertices):
            check_pair(f"vertices[{number}]", vertex)
            if tuple(vertex) == tuple(self.vertices[number - 1]):
                raise InputError(f"vertices[{number}] is {vertex}, as is the one before it: remove one of them")

    def gap(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Measure the distance from the nearest side or corner; see `Obstacle.gap`."""
        towards, _, _ = self._nearest(points)
        distance = np.hypot(*towards.T)
        return np.asarray(np.where(self._holds(points), -distance, distance))

    def approach(self, points: FloatArray, normals: FloatArray) -> FloatArray:
        """Return the direction to the nearest point, out of it where the polygon holds the point."""
        towards, inward, is_beside = self._nearest(points)
        away = np.where(self._holds(points)[:, None], -towards, towards)
        # for a point on the polygon the vector is round-off: take the normal of the side, at a corner that of the body
        direction = np.where(is_beside[:, None], inward, unit_vectors(away, normals))
        return np.where(self._is_at_corner(points)[:, None], normals, direction)

    def _sides(self) -> tuple[FloatArray, FloatArray]:
        """Return start (n_sides, 2) and vector to the end (n_sides, 2) of each side, anticlockwise."""
        start = np.array(self.vertices, dtype=float)
        x, y = (start - start[0]).T
        if np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0.0:
            start = start[::-1]
        return start, np.roll(start, -1, axis=0) - start

    def _nearest(self, points: FloatArray) -> tuple[FloatArray, FloatArray, BoolArray]:
        """Return vectors (n, 2) to the nearest points, inward normals (n, 2) there, and (n,) bool: no corners."""
        start, along = self._sides()
        offset = start - points[:, None, :]
        share = np.clip(-np.sum(offset * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
        to_side = offset + share[:, :, None] * along
        distance, is_beside = np.hypot(*np.moveaxis(to_side, -1, 0)), (share > 0.0) & (share < 1.0)
        # of sides that are equally near, but for round-off, take the first
        is_as_near = distance <= distance.min(axis=1, keepdims=True) + self._round_off(points)
        rows, nearest = np.arange(len(points)), np.argmin(np.where(is_as_near & is_beside, -1.0, distance), axis=1)
        unit = along[nearest] / np.hypot(*along[nearest].T)[:, None]
        return to_side[rows, nearest], turned_left(unit), is_beside[rows, nearest]

    def _is_at_corner(self, points: FloatArray) -> BoolArray:
        """Return (n,) bool: points so near to a corner that round-off decides which of its sides is nearest."""
        corners = np.array(self.vertices, dtype=float)
        distance = np.hypot(*np.moveaxis(corners - points[:, None], -1, 0))
        return np.asarray(distance.min(axis=1) <= self._round_off(points))

    def _round_off(self, points: FloatArray) -> float:
        return _ROUND_OFF * float(np.abs(np.concatenate([np.array(self.vertices, dtype=float), points])).max())

    def _holds(self, points: FloatArray) -> BoolArray:
        """Return (n,) bool: points inside, by the number of sides that a ray to the right crosses."""
        start, along = self._sides()
        x, y = points[:, :1], points[:, 1:]
        end = np.roll(start, -1, axis=0)  # to the last digit the start of the next side
        spans = (start[:, 1] > y) != (end[:, 1] > y)
        rise = np.where(along[:, 1] == 0.0, 1.0, along[:, 1])
        crossings = spans & (x < start[:, 0] + along[:, 0] * (y - start[:, 1]) / rise)
        return np.asarray(crossings.sum(axis=1) % 2 == 1)
