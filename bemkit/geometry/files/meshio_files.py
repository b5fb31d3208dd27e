"""Mesh files of other programs through meshio: plane meshes, and boundary meshes to and fro."""

from __future__ import annotations

import contextlib
import io
from pathlib import Path
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError, printable
from bemkit.geometry.files.plane_mesh import CellBlock, PlaneMesh, boundary_chains, in_plane
from bemkit.geometry.files.strokes import require_package
from bemkit.geometry.loops import following_in_loops
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.vectors import senses_of

_TYPES = {
    **{"line": (2, 1), "line3": (2, 2), "line4": (2, 3)},
    **{"triangle": (3, 1), "triangle6": (3, 2), "triangle7": (3, 2), "triangle10": (3, 3)},
    **{"quad": (4, 1), "quad8": (4, 2), "quad9": (4, 2), "quad16": (4, 3)},
}
"""Corners and order of the cells of plane meshes."""
_SURFACES = (".ply", ".stl", ".off", ".obj")


def read_with_meshio(path: Path) -> PlaneMesh:
    """Read a plane mesh.

    Raises
    ------
    GeometryError
        If meshio is missing, cannot read the file, or the file holds no plane mesh.
    """
    require_package("meshio", "mesh")
    return plane_mesh_of(_read_quietly(path))


def plane_mesh_of(mesh: Any) -> PlaneMesh:
    """Return the plane mesh in the contents of a file as meshio reads them; GeometryError if there is none."""
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
            raise GeometryError(f"it is damaged: its cells do not join its {len(points)} points: export it again")
        blocks.append(CellBlock(n_corners, order, nodes.astype(np.intp), _names(mesh, k), _curves(mesh, k)))
    return PlaneMesh(points, tuple(blocks), tuple(mesh.field_data))


def _read_quietly(path: Path) -> Any:
    """Read a file without the printed warnings of meshio, which may also exit the interpreter."""
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
        raise GeometryError("it is damaged: its points are not finite coordinates: export it again")
    return points


def _names(mesh: Any, number: int) -> tuple[str, ...]:
    """Return the group of each cell of a block: its physical group, or else a cell set."""
    try:
        names = _groups(mesh, number)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise GeometryError(
            f"it is damaged: its groups cannot be read ({printable(str(error))}): export it again"
        ) from error
    for name in dict.fromkeys(names):
        if not name.isprintable():
            raise GeometryError(f"it is damaged: the group {name!r} has a name that is not printable: export it again")
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


def read_mesh(path: str | Path, *, is_exterior: bool = False) -> BoundaryMesh:
    """Read the boundary of a body from a mesh file.

    Parameters
    ----------
    path : str or Path
        A file in a format that meshio reads, with straight line cells along the whole boundary. Other cells, and nodes
        on no line, are left aside.
    is_exterior : bool
        Whether the body is the plane outside of the loops.

    Returns
    -------
    BoundaryMesh
        The lines become elements in order along each loop, turned so that the body lies on the left; physical groups
        or cell sets of lines become parts.

    Raises
    ------
    GeometryError
        If meshio is missing, the file cannot be read, or its lines do not bound a body in the plane.
    """
    path = Path(path)
    try:
        if path.suffix.lower() in _SURFACES:
            raise GeometryError("such files hold only surfaces: export the lines, for example as .msh")
        mesh = read_with_meshio(path)
        lines = tuple(block for block in mesh.blocks if block.n_corners == 2)
        if not lines:
            raise GeometryError("it has no line cells: export the lines of the boundary too")
        if any(block.order > 1 for block in lines):
            raise GeometryError("it has curved lines: write a mesh of first order")
        chains, _ = boundary_chains(PlaneMesh(mesh.points, lines))
    except GeometryError as error:
        raise GeometryError(f"read_mesh: {path}: {error}") from error
    outer, senses = senses_of([chain.points for chain in chains])
    senses[outer] ^= is_exterior
    loops = [
        # the last chord, turned, is now the first
        (chain.points, chain.names) if is_right else (np.roll(chain.points[::-1], 1, axis=0), chain.names[::-1])
        for chain, is_right in zip(chains, senses, strict=True)
    ]
    group = np.array([name for _, names in loops for name in names])
    parts = {name: np.flatnonzero(group == name) for name in np.unique(group[group != ""]).tolist()}
    following = following_in_loops(np.array([len(names) for _, names in loops]))
    elements = np.column_stack([np.arange(group.size), following])
    return BoundaryMesh(np.concatenate([points for points, _ in loops]), elements, parts, is_exterior=is_exterior)


def write_mesh(path: str | Path, mesh: BoundaryMesh) -> None:
    """Write a boundary mesh to a Gmsh file, format 2.2.

    Parameters
    ----------
    path : str or Path
        A file name that ends in ".msh"; an existing file is replaced.
    mesh : BoundaryMesh
        The mesh, with the images that a symmetry adds; its parts become physical groups. The file knows only straight
        lines: curved elements are written as their chords.

    Raises
    ------
    GeometryError
        If meshio is missing, or the file name has another ending.
    """
    require_package("meshio", "mesh")
    import meshio

    path = Path(path)
    if path.suffix != ".msh":
        raise GeometryError(f"write_mesh: {path} is not a name for a Gmsh file: end it in .msh")
    mesh = mesh.whole
    tags = np.zeros(mesh.n_elements, dtype=int)
    for tag, members in enumerate(mesh.parts.values(), start=1):
        tags[members] = tag
    names = {name: np.array([tag, 1]) for tag, name in enumerate(mesh.parts, start=1)}
    file_mesh = meshio.Mesh(
        np.column_stack([mesh.nodes, np.zeros(mesh.n_nodes)]),
        [("line", mesh.elements)],
        cell_data={"gmsh:physical": [tags], "gmsh:geometrical": [tags + 1]},
        field_data=names,
    )
    meshio.write(path, file_mesh, file_format="gmsh22", binary=False)
