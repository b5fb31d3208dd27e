"""Overlap of two plane bodies: the deepest point of a boundary inside an outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.pieces import overlapping_boxes, point_distances
from bemkit.geometry.vectors import norms, winding_numbers

ROUND_OFF = 1e-6
"""Depth that may be round-off of curves, relative to the size of the smaller body."""
_PIECES = 8
"""Straight pieces of the polyline along an element."""
_SHIFT = np.array([3.7e-9, 7.3e-9])
"""Shift of points before rays are followed from them, relative to the size of a body."""
_MOST_POINTS = 4000
"""Largest number of points of a boundary that are compared with an outline; others are skipped."""
_ENTRIES = 1_000_000
"""Pairs of points and pieces that are compared at once."""


@dataclass(frozen=True, eq=False)
class Polyline:
    """Polyline along the boundary of a body, also of its mirror images.

    Parameters
    ----------
    points : (n_elements, q, 2) array [m]
        On each element from its start to its end.
    elements : (n_elements,) int array
        Of the mesh; images have those of the body itself.
    tolerance : float [m]
        Largest distance of the polyline from the curves.
    is_exterior : bool
        Whether the body lies outside of its loops.
    """

    points: FloatArray
    elements: IntArray
    tolerance: float
    is_exterior: bool

    @classmethod
    def of(cls, mesh: BoundaryMesh, displacement: FloatArray | None = None) -> Polyline:
        """Return the polyline of a mesh that is not a half-plane, displaced by (n_elements, q, 2) [m] at `places`."""
        elements, xi = np.arange(mesh.n_elements), cls.places()
        points = mesh.points(elements, xi)
        middles = mesh.points(elements, 0.5 * (xi[:-1] + xi[1:]))
        off = float(norms((middles - 0.5 * (points[:, :-1] + points[:, 1:])).reshape(-1, 2)).max())
        points = points + (0.0 if displacement is None else displacement)
        # loops are closed: fields of constant elements jump from one to the next
        ends = np.zeros((mesh.n_nodes, 2))
        np.add.at(ends, mesh.elements, points[:, [0, -1]])
        points[:, [0, -1]] = (ends / np.bincount(mesh.elements.ravel())[:, None])[mesh.elements]
        return cls(points, elements, off, mesh.is_exterior).with_images(mesh)

    @staticmethod
    def places() -> FloatArray:
        """Return the local coordinates (q,) of the points on each element."""
        return np.linspace(-1.0, 1.0, _PIECES + 1)

    def with_images(self, mesh: BoundaryMesh) -> Polyline:
        """Return the polyline of the whole body."""
        if mesh.symmetry is None:
            return self
        images = mesh.symmetry.images
        points = np.concatenate([mesh.symmetry.reflected(self.points, image) for image in images])
        return replace(self, points=points, elements=np.tile(self.elements, len(images)))

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """The corners (2,) of the box around the body."""
        if self.is_exterior:
            return np.full(2, -np.inf), np.full(2, np.inf)
        return self.points.min(axis=(0, 1)), self.points.max(axis=(0, 1))

    @cached_property
    def pieces(self) -> tuple[FloatArray, FloatArray]:
        """Start (m, 2) and end (m, 2) of each straight piece."""
        return self.points[:, :-1].reshape(-1, 2), self.points[:, 1:].reshape(-1, 2)

    def deepest(self, points: FloatArray, least: float) -> tuple[float, int]:
        """Return the largest depth [m] of points (n, 2) inside the body, and the index of that point.

        Zero and -1 if no point is deeper than `least`.

        Notes
        -----
        The depth is the distance to the nearest piece; that to the pieces at the nearest vertex is a bound.
        """
        low, high = self.box
        rows = np.flatnonzero(((points > low) & (points < high)).all(axis=1))
        rows = rows[:: 1 + rows.size // _MOST_POINTS]
        bound = self._distance_bounds(points[rows])
        rows = rows[bound > least]
        n_rows = max(_ENTRIES // len(self.pieces[0]), 1)
        depth, deepest = 0.0, -1
        for k in range(0, rows.size, n_rows):
            some = rows[k : k + n_rows]
            inside = some[self._holds(points[some]) != self.is_exterior]
            if inside.size:
                distances = point_distances(points[inside, None], *self.pieces).min(axis=1)
                largest = int(np.argmax(distances))
                if distances[largest] > max(depth, least):
                    depth, deepest = float(distances[largest]), int(inside[largest])
        return depth, deepest

    @cached_property
    def _trees(self) -> tuple[cKDTree, cKDTree]:
        """The starts and the ends of all pieces."""
        return cKDTree(self.pieces[0]), cKDTree(self.pieces[1])

    def _distance_bounds(self, points: FloatArray) -> FloatArray:
        """Return distances (n,) from the pieces that begin and end next to points (n, 2)."""
        start, end = self.pieces
        beside = [tree.query(points)[1] for tree in self._trees]
        return np.asarray(np.min([point_distances(points, start[k], end[k]) for k in beside], axis=0))

    def _holds(self, points: FloatArray) -> BoolArray:
        """Return (n,) bool: whether loops go around points (n, 2)."""
        # off the lines through nodes, whose coordinates differ by round-off from one image to the next
        shifted = points + _SHIFT * np.ptp(self.points, axis=(0, 1)).max()
        return np.asarray(winding_numbers(shifted, *self.pieces) != 0)


def near_pairs(outlines: Sequence[Polyline]) -> list[tuple[int, int]]:
    """Return the pairs of bodies that may overlap."""
    if not outlines:
        return []
    boxes = [each.box for each in outlines]
    low, high = (np.array(corners) for corners in zip(*boxes, strict=True))
    first, second = overlapping_boxes(low, high)
    return list(zip(first.tolist(), second.tolist(), strict=True))


def deepest_overlap(
    one: Polyline, two: Polyline, least: float, beside: Sequence[BoolArray] | None = None
) -> tuple[float, FloatArray]:
    """Return the largest depth [m] of points of one body inside another, and the deepest point (2,).

    Zero if no point is deeper than `least`.

    Parameters
    ----------
    one, two : Polyline
    least : float [m]
    beside : two (n_elements,) bool arrays, optional
        Elements of each polyline whose points count; all by default.
    """
    depth, place = 0.0, np.full(2, np.nan)
    for k, (own, other) in enumerate(((one, two), (two, one))):
        points = (own.points if beside is None else own.points[beside[k]]).reshape(-1, 2)
        found, deepest = other.deepest(points, least)
        if found > depth:
            depth, place = found, points[deepest]
    return depth, place
