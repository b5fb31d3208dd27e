"""Plane meshes as files hold them, and the closed chains of element sides that bound them."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.files.chords import ChordLoop
from bemkit.geometry.files.strokes import check_only
from bemkit.geometry.loops import closed_chains
from bemkit.geometry.vectors import cross

_PLANE = 1e-9
"""Deviation from a plane that is round-off, relative to the size."""


@dataclass(frozen=True)
class CellBlock:
    """Cells of one type.

    Parameters
    ----------
    n_corners : int
        2 for lines, 3 for triangles, 4 for quadrilaterals.
    order : int
        Of the polynomials that give their shape.
    nodes : (n_cells, n_nodes) int array
        Corners first, then those inside each side, side after side, then others.
    names : tuple of n_cells str
        The group of each cell, empty for none.
    curves : (n_cells,) int array
        The curve or surface of the geometry that each belongs to, 0 for none.
    """

    n_corners: int
    order: int
    nodes: IntArray
    names: tuple[str, ...]
    curves: IntArray

    def sides(self) -> IntArray:
        """(n_cells, n_corners, order + 1) int array: the nodes along each side; of lines the one side."""
        corners, inner = np.arange(self.n_corners), self.order - 1
        if self.n_corners == 2:
            return self.nodes[:, None, [0, *range(2, 2 + inner), 1]]
        along = [
            [k, *(self.n_corners + inner * k + np.arange(inner)), (k + 1) % self.n_corners] for k in corners.tolist()
        ]
        return self.nodes[:, along]


@dataclass(frozen=True)
class PlaneMesh:
    """Points (n, 2) and cells of a plane mesh.

    Parameters
    ----------
    points : (n, 2) array [m]
    blocks : tuple of CellBlock
    names : tuple of str
        Names of groups in the order of the file, with or without cells.
    """

    points: FloatArray
    blocks: tuple[CellBlock, ...]
    names: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Edge:
    """A piece of boundary: its nodes in order, its group and its curve."""

    nodes: tuple[int, ...]
    name: str = ""
    curve: int = 0

    def reversed(self) -> _Edge:
        return _Edge(self.nodes[::-1], self.name, self.curve)


def in_plane(points: FloatArray) -> FloatArray:
    """Return x and y (n, 2) of points (n, 2) or (n, 3) with the same z.

    Raises
    ------
    GeometryError
        If z varies.
    """
    if points.shape[1] == 3:
        low, high = points[:, 2].min(), points[:, 2].max()
        if high - low > _PLANE * np.ptp(points, axis=0).max():
            raise GeometryError(
                f"it is three-dimensional, with z from {low:.6g} to {high:.6g}: bemkit solves plane problems; give a "
                "plane mesh, with the same z everywhere, such as that of a cross-section"
            )
    return np.ascontiguousarray(points[:, :2])


def boundary_chains(mesh: PlaneMesh, only: Sequence[str] = ()) -> tuple[list[ChordLoop], list[str]]:
    """Return the closed chains that bound the cells of a mesh, and what was done to find them.

    Parameters
    ----------
    mesh : PlaneMesh
        Sides of only one triangle or quadrilateral are the boundary, and take names and curves from the lines of the
        mesh that lie on them. In a mesh without such cells the lines are the boundary.
    only : sequence of str
        Names of the surfaces that are the body; all if empty.

    Raises
    ------
    GeometryError
        If there are no cells, a name is unknown, or the boundary is not closed and simple.
    """
    lines = [edge for block in mesh.blocks if block.n_corners == 2 for edge in _edges(block)]
    notes = []
    if mesh.names and not any(name for block in mesh.blocks for name in block.names):
        notes.append(
            f"its groups {', '.join(mesh.names)} have no cells, as gmsh writes version 2 with SaveAll: save it as "
            "version 4, or without SaveAll"
        )
    if any(block.n_corners > 2 for block in mesh.blocks):
        edges, is_turned = _outer_edges(mesh, only)
        tagged = {frozenset((line.nodes[0], line.nodes[-1])): line for line in lines}
        on_edge = [tagged.get(frozenset((edge.nodes[0], edge.nodes[-1]))) for edge in edges]
        if not any(on_edge):
            notes.append("the boundary is that of its triangles and quadrilaterals: its curves are not in the file")
        edges = [
            edge if line is None else _Edge(edge.nodes, line.name, line.curve)
            for edge, line in zip(edges, on_edge, strict=True)
        ]
        if is_turned:
            notes.append("its triangles run clockwise: turned, so that the body lies on the left of its boundary")
    else:
        edges = list({frozenset(line.nodes): line for line in lines}.values())
        notes += _mixed_senses(edges)
    if not edges:
        raise GeometryError("it is empty, without lines, triangles or quadrilaterals: mesh the surface (gmsh -2)")
    return _chained(mesh.points, edges), notes


def _edges(block: CellBlock) -> list[_Edge]:
    nodes = block.sides()[:, 0].tolist()
    return [_Edge(tuple(n), name, c) for n, name, c in zip(nodes, block.names, block.curves.tolist(), strict=True)]


def _outer_edges(mesh: PlaneMesh, only: Sequence[str]) -> tuple[list[_Edge], bool]:
    """Return the sides that belong to only one cell, anticlockwise around it, and whether most cells run clockwise."""
    known = dict.fromkeys(name for block in mesh.blocks if block.n_corners > 2 for name in block.names if name)
    check_only(only, [*known], "the names of its surfaces")
    sides: dict[frozenset[int], list[tuple[int, ...]]] = {}
    n_clockwise = n_cells = 0
    for block in mesh.blocks:
        if block.n_corners == 2:
            continue
        is_taken = np.array([not only or name in only for name in block.names], dtype=bool)
        nodes = block.sides()[is_taken]
        corners = mesh.points[nodes[:, :, 0]]
        arms = corners - corners[:, :1]
        is_clockwise = cross(arms[:, 1:-1], arms[:, 2:]).sum(axis=1) < 0.0
        n_clockwise, n_cells = n_clockwise + int(is_clockwise.sum()), n_cells + len(nodes)
        nodes[is_clockwise] = nodes[is_clockwise][:, :, ::-1]
        for side in nodes.reshape(-1, nodes.shape[-1]).tolist():
            sides.setdefault(frozenset((side[0], side[-1])), []).append(tuple(side))
    crowded = [side[0] for side in sides.values() if len(side) > 2]
    if crowded:
        place = format_point(mesh.points[crowded[0][0]])
        raise GeometryError(f"three or more of its cells share the side at {place}: mesh the surface once")
    return [_Edge(side[0]) for side in sides.values() if len(side) == 1], 2 * n_clockwise > n_cells


def _mixed_senses(edges: Sequence[_Edge]) -> list[str]:
    starts = Counter(edge.nodes[0] for edge in edges)
    if any(count > 1 for count in starts.values()):
        return ["its lines do not all run the same way round: turned, so that the body lies on their left"]
    return []


def _chained(points: FloatArray, edges: Sequence[_Edge]) -> list[ChordLoop]:
    """Follow edges around, each node of which two share."""
    nodes, place, count = np.unique(
        np.array([(edge.nodes[0], edge.nodes[-1]) for edge in edges]), return_inverse=True, return_counts=True
    )
    if (wrong := np.flatnonzero(count != 2)).size:
        raise GeometryError(
            f"{count[wrong[0]]} lines of its boundary meet at {format_point(points[nodes[wrong[0]]])}: the boundary "
            "must be closed and simple, two lines at each node; remove lines inside the body, or write its "
            "triangles too"
        )
    return [
        _chord_loop(points, [edges[k] if ahead else edges[k].reversed() for k, ahead in chain])
        for chain in closed_chains(place.reshape(-1, 2))
    ]


def _chord_loop(points: FloatArray, chain: Sequence[_Edge]) -> ChordLoop:
    nodes: list[int] = []
    names: list[str] = []
    is_end: list[bool] = []
    is_inner: list[bool] = []
    is_within: list[bool] = []
    for k, edge in enumerate(chain):
        n_inner = len(edge.nodes) - 2
        nodes += edge.nodes[:-1]
        names += [edge.name] * (n_inner + 1)
        is_end += [edge.curve != chain[k - 1].curve, *[False] * n_inner]
        is_inner += [False, *[True] * n_inner]
        is_within += [edge.curve == chain[k - 1].curve != 0, *[True] * n_inner]
    return ChordLoop(points[np.array(nodes)], tuple(names), np.array(is_end), np.array(is_inner), np.array(is_within))
