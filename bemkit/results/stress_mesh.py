"""Stress and displacement of a body at the corners of triangles that fill it, fitted to its boundary.

Close to constant, linear and quadratic elements the fields inside have peaks at the ends of elements, where boundary
data kink. Points inside therefore lie opposite the middle of elements, and no closer than about their length. The
stress on the boundary itself follows from tractions and from the strain along it; see `BoundaryStress`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.spatial import Delaunay, KDTree

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import at_arc_lengths, corner_nodes
from bemkit.geometry.vectors import cross, norms
from bemkit.operators.somigliana.potentials import PotentialFields
from bemkit.results.boundary_stress import BoundaryStress
from bemkit.results.side_stress import LargestStress
from bemkit.results.solved_body import SolvedBody
from bemkit.results.stress_measures import STRESSES

_STEP = 1.4
"""Distance of the first points inside from the boundary, in lengths of their elements. At half of it stresses beside
constant elements are wrong by 3 %, at this distance by 0.07 %."""
_NEAREST = 0.7
"""Least distance of a point of a layer from all elements, relative to that from its own."""
_SMALLEST = 1.0 / 8.0
"""Least distance of neighbours, relative to the spacing far from the boundary."""
_CROWDED = 0.25
"""Least distance between points of a layer, relative to that from the boundary: one represents all that are closer."""
_GROWTH = 2.0
"""Growth of the distances from the boundary, from one layer of points to the next."""
_INTERVALS = (2, 2, 4, 8)
"""Intervals of straight elements of degrees 0, 1, 2 and more; curved elements have the most."""
_MOST_DIVISIONS = 8
"""Largest number of times that an edge of the boundary is halved until triangles have it; sharp corners would need more
and more."""
_NODE = 1e-9
"""Distance from the start of an element, in its local coordinate, within which a place counts as the node."""
_FLAT = 1e-12
"""Area of a triangle that is round-off, relative to the square of the size of the body."""
_ACROSS = 48
"""Sample points along the longer side of the body in the search for the largest stress inside."""
_STEPS = 16
"""Number of times that the spacing of the nine points around the best one is halved."""


@dataclass(frozen=True, eq=False)
class StressMesh:
    """Stress and displacement at the corners of triangles.

    Parameters
    ----------
    points : (n, 2) array [m]
    triangles : (m, 3) int array
        Anticlockwise.
    stress : (n, 2, 2) array [Pa]
    displacement : (n, 2) array [m]
    """

    points: FloatArray
    triangles: IntArray
    stress: FloatArray
    displacement: FloatArray


def stress_mesh(body: SolvedBody, spacing: float, frame: FloatArray) -> StressMesh:
    """Fill a body with triangles and evaluate its stress and displacement at their corners.

    Parameters
    ----------
    body : Solution or SolvedBody
        For a half-plane the mesh fills the part of the frame below the strip with elements.
    spacing : float [m]
        Distance of points far from the boundary; close to it they are as dense as its elements.
    frame : (2, 2) array [m]
        Least and largest x, least and largest y to which an exterior is cut.
    """
    fields, boundary = body.boundary_stress.interior, body.boundary_stress
    mesh = boundary.mesh
    if mesh.surface is not None:
        return _below_surface(boundary, fields, spacing, frame)
    inner = _inner_points(*_midpoints(boundary, spacing)[2:], spacing, frame, mesh.is_exterior)
    inner = inner[fields.is_inside(inner)]
    rings = [_Ring.on(boundary, loop, spacing) for loop in mesh.loops]
    rings, inner, triangles = _fitted(rings, inner)
    on_boundary = [ring.points for ring in rings]
    points = np.concatenate([*on_boundary, inner])
    triangles = _anticlockwise(points, triangles, mesh.diameter)
    triangles = triangles[fields.is_inside(points[triangles].mean(axis=1))]
    stress = np.concatenate([*(ring.mean(boundary.at) for ring in rings), fields.stress(inner)])
    displacement = [*(ring.mean(boundary.displacement_at) for ring in rings), fields.displacement(inner)]
    return StressMesh(points, triangles, stress, np.concatenate(displacement))


def _below_surface(boundary: BoundaryStress, fields: PotentialFields, spacing: float, frame: FloatArray) -> StressMesh:
    """Fill the rectangle below the strip of a half-plane that has elements, as deep as the frame."""
    mesh = boundary.mesh
    normal, along = mesh.normals[0], mesh.tangents[0]
    middles = _midpoints(boundary, spacing)
    inner = _inner_points(*middles[2:], spacing, frame, is_exterior=True)
    corners = np.stack(np.meshgrid(*frame), axis=2).reshape(-1, 2)
    start, end = mesh.nodes[mesh.elements[0, 0]], mesh.nodes[mesh.elements[-1, 1]]
    depth, length = -float(((corners - start) @ normal).min()), float(norms(end - start))
    down = np.linspace(0.0, 1.0, max(2, round(depth / spacing)) + 1)[1:, None] * -depth * normal
    across = np.linspace(0.0, 1.0, max(2, round(length / spacing)) + 1)[1:-1, None] * length * along
    s, below = (inner - start) @ along, (start - inner) @ normal
    edge = 0.5 * spacing
    inner = inner[(below > 0.0) & (below < depth - edge) & (s > edge) & (s < length - edge)]
    inner = np.concatenate([inner, start + down, end + down, start + down[-1] + across])
    few = _apart(middles.points, np.maximum(middles.lengths, _SMALLEST * spacing))
    places = (
        np.concatenate([[0], middles.element[few], [mesh.n_elements - 1]]),
        np.concatenate([[-1.0], middles.xi[few], [1.0]])[:, None],
    )
    points = np.concatenate([mesh.points(*places)[:, 0], inner])
    triangles = _anticlockwise(points, Delaunay((points - start) / length).simplices.astype(np.intp), length)
    stress = np.concatenate([boundary.at(*places)[:, 0], fields.stress(inner)])
    moved = np.concatenate([boundary.displacement_at(*places)[:, 0], fields.displacement(inner)])
    return StressMesh(points, triangles, stress, moved)


def _anticlockwise(points: FloatArray, triangles: IntArray, size: float) -> IntArray:
    """Return the triangles of points (n, 2) in anticlockwise order, without those that are flat beside a size [m]."""
    first, second, third = np.moveaxis(points[triangles], 1, 0)
    doubled_area = cross(second - first, third - first)
    ordered = np.where(doubled_area[:, None] > 0.0, triangles, triangles[:, ::-1])
    return np.asarray(ordered[np.abs(doubled_area) > _FLAT * size**2])


@dataclass(frozen=True, eq=False)
class _Ring:
    """Places on a closed loop of elements by their arc lengths, which ascend from its start."""

    mesh: BoundaryMesh
    loop: IntArray
    s: FloatArray

    @classmethod
    def on(cls, boundary: BoundaryStress, loop: IntArray, spacing: float) -> _Ring:
        """Return places on all elements and at corners; of close places only the one of largest stress."""
        mesh, degree = boundary.mesh, boundary.space.degree
        lengths = mesh.lengths[loop]
        counts = np.where(mesh.is_straight[loop], _INTERVALS[min(degree, 3)], _INTERVALS[-1])
        counts = np.maximum(counts, np.ceil(lengths / spacing).astype(int))
        starts = np.append(0.0, np.cumsum(lengths)[:-1])
        number = np.arange(counts.sum()) - np.repeat(np.cumsum(counts) - counts, counts)
        every = cls(
            mesh, loop, np.repeat(starts, counts) + number / np.repeat(counts, counts) * np.repeat(lengths, counts)
        )
        least = min(_SMALLEST * spacing, lengths.sum() / 8.0)
        size = np.abs(every.mean(boundary.at)).max(axis=(1, 2))
        is_corner = (number == 0) & np.repeat(corner_nodes(mesh)[mesh.elements[loop, 0]], counts)
        # corners come first in their interval, then the largest stress
        order = np.lexsort((-size, ~is_corner, np.floor(every.s / least)))
        _, first = np.unique(np.floor(every.s[order] / least), return_index=True)
        return cls(mesh, loop, every.s[np.sort(order[first])])

    @property
    def places(self) -> tuple[IntArray, FloatArray]:
        """Elements (n,) and local coordinates (n, 1) of the places, starts of elements at -1."""
        position, xi = at_arc_lengths(self.mesh, self.loop, self.s)
        return self.loop[position], xi[:, None]

    @property
    def points(self) -> FloatArray:
        """(n, 2) array [m]."""
        return self.mesh.points(*self.places)[:, 0]

    def mean(self, values_at: Callable[[IntArray, FloatArray], FloatArray]) -> FloatArray:
        """Return a field (n, ...) at the places, at nodes the mean of the two elements."""
        elements, xi = self.places
        values = values_at(elements, xi)[:, 0]
        at_node = np.flatnonzero(xi[:, 0] < -1.0 + _NODE)
        before = self.mesh.node_elements[self.mesh.elements[elements[at_node], 0], 0]
        values[at_node] = 0.5 * (values[at_node] + values_at(before, np.ones(1))[:, 0])
        return values

    def halved(self, is_cut: BoolArray) -> _Ring:
        """Return the ring with another place in the middle of each edge that is cut; edge k starts at place k."""
        length = float(self.mesh.lengths[self.loop].sum())
        middle = 0.5 * (self.s + np.append(self.s[1:], self.s[0] + length))
        return _Ring(self.mesh, self.loop, np.sort(np.concatenate([self.s, middle[is_cut] % length])))


def _fitted(rings: list[_Ring], inner: FloatArray) -> tuple[list[_Ring], FloatArray, IntArray]:
    """Triangulate places on the boundary and points inside, such that all edges of the rings are edges of triangles.

    Missing edges are halved, and points inside the circles around them are removed.
    """
    for division in range(_MOST_DIVISIONS + 1):
        on_boundary = [ring.points for ring in rings]
        points = np.concatenate([*on_boundary, inner])
        size = np.ptp(points, axis=0).max()
        triangles = Delaunay((points - points.mean(axis=0)) / size).simplices.astype(np.intp)
        edges = np.sort(np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]]), axis=1)
        known = np.unique(edges[:, 0] * len(points) + edges[:, 1])
        ends = np.cumsum([len(each) for each in on_boundary])
        missing, middles, radii = [], [], []
        for each, end in zip(on_boundary, ends, strict=True):
            first = end - len(each) + np.arange(len(each))
            second = np.roll(first, -1)
            key = np.minimum(first, second) * len(points) + np.maximum(first, second)
            missing.append(~np.isin(key, known))
            cut = each[missing[-1]], np.roll(each, -1, axis=0)[missing[-1]]
            middles.append(0.5 * (cut[0] + cut[1]))
            radii.append(0.5 * norms(cut[1] - cut[0]))
        if division == _MOST_DIVISIONS or not any(each.any() for each in missing):
            break
        if len(inner):
            near = KDTree(inner).query_ball_point(np.concatenate(middles), np.concatenate(radii))
            inner = np.delete(inner, np.unique([k for neighbours in near for k in neighbours]).astype(np.intp), axis=0)
        rings = [ring.halved(cut) for ring, cut in zip(rings, missing, strict=True)]
    return rings, inner, triangles


class _Midpoints(NamedTuple):
    """Points of elements (n,) from which layers of points start: local coordinates, normals, and their distances."""

    element: IntArray
    xi: FloatArray
    points: FloatArray
    normals: FloatArray
    lengths: FloatArray


def _midpoints(boundary: BoundaryStress, spacing: float) -> _Midpoints:
    """Return the points of all elements from which layers start.

    Elements of degree 3 and more carry fields without visible peaks: they count as long as the spacing at most.
    """
    mesh, degree = boundary.mesh, boundary.space.degree
    if degree <= 2:
        counts = np.full(mesh.n_elements, max(degree, 1))
    else:
        counts = np.maximum(2, np.ceil(2.0 * mesh.lengths / spacing).astype(int))
    element = np.repeat(np.arange(mesh.n_elements), counts)
    number = np.arange(len(element)) - np.repeat(np.cumsum(counts) - counts, counts)
    xi = (2.0 * number + 1.0) / counts[element] - 1.0
    points, normals = mesh.points(element, xi[:, None])[:, 0], mesh.normals_at(element, xi[:, None])[:, 0]
    return _Midpoints(element, xi, points, normals, mesh.lengths[element] / counts[element])


def _inner_points(
    on_boundary: FloatArray,
    normals: FloatArray,
    lengths: FloatArray,
    spacing: float,
    frame: FloatArray,
    is_exterior: bool,
) -> FloatArray:
    """Return layers of points along the inner normals, the denser the shorter the elements, and a grid between them."""
    tree = KDTree(on_boundary)
    layers = []
    depth = np.maximum(_STEP * lengths, _SMALLEST * spacing)
    while (going := depth < 1.5 * spacing).any():
        points, inward = on_boundary[going] - depth[going, None] * normals[going], depth[going]
        few = _apart(points, _CROWDED * inward)  # each distance to the boundary takes long
        points, inward = points[few], inward[few]
        is_kept = tree.query(points)[0] > _NEAREST * inward
        points, inward = points[is_kept], inward[is_kept]
        layers.append(points[_apart(points, inward)])
        depth = np.where(going, _GROWTH * depth, np.inf)
    inner = np.concatenate([np.zeros((0, 2)), *layers])
    low, high = (frame[:, 0], frame[:, 1]) if is_exterior else (on_boundary.min(axis=0), on_boundary.max(axis=0))
    x, y = (np.arange(a, b + spacing, spacing) for a, b in zip(low, high, strict=True))
    grid = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    distance, nearest = tree.query(grid)
    grid = grid[distance > np.maximum(0.7 * spacing, lengths[nearest])]
    if len(inner) and len(grid):
        grid = grid[KDTree(inner).query(grid)[0] > 0.5 * spacing]
    return np.concatenate([inner, grid])


def _apart(points: FloatArray, distance: FloatArray) -> IntArray:
    """Return which of points (n, 2) that are closer to each other than distances (n,), about, represent all of them."""
    cell = 2.0 ** np.floor(np.log2(distance))
    keys = np.column_stack([np.round(points / cell[:, None]), cell])
    _, first = np.unique(keys, axis=0, return_index=True)
    return np.sort(first)


def largest_equivalent_stress(body: SolvedBody) -> LargestStress:
    """Return the largest equivalent stress of von Mises of a body, inside or on the boundary."""
    mesh, material, fields = body.mesh.whole, body.scene.material, body.boundary_stress.interior
    on_boundary = body.largest_stress()
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    size = float((high - low).max())
    filled = stress_mesh(body, size / _ACROSS, np.stack([low - 0.5 * size, high + 0.5 * size], axis=1))
    values = STRESSES["von-mises"].of(filled.stress, material)
    best = filled.points[[np.argmax(values)]]
    if not fields.is_inside(best)[0]:
        return on_boundary
    # stay clear of the boundary, where constant and linear elements have peaks of their own
    distance = float(np.hypot(*(mesh.centres - best).T).min())
    step = 0.25 * min(distance, size / _ACROSS)
    around = np.stack(np.meshgrid([-1.0, 0.0, 1.0], [-1.0, 0.0, 1.0]), axis=2).reshape(-1, 2)
    largest = float(values.max())
    for _ in range(_STEPS):
        points = best + step * around
        sampled = STRESSES["von-mises"].of(fields.stress(points), material)
        best, largest = points[[np.argmax(sampled)]], float(sampled.max())
        step *= 0.5
    x, y = best[0].tolist()
    return max(on_boundary, LargestStress(largest, x, y), key=lambda each: each.value)
