"""Overlap of two plane bodies: the deepest point of a boundary inside an outline."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.pieces import overlapping_boxes
from bemkit.geometry.proximity.location import Locator
from bemkit.geometry.symmetry.lines import is_reversing
from bemkit.geometry.vectors import norms

ROUND_OFF = 1e-6
"""Depth that may be round-off of curves, relative to the size of the smaller body."""
_PIECES = 8
"""Straight pieces of the polyline along an element."""
_MOST_POINTS = 4000
"""Largest number of points of a boundary that are compared with an outline; others are skipped."""


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
        if mesh.symmetry is not None:
            images = [
                mesh.symmetry.reflected(points, image)[:, :: -1 if is_reversing(image) else 1]
                for image in mesh.symmetry.images
            ]
            points = np.concatenate(images)
        return cls(points, np.resize(elements, len(points)), off, mesh.is_exterior)

    @staticmethod
    def places() -> FloatArray:
        """Return the local coordinates (q,) of the points on each element."""
        return np.linspace(-1.0, 1.0, _PIECES + 1)

    @cached_property
    def box(self) -> tuple[FloatArray, FloatArray]:
        """The corners (2,) of the box around the body."""
        if self.is_exterior:
            return np.full(2, -np.inf), np.full(2, np.inf)
        return self.points.min(axis=(0, 1)), self.points.max(axis=(0, 1))

    @cached_property
    def _locator(self) -> Locator:
        return Locator.of_pieces(self.points[:, :-1].reshape(-1, 2), self.points[:, 1:].reshape(-1, 2))

    def deepest(self, points: FloatArray, least: float) -> tuple[float, int]:
        """Return the largest depth [m] of points (n, 2) inside the body, and the index of that point.

        Zero and -1 if no point is deeper than `least`.
        """
        low, high = self.box
        rows = np.flatnonzero(((points > low + least) & (points < high - least)).all(axis=1))
        if not rows.size:
            return 0.0, -1
        rows = rows[:: 1 + rows.size // _MOST_POINTS]
        depth = self._locator.depths(points[rows])
        deepest = int(np.argmax(depth))
        return (float(depth[deepest]), int(rows[deepest])) if depth[deepest] > least else (0.0, -1)


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
