"""Points inside a body: found with the boundary point nearest to each, which a tree of the elements is searched for."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.pieces import RESOLUTION
from bemkit.operators.hierarchy.tree import Clusters, ClusterTree, consecutive
from bemkit.operators.somigliana.moments import ArcQuadrature

LEAF_SIZE = 20
"""Elements of a leaf."""
_CHUNK = 8192
"""Points that are looked for at a time."""
N_CHORDS = 8
"""Chords in place of a curved element while the nearest element is looked for."""
_BULGE = 2.0
"""Distance of an arc from its chord, by that of its middle, at most."""
N_REFINEMENTS = 20
_STANDS = 4.0 * np.finfo(float).eps
"""Step of a local coordinate that is round-off."""


class PointNotInsideError(GeometryError):
    """A point at which fields were asked for is outside of the body or on its boundary."""


@dataclass(frozen=True, eq=False)
class Location:
    """Positions of points relative to a body.

    Parameters
    ----------
    is_inside, is_on_boundary : (n,) bool arrays
    element : (n,) int array
        The nearest element.
    xi : (n,) array
        Local coordinate of the point of that element that is nearest.
    """

    is_inside: BoolArray
    is_on_boundary: BoolArray
    element: IntArray
    xi: FloatArray


class Locator:
    """Locates points with respect to a body.

    Parameters
    ----------
    mesh : BoundaryMesh
    """

    def __init__(self, mesh: BoundaryMesh) -> None:
        self._mesh = mesh
        self.curved = ArcQuadrature(mesh, mesh.centre)
        self._centre = complex(*mesh.centre)
        n_chords = np.where(mesh.is_straight, 1, N_CHORDS)
        self._owner: IntArray = np.repeat(np.arange(mesh.n_elements), n_chords)
        self._first: IntArray = np.cumsum(n_chords) - n_chords
        number = np.arange(self._owner.size) - self._first[self._owner]
        self._low: FloatArray = -1.0 + 2.0 * number / n_chords[self._owner]
        self._high: FloatArray = -1.0 + 2.0 * (number + 1) / n_chords[self._owner]
        self._start, middle, self._end = (
            self._on_elements(at) for at in (self._low, 0.5 * (self._low + self._high), self._high)
        )
        self._bulge = _BULGE * np.abs(middle - 0.5 * (self._start + self._end))
        tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        # one column for each element, its chords in rows, the last one repeated
        chord = self._first + np.minimum(np.arange(n_chords.max())[:, None], n_chords - 1)
        ends = np.concatenate([self._start[self._first][None], self._end[chord]])[:, tree.order]
        self._node = ends[0]
        self.clusters = Clusters.around(tree, ends)
        self._boxes = [_boxes(self.clusters, ends, level) for level in range(tree.n_levels + 1)]
        self._largest_bulge = float(self._bulge.max())

    def _on_elements(self, xi: FloatArray) -> ComplexArray:
        start, end = (
            (ends[:, 0] + 1j * ends[:, 1] - self._centre)[self._owner] for ends in (self._mesh.start, self._mesh.end)
        )
        points: ComplexArray = (0.5 - 0.5 * xi) * start + (0.5 + 0.5 * xi) * end
        curved = np.flatnonzero(~self._mesh.is_straight[self._owner])
        points[curved] = self.curved.place(self._owner[curved], xi[curved, None])[0][:, 0]
        return points

    def locate(self, points: FloatArray) -> Location:
        """Find where the (n, 2) points [m] are."""
        x = points[:, 0] + 1j * points[:, 1] - self._centre
        size = max(float(np.abs(self._mesh.nodes).max()), float(np.abs(points).max(initial=0.0)))
        resolution = RESOLUTION * size
        chunks = [self._chunk(x[first : first + _CHUNK], resolution) for first in range(0, max(1, x.size), _CHUNK)]
        is_left, distance, element, xi = (np.concatenate([chunk[i] for chunk in chunks]) for i in range(4))
        is_on_boundary = distance <= resolution
        return Location(is_left.astype(bool) & ~is_on_boundary, is_on_boundary, element.astype(np.intp), xi)

    def _chunk(self, x: ComplexArray, resolution: float) -> tuple[BoolArray, FloatArray, IntArray, FloatArray]:
        """Return whether points are left of the boundary, their distance from it, nearest element and place there."""
        point, element, xi, distance, across = self._candidates(x)
        nearest = _smallest(distance, point, x.size)
        # of two elements that meet in the nearest point, the one more across the way there knows the side
        is_nearest = np.flatnonzero(distance <= nearest[point] + resolution)
        order = is_nearest[np.lexsort((-np.abs(across[is_nearest]), point[is_nearest]))]
        best = order[np.searchsorted(point[order], np.arange(x.size))]
        return across[best] > 0.0, nearest, element[best], xi[best]

    def _candidates(self, x: ComplexArray) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
        """Return points, elements that may be the nearest, local coordinates and distances of the nearest points there.

        And the sine of the angle from the element to the way from there to the point.
        """
        reach = np.full(x.size, np.inf)

        def is_far(level: int, point: IntArray, cluster: IntArray) -> BoolArray:
            places = self.clusters.tree.bounds[: -1 : 2**level]
            to_node = np.abs(x[point] - self._node[places[cluster]]) * (1.0 + 1e-9) + self._largest_bulge
            np.minimum(reach, _smallest(to_node, point, x.size), out=reach)
            (along, half), centre = self._boxes[level], self.clusters.levels[level].centre
            way = (x[point] - centre[cluster]) * along[cluster].conj()
            beside, across = np.abs(way.real) - half.real[cluster], np.abs(way.imag) - half.imag[cluster]
            return np.asarray(np.hypot(np.maximum(beside, 0.0), np.maximum(across, 0.0)) > reach[point])

        _, (point, element) = self.clusters.divided(x.size, is_far)
        counts = np.diff(np.append(self._first, self._owner.size))[element]
        point, chord = np.repeat(point, counts), consecutive(self._first[element], counts)
        xi, distance = self._on_chords(x[point], chord)
        farthest = _smallest(distance + self._bulge[chord], point, x.size)
        near = np.flatnonzero(distance - self._bulge[chord] <= farthest[point] * (1.0 + 1e-9))
        point, element, xi, distance = point[near], self._owner[chord[near]], xi[near], distance[near]
        start, end = self._start[chord[near]], self._end[chord[near]]
        tangent, way = end - start, x[point] - np.where(xi < 0.0, start, end)
        curved = np.flatnonzero(~self._mesh.is_straight[element])
        if curved.size:
            xi[curved], way[curved], tangent[curved] = self._refine(x[point[curved]], element[curved], xi[curved])
            distance[curved] = np.abs(way[curved])
        across = (way * tangent.conj()).imag / (np.abs(tangent) * np.maximum(distance, np.finfo(float).tiny))
        return point, element, xi, distance, across

    def _on_chords(self, x: ComplexArray, chord: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the local coordinates of the points of chords that are nearest to points, and their distances."""
        start, end = self._start[chord], self._end[chord]
        way, to_start, to_end = end - start, start - x, end - x
        fraction = np.clip(-(to_start * way.conj()).real / np.abs(way) ** 2, 0.0, 1.0)
        across = np.abs((to_start * way.conj()).imag) / np.abs(way)
        to_ends = np.minimum(np.abs(to_start), np.abs(to_end))
        distance = np.where((fraction > 0.0) & (fraction < 1.0), across, to_ends)
        return self._low[chord] + fraction * (self._high - self._low)[chord], distance

    def _refine(
        self, x: ComplexArray, element: IntArray, xi: FloatArray
    ) -> tuple[FloatArray, ComplexArray, ComplexArray]:
        """Move to the nearest point of a curved element by Newton's steps, with one second derivative for the element.

        Return its local coordinate, the way from there to the point, and the tangent there.
        """
        _, ends = self.curved.place(element, np.tile([-1.0, 1.0], (element.size, 1)))
        bend = 0.5 * (ends[:, 1] - ends[:, 0])
        for _ in range(N_REFINEMENTS):
            y, slope = self.curved.place(element, xi[:, None])
            way, square = x - y[:, 0], np.abs(slope[:, 0]) ** 2
            step = (way * slope[:, 0].conj()).real / np.maximum(square - (way * bend.conj()).real, 0.5 * square)
            before, xi = xi, np.clip(xi + step, -1.0, 1.0)
            if np.abs(xi - before).max() <= _STANDS:
                break
        y, slope = self.curved.place(element, xi[:, None])
        return xi, x - y[:, 0], slope[:, 0]


def _smallest(values: FloatArray, point: IntArray, n_points: int) -> FloatArray:
    """Return the smallest of the values of each point; points ascend, and each of them is there."""
    return np.minimum.reduceat(values, np.searchsorted(point, np.arange(n_points))) if n_points else values


def _boxes(clusters: Clusters, points: ComplexArray, level: int) -> tuple[ComplexArray, ComplexArray]:
    """Return the axes of boxes around the centres of the clusters of a level, and half their lengths and widths.

    The axis is that of the second moment of the points (k, n): boxes along a side are thin, in any direction.
    """
    tree, centre = clusters.tree, clusters.levels[level].centre
    begins = tree.bounds[: -1 : 2**level]
    cluster = np.repeat(np.arange(begins.size), np.diff(np.append(begins, points.shape[1])))
    arms = points - centre[cluster]
    moment = np.add.reduceat(np.sum(arms * arms, axis=0), begins)
    along = np.exp(0.5j * np.angle(moment))
    arms *= along[cluster].conj()
    half = [np.maximum.reduceat(np.abs(part).max(axis=0), begins) for part in (arms.real, arms.imag)]
    return along, half[0] + 1j * half[1]
