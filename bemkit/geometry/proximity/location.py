"""Location of points relative to a body, with their nearest boundary points, by a tree of the elements."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh, unchecked_mesh
from bemkit.geometry.pieces import RESOLUTION
from bemkit.geometry.proximity.cluster_tree import Clusters, ClusterTree, children, consecutive

LEAF_SIZE = 20
"""Elements of a leaf."""
_CHUNK = 8192
"""Points that are located at a time."""
N_CHORDS = 8
"""Chords that replace a curved element in the search for the nearest element."""
_BULGE = 2.0
"""Largest distance of an arc from its chord, relative to the distance of its midpoint."""
N_REFINEMENTS = 20
"""Largest number of Newton steps."""
_ROUND_OFF = 4.0 * np.finfo(float).eps
"""Largest step of a local coordinate that is round-off, relative to one and to the largest coordinate in lengths of
the tangent."""
_PLANE = np.array([1.0, 1.0j])


class PointNotInsideError(GeometryError):
    """A point is outside of the body or on its boundary."""


@dataclass(frozen=True, eq=False)
class Location:
    """Positions of points relative to a body.

    Parameters
    ----------
    is_inside, is_on_boundary : (n,) bool arrays
    distance : (n,) array [m]
        From the boundary.
    element : (n,) int array
        The nearest element.
    xi : (n,) array
        Local coordinate of the nearest point of that element.
    """

    is_inside: BoolArray
    is_on_boundary: BoolArray
    distance: FloatArray
    element: IntArray
    xi: FloatArray


class Locator:
    """Locates points relative to a body."""

    def __init__(self, mesh: BoundaryMesh) -> None:
        self._mesh = mesh
        self._centre = complex(*mesh.centre)
        n_chords = np.where(mesh.is_straight, 1, N_CHORDS)
        self._owner: IntArray = np.repeat(np.arange(mesh.n_elements), n_chords)
        self._first: IntArray = np.cumsum(n_chords) - n_chords
        index = np.arange(self._owner.size) - self._first[self._owner]
        self._low: FloatArray = -1.0 + 2.0 * index / n_chords[self._owner]
        self._high: FloatArray = -1.0 + 2.0 * (index + 1) / n_chords[self._owner]
        self._start, middle, self._end = (
            self._points(self._owner, at) for at in (self._low, 0.5 * (self._low + self._high), self._high)
        )
        self._bulge = _BULGE * np.abs(middle - 0.5 * (self._start + self._end))
        self._largest_bulge = float(self._bulge.max())
        tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        # ends of the chords (rows) of each element (column); the last chord is repeated
        chord = self._first + np.minimum(np.arange(n_chords.max())[:, None], n_chords - 1)
        ends = np.concatenate([self._start[self._first][None], self._end[chord]])
        self._middle = 0.5 * (ends[0] + ends[-1])
        self._radius = np.abs(ends - self._middle).max(axis=0) + np.maximum.reduceat(self._bulge, self._first)
        self.clusters = Clusters.around(tree, ends[:, tree.order])

    @classmethod
    def of_pieces(cls, start: FloatArray, end: FloatArray) -> Locator:
        """Return the locator of a body on the left of straight pieces between points (n, 2) [m]."""
        pieces = np.arange(2 * len(start)).reshape(2, -1).T
        return cls(unchecked_mesh(np.concatenate([start, end]), pieces, {}))

    def _points(self, elements: IntArray, xi: FloatArray) -> ComplexArray:
        """Return points (n,) of elements (n,) at local coordinates (n,), relative to the centre."""
        return np.asarray(self._mesh.points(elements, xi[:, None])[:, 0] @ _PLANE - self._centre)

    def _tangents(self, elements: IntArray, xi: FloatArray) -> ComplexArray:
        """Return the derivatives (n,) there by the local coordinates."""
        return np.asarray(self._mesh.derivatives(elements, xi[:, None])[:, 0] @ _PLANE)

    def locate(self, points: FloatArray) -> Location:
        """Locate points (n, 2) [m]."""
        x = points[:, 0] + 1j * points[:, 1] - self._centre
        largest = max(float(np.abs(self._mesh.nodes).max()), float(np.abs(points).max(initial=0.0)))
        resolution = RESOLUTION * largest
        chunks = [self._chunk(x[first : first + _CHUNK], resolution) for first in range(0, max(1, x.size), _CHUNK)]
        is_left, distance, element, xi = (np.concatenate([chunk[i] for chunk in chunks]) for i in range(4))
        is_on_boundary = distance <= resolution
        return Location(is_left.astype(bool) & ~is_on_boundary, is_on_boundary, distance, element.astype(np.intp), xi)

    def depths(self, points: FloatArray) -> FloatArray:
        """Return the distances (n,) [m] of points (n, 2) inside the body from its boundary; zero outside."""
        location = self.locate(points)
        return np.where(location.is_inside, location.distance, 0.0)

    def _chunk(self, x: ComplexArray, resolution: float) -> tuple[BoolArray, FloatArray, IntArray, FloatArray]:
        """Return whether points are left of the boundary, their distance, nearest element and local coordinate."""
        point, element, xi, distance, across = self._candidates(x)
        nearest = _smallest(distance, point, x.size)
        # if two elements meet in the nearest point, the one more perpendicular to the line to x decides the side
        is_nearest = np.flatnonzero(distance <= nearest[point] + resolution)
        order = is_nearest[np.lexsort((-np.abs(across[is_nearest]), point[is_nearest]))]
        best = order[np.searchsorted(point[order], np.arange(x.size))]
        return across[best] > 0.0, nearest, element[best], xi[best]

    def _candidates(self, x: ComplexArray) -> tuple[IntArray, IntArray, FloatArray, FloatArray, FloatArray]:
        """Return points, elements that may be nearest, and for each pair the nearest point of the element.

        That point is given by its local coordinate, its distance, and the sine of the angle between the element and
        the line to the point x. The search descends the tree with an upper bound of the distance of each point.
        """
        tree, bound = self.clusters.tree, np.full(x.size, np.inf)
        point, cluster = np.arange(x.size), np.zeros(x.size, np.intp)
        for level in range(tree.n_levels, -1, -1):
            # the first node of each cluster improves the bound
            first = self._first[tree.order[tree.bounds[: -1 : 2**level]]]
            to_node = np.abs(x[point] - self._start[first[cluster]]) * (1.0 + 1e-9) + self._largest_bulge
            np.minimum(bound, _smallest(to_node, point, x.size), out=bound)
            # clusters whose disc is farther than the bound drop out
            discs = self.clusters.levels[level]
            near = np.flatnonzero(np.abs(x[point] - discs.centre[cluster]) - discs.radius[cluster] <= bound[point])
            point, cluster = point[near], cluster[near]
            if level > 0:
                point, cluster = children(point, cluster)
        point, element = tree.members(point, cluster)
        # elements whose disc is farther than the start of another one drop out
        farthest = _smallest(np.abs(x[point] - self._start[self._first[element]]), point, x.size)
        to_disc = np.abs(x[point] - self._middle[element]) - self._radius[element]
        near = np.flatnonzero(to_disc <= farthest[point] * (1.0 + 1e-9))
        point, element = point[near], element[near]
        # nearest points of all chords; chords that cannot be nearest drop out
        counts = np.diff(np.append(self._first, self._owner.size))[element]
        point, chord = np.repeat(point, counts), consecutive(self._first[element], counts)
        xi, distance = self._on_chords(x[point], chord)
        farthest = _smallest(distance + self._bulge[chord], point, x.size)
        near = np.flatnonzero(distance - self._bulge[chord] <= farthest[point] * (1.0 + 1e-9))
        point, element, xi, distance = point[near], self._owner[chord[near]], xi[near], distance[near]
        # nearest points of curved elements by Newton's method
        start, end = self._start[chord[near]], self._end[chord[near]]
        tangent, way = end - start, x[point] - np.where(xi < 0.0, start, end)
        curved = np.flatnonzero(~self._mesh.is_straight[element])
        if curved.size:
            xi[curved], way[curved], tangent[curved] = self._refine(x[point[curved]], element[curved], xi[curved])
            distance[curved] = np.abs(way[curved])
        across = (way * tangent.conj()).imag / (np.abs(tangent) * np.maximum(distance, np.finfo(float).tiny))
        return point, element, xi, distance, across

    def _on_chords(self, x: ComplexArray, chord: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return the local coordinates of the nearest points of chords, and their distances."""
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
        """Find the nearest points of curved elements by Newton's method, with a constant second derivative.

        Return their local coordinates, the vectors from there to the points x, and the tangents.
        """
        bend = 0.5 * (self._tangents(element, np.ones(xi.size)) - self._tangents(element, -np.ones(xi.size)))
        largest = float(np.abs(self._mesh.nodes).max())
        xi, moves = xi.copy(), np.arange(xi.size)
        for _ in range(N_REFINEMENTS):
            before, slope = xi[moves], self._tangents(element[moves], xi[moves])
            way, square = x[moves] - self._points(element[moves], before), np.abs(slope) ** 2
            step = (way * slope.conj()).real / np.maximum(square - (way * bend[moves].conj()).real, 0.5 * square)
            xi[moves] = np.clip(before + step, -1.0, 1.0)
            moves = moves[np.abs(xi[moves] - before) > _ROUND_OFF * (1.0 + largest / np.sqrt(square))]
            if not moves.size:
                break
        return xi, x - self._points(element, xi), self._tangents(element, xi)


def _smallest(values: FloatArray, point: IntArray, n_points: int) -> FloatArray:
    """Return the smallest value of each point; points are ascending and complete."""
    return np.minimum.reduceat(values, np.searchsorted(point, np.arange(n_points))) if n_points else values
