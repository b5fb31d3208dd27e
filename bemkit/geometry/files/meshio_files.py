"""Meshes through meshio: Abaqus, VTK, Nastran and others, and those of gmsh where its own package is missing."""

from __future__ import annotations

import contextlib
import importlib.util
import io
from pathlib import Path
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import printable
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.files.plane_mesh import CellBlock, PlaneMesh, in_plane

_CORNERS = {"line": 2, "triangle": 3, "quad": 4}
_TYPES = {
    **{"line": (2, 1), "line3": (2, 2), "line4": (2, 3)},
    **{"triangle": (3, 1), "triangle6": (3, 2), "triangle7": (3, 2), "triangle10": (3, 3)},
    **{"quad": (4, 1), "quad8": (4, 2), "quad9": (4, 2), "quad16": (4, 3)},
}
"""Corners and order of the cells of plane meshes."""


def read_with_meshio(path: Path) -> PlaneMesh:
    """Read a plane mesh.

    Raises
    ------
    GeometryError
        If meshio is missing, cannot read the file, or the file holds no plane mesh.
    """
    require_meshio()
    mesh = _read_quietly(path)
    points = in_plane(_points_of(mesh))
    solid = [block.type for block in mesh.cells if block.type.startswith(("tetra", "hexa", "wedge", "pyramid"))]
    if solid:
        raise GeometryError(f"it has cells of type {solid[0]!r}: bemkit solves plane problems; give a plane mesh")
    blocks = []
    for k, block in enumerate(mesh.cells):
        if block.type == "vertex":
            continue
        if block.type not in _TYPES:
            raise GeometryError(f"it has cells of type {block.type!r}: give lines, triangles and quadrilaterals")
        n_corners, order = _TYPES[block.type]
        nodes = np.asarray(block.data)
        if (
            nodes.dtype.kind not in "iu"
            or nodes.ndim != 2
            or nodes.shape[1] < n_corners
            or (nodes.size and not 0 <= nodes.min() <= nodes.max() < len(points))
        ):
            raise GeometryError(f"it is damaged: its cells do not join its {len(points)} points: write it anew")
        blocks.append(CellBlock(n_corners, order, nodes.astype(np.intp), _names(mesh, k), _curves(mesh, k)))
    return PlaneMesh(points, tuple(blocks), tuple(mesh.field_data))


def require_meshio() -> None:
    """Refuse with the remedy where meshio is missing."""
    if importlib.util.find_spec("meshio") is None:
        raise GeometryError('meshio is not installed: pip install "bemkit[mesh]"')


def _read_quietly(path: Path) -> Any:
    """Read a file; meshio prints what it dislikes, and may leave the interpreter."""
    import meshio

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # its many readers fail in many ways on a damaged file
        reason = printable(" ".join((said.getvalue() or f"{type(error).__name__}: {error}").split()))
        raise GeometryError(f"it cannot be read ({reason}): give a mesh file of a format that meshio knows") from error


def _points_of(mesh: Any) -> FloatArray:
    """Return the (n, 2) or (n, 3) finite coordinates of a file."""
    try:
        points = np.asarray(mesh.points, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or not len(points) or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
        raise GeometryError(
            "it is damaged: its points are no finite coordinates in the plane or in space: write it anew"
        )
    return points


def _names(mesh: Any, number: int) -> tuple[str, ...]:
    """Return the group of each cell of a block: its physical group, or else a cell set."""
    try:
        names = _groups(mesh, number)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise GeometryError(
            f"it is damaged: its groups cannot be told ({printable(str(error))}): write it anew"
        ) from error
    for name in dict.fromkeys(names):
        if not name.isprintable():
            raise GeometryError(f"it is damaged: the group {name!r} has a name that is not printable: write it anew")
    return names


def _groups(mesh: Any, number: int) -> tuple[str, ...]:
    n_cells = len(mesh.cells[number].data)
    dimension = 1 if mesh.cells[number].type.startswith("line") else 2
    if "gmsh:physical" in mesh.cell_data:
        tags = np.asarray(mesh.cell_data["gmsh:physical"][number]).tolist()
        names = {int(tag): name for name, (tag, own) in mesh.field_data.items() if own == dimension}
        return tuple(names.get(tag, f"group-{tag}" if tag else "") for tag in tags)
    result = [""] * n_cells
    for name, members in mesh.cell_sets.items():
        if members[number] is not None and not name.startswith("gmsh:"):
            for cell in np.asarray(members[number], dtype=int).tolist():
                result[cell] = name
    return tuple(result)


def _curves(mesh: Any, number: int) -> IntArray:
    tags = mesh.cell_data.get("gmsh:geometrical")
    n_cells = len(mesh.cells[number].data)
    return np.zeros(n_cells, np.intp) if tags is None else np.asarray(tags[number]).astype(np.intp)
