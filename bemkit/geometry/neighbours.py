"""Elements along a boundary, in order, with arc lengths, corners and ends of parts; and across a body."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import angles_between, cross

_POINTS_OF_CURVE = 9
_POINTS_OF_ARC = 12
_ROUND_OFF = 1e-9
"""Distance by which normals of arcs may miss their centre, relative to the diameter."""
_FACING = -0.5
"""Cosine of the angle between normals of elements that face each other."""
_ROWS, _FEW = 4096, 1024
"""Number of elements whose neighbours are searched at a time. For few elements all distances take less time than
loading a tree (measured)."""


def along_boundary(mesh: BoundaryMesh, elements: IntArray) -> IntArray:
    """Sort elements along the boundary, each connected run from its start to its end.

    Parameters
    ----------
    mesh : BoundaryMesh
    elements : (m,) array
        Element numbers without repetition.

    Returns
    -------
    (m,) array
        Runs follow one another by the number of their first element; a whole loop starts with its smallest number.
    """
    chosen = np.zeros(mesh.n_elements, bool)
    chosen[elements] = True
    incoming, outgoing = mesh.node_elements.T
    previous, following = incoming[mesh.elements[:, 0]], outgoing[mesh.elements[:, 1]]
    is_first = previous == np.arange(mesh.n_elements)  # on a symmetry line
    starts = np.flatnonzero(chosen & (is_first | ~chosen[previous])).tolist()
    ordered: list[int] = []
    while starts or chosen.any():
        element = starts.pop(0) if starts else int(np.flatnonzero(chosen)[0])
        while chosen[element]:
            chosen[element] = False
            ordered.append(element)
            element = int(following[element])
    return np.array(ordered, dtype=np.intp)


def arc_lengths(mesh: BoundaryMesh, elements: IntArray, xi: FloatArray) -> FloatArray:
    """Return the arc lengths (m, q) [m] of points xi (q,) or (m, q) of elements (m,) in their order."""
    lengths = mesh.lengths[elements]
    starts = np.cumsum(lengths) - lengths
    return np.asarray(starts[:, None] + 0.5 * lengths[:, None] * (xi + 1.0))


def at_arc_lengths(mesh: BoundaryMesh, elements: IntArray, s: FloatArray) -> tuple[IntArray, FloatArray]:
    """Invert `arc_lengths`: positions (n,) among `elements` and xi (n,) of s (n,) [m]; a node starts its element."""
    lengths = mesh.lengths[elements]
    ends = np.cumsum(lengths)
    position = np.minimum(np.searchsorted(ends, s, side="right"), elements.size - 1)
    return position, np.clip(1.0 - 2.0 * (ends[position] - s) / lengths[position], -1.0, 1.0)


def drawn_points(mesh: BoundaryMesh, degree: int) -> FloatArray:
    """Return the local coordinates (q,) by which elements with fields of a degree are drawn: ends of straight ones."""
    is_straight = degree <= 1 and bool(mesh.is_straight.all())
    return np.linspace(-1.0, 1.0, 2 if is_straight else _POINTS_OF_CURVE)


def break_nodes(mesh: BoundaryMesh) -> BoolArray:
    """Return the (n_nodes,) mask, read-only, of nodes where tractions may jump: corners and ends of boundary parts."""
    if mesh.symmetry is not None:
        return break_nodes(mesh.whole)[: mesh.n_nodes]
    owner = np.full(mesh.n_elements, -1)
    for number, name in enumerate(mesh.parts):
        owner[mesh.part(name)] = number
    before, after = mesh.node_elements.T
    changes = (owner[before] != owner[after]) | (before == after)  # the same only at the ends of a half-plane
    return read_only(corner_nodes(mesh) | changes)


def lone_elements(mesh: BoundaryMesh) -> BoolArray:
    """Return the (n_elements,) mask of elements with a corner or an end of a part at both ends."""
    return np.asarray(break_nodes(mesh)[mesh.elements].all(axis=1))


def corner_nodes(mesh: BoundaryMesh, angle: float = 1e-6) -> BoolArray:
    """Return which nodes are corners.

    Parameters
    ----------
    mesh : BoundaryMesh
    angle : float [rad]
        Turn of the tangent above which a node is a corner. The round-off of the direction of short elements is added.

    Returns
    -------
    (n_nodes,) bool array
    """
    if mesh.symmetry is not None:
        return corner_nodes(mesh.whole, angle)[: mesh.n_nodes]
    incoming, outgoing = mesh.node_elements[:, 0], mesh.node_elements[:, 1]
    before = mesh.normals_at(incoming, np.array([1.0]))[:, 0]
    after = mesh.normals_at(outgoing, np.array([-1.0]))[:, 0]
    shortest = np.minimum(mesh.lengths[incoming], mesh.lengths[outgoing])
    round_off = 8.0 * np.finfo(float).eps * np.abs(mesh.nodes).max(axis=1) / shortest
    corners: BoolArray = np.abs(angles_between(before, after)) > angle + round_off
    return corners


def common_centre(sides: Sequence[tuple[BoundaryMesh, IntArray]]) -> FloatArray | None:
    """Return the point (2,) [m] through which all normals of curved elements (k,) of meshes pass.

    None if there is no such point, or if an element is straight.
    """
    if any(mesh.is_straight[elements].any() for mesh, elements in sides):
        return None
    (first, _), (xi, _) = sides[0], gauss_legendre(_POINTS_OF_ARC)
    points = np.concatenate([mesh.points(elements, xi).reshape(-1, 2) for mesh, elements in sides])
    normals = np.concatenate([mesh.normals_at(elements, xi).reshape(-1, 2) for mesh, elements in sides])
    points -= first.centre
    arms = np.column_stack([-normals[:, 1], normals[:, 0]])
    centre = np.linalg.lstsq(arms, cross(normals, points), rcond=None)[0]
    missed = np.abs(cross(normals, points - centre)).max()
    return first.centre + centre if missed <= _ROUND_OFF * first.diameter else None


def thicknesses(mesh: BoundaryMesh, reach: FloatArray | float = np.inf) -> FloatArray:
    """Return the distance (n_elements,) [m] across the body to the nearest element that faces the other way.

    Elements face each other if their normals are opposite to within 60 degrees and the line between their middles is
    within 45 degrees of the normal; infinite where no element within `reach` [m] does.
    """
    whole, result = mesh.whole, np.full(mesh.n_elements, np.inf)
    farthest = np.minimum(reach, 4.0 * whole.diameter) + np.zeros(mesh.n_elements)
    for first, second in _near_pairs(mesh, farthest):
        arm = whole.centres[second] - whole.centres[first]
        across, distance = -np.sum(arm * whole.normals[first], axis=1), np.hypot(arm[:, 0], arm[:, 1])
        cosine = np.sum(whole.normals[first] * whole.normals[second], axis=1)
        faces = (distance <= farthest[first]) & (cosine < _FACING) & (across > np.sqrt(0.5) * distance)
        np.minimum.at(result, first[faces], distance[faces])
    return result


def _near_pairs(mesh: BoundaryMesh, farthest: FloatArray) -> Iterator[tuple[IntArray, IntArray]]:
    """Yield pairs of an element and an element of the whole body within the distance `farthest` of the first."""
    whole, elements = mesh.whole, np.arange(mesh.n_elements)
    if whole.n_elements <= _FEW:
        arms = whole.centres - mesh.centres[:, None]
        first, second = np.nonzero(np.hypot(arms[:, :, 0], arms[:, :, 1]) <= farthest[:, None])
        yield first, second
        return
    from scipy.spatial import KDTree

    tree = KDTree(whole.centres)
    for rows in np.split(elements, range(_ROWS, mesh.n_elements, _ROWS)):
        near = tree.query_ball_point(mesh.centres[rows], farthest[rows], return_sorted=False)
        counts = np.fromiter(map(len, near), np.intp, len(near))
        yield np.repeat(rows, counts), np.fromiter(itertools.chain.from_iterable(near), np.intp, counts.sum())
