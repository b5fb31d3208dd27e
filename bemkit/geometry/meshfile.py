"""Mesh files: boundary meshes from and for other programs, through meshio."""

import contextlib
import importlib.util
import io
from pathlib import Path
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import printable
from bemkit.geometry.errors import GeometryError, format_point
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.validity.loops import following_in_loops
from bemkit.geometry.vectors import cross

_SURFACES = (".ply", ".stl", ".off", ".obj")


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
    _require_meshio("read_mesh")
    path = Path(path)
    if path.suffix.lower() in _SURFACES:
        raise GeometryError(f"read_mesh: {path}: such files hold surfaces alone: export the lines, for example as .msh")
    mesh = _read_quietly(path)
    points = _points(mesh, path)
    if points.shape[1] == 3:
        if np.ptp(points[:, 2]) > 0.0:
            raise GeometryError(
                f"read_mesh: the points of {path} have z from {points[:, 2].min():.6g} to {points[:, 2].max():.6g}: "
                "give a plane mesh, with the same z everywhere"
            )
        points = points[:, :2]
    curved = sorted({block.type for block in mesh.cells if block.type.startswith("line") and block.type != "line"})
    if curved:
        raise GeometryError(f"read_mesh: {path} has cells of type {curved[0]!r}: write a mesh of first order")
    is_line = np.array([block.type == "line" for block in mesh.cells], dtype=bool)
    if not is_line.any():
        raise GeometryError(f"read_mesh: {path} has no line cells: export the lines of the boundary too")
    lines = _lines([block.data for block in mesh.cells if block.type == "line"], len(points), path)
    loops, line_loops = _chain(points, lines, path)
    largest = int(np.argmax([abs(_signed_area(points[loop])) for loop in loops]))
    for k, loop in enumerate(loops):
        is_anticlockwise = _signed_area(points[loop]) > 0.0
        if is_anticlockwise != (k == largest and not is_exterior):
            # reversed, the line from node i to i + 1 starts at node i + 1
            loops[k], line_loops[k] = np.roll(loop[::-1], 1), line_loops[k][::-1]
    order = np.concatenate(line_loops)
    element_of_line = np.empty(len(lines), dtype=np.intp)
    element_of_line[order] = np.arange(len(lines))
    parts = {name: element_of_line[members] for name, members in _checked_names(mesh, is_line, path).items()}
    following = following_in_loops(np.array([len(loop) for loop in loops]))
    elements = np.column_stack([np.arange(len(lines)), following])
    return BoundaryMesh(points[np.concatenate(loops)], elements, parts, is_exterior=is_exterior)


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
    _require_meshio("write_mesh")
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


def _require_meshio(caller: str) -> None:
    if importlib.util.find_spec("meshio") is None:
        raise GeometryError(f'{caller}: meshio is not installed: pip install "bemkit[mesh]"')


def _read_quietly(path: Path) -> Any:
    """Read a file; meshio prints what it dislikes, and may leave the interpreter."""
    import meshio

    said = io.StringIO()
    try:
        with contextlib.redirect_stdout(said), contextlib.redirect_stderr(said):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # its many readers fail in many ways on a damaged file
        reason = printable(" ".join((said.getvalue() or f"{type(error).__name__}: {error}").split()))
        raise GeometryError(
            f"read_mesh: {path} cannot be read ({reason}): give a mesh file of a format that meshio knows"
        ) from error


def _points(mesh: Any, path: Path) -> FloatArray:
    """Return the (n, 2) or (n, 3) finite coordinates of a file."""
    try:
        points = np.asarray(mesh.points, dtype=float)
    except (TypeError, ValueError):
        points = np.zeros(0)
    if points.ndim != 2 or not len(points) or points.shape[1] not in (2, 3) or not np.isfinite(points).all():
        raise _damaged(path, "its points are no finite coordinates in the plane or in space")
    return points


def _lines(blocks: list[Any], n_points: int, path: Path) -> IntArray:
    """Return the (n, 2) numbers of the points that the lines of a file join."""
    try:
        lines = np.concatenate([np.asarray(block).reshape(len(block), 2) for block in blocks])
    except (TypeError, ValueError):
        lines = np.zeros(0)
    if lines.dtype.kind not in "iu" or not lines.size or lines.min() < 0 or lines.max() >= n_points:
        raise _damaged(path, f"its lines do not join pairs of its {n_points} points")
    return lines.astype(np.intp)


def _checked_names(mesh: Any, is_line: BoolArray, path: Path) -> dict[str, IntArray]:
    """Return the lines of each group, whose names and numbers make sense; see `_named_lines`."""
    n_lines = sum(len(block.data) for block, line in zip(mesh.cells, is_line, strict=True) if line)
    try:
        named = _named_lines(mesh, is_line)
    except (IndexError, KeyError, TypeError, ValueError) as error:
        raise _damaged(path, f"its groups cannot be told ({error})") from error
    for name, lines in named.items():
        if not (name.isprintable() and lines.max() < n_lines):
            raise _damaged(path, f"the group {name!r} has a name that is not printable, or lines that do not exist")
    return named


def _damaged(path: Path, what: str) -> GeometryError:
    return GeometryError(f"read_mesh: {path} is damaged: {printable(what)}: write it anew")


def _named_lines(mesh: Any, is_line: BoolArray) -> dict[str, IntArray]:
    """Return the numbers of lines (counted over all blocks of lines) of each physical group, or else each cell set."""
    if "gmsh:physical" in mesh.cell_data:
        blocks = [np.asarray(tags) for tags, line in zip(mesh.cell_data["gmsh:physical"], is_line, strict=True) if line]
        tags = np.concatenate(blocks)
        groups = {name: int(tag) for name, (tag, dimension) in mesh.field_data.items() if dimension == 1}
        named = {name: np.flatnonzero(tags == tag) for name, tag in groups.items()}
        return {name: lines for name, lines in named.items() if len(lines)}
    counts = np.array([len(block.data) for block in mesh.cells])
    offsets = np.cumsum(counts * is_line) - counts
    named = {}
    for name, members in mesh.cell_sets.items():
        chosen = [np.asarray(cells, dtype=np.intp) + offsets[k] for k, cells in enumerate(members) if is_line[k]]
        lines = np.concatenate(chosen)
        if len(lines):
            named[name] = lines
    return named


def _chain(points: FloatArray, lines: IntArray, path: Path) -> tuple[list[IntArray], list[IntArray]]:
    """Follow lines around; return for each loop its nodes, and its lines, the k-th from the k-th node to the next."""
    degree = np.bincount(lines.ravel(), minlength=len(points))
    for node in np.flatnonzero((degree != 0) & (degree != 2)).tolist():
        raise GeometryError(
            f"read_mesh: {degree[node]} lines of {path} meet at {format_point(points[node])}: the boundary must be "
            "closed and simple, two lines at each node; leave lines inside the body out"
        )
    by_node = np.argsort(lines.ravel(), kind="stable") // 2
    first_line = np.full(len(points), -1)
    first_line[degree == 2] = 2 * np.arange(np.count_nonzero(degree == 2))
    is_seen = np.zeros(len(lines), dtype=bool)
    loops, line_loops = [], []
    for first in range(len(lines)):
        nodes, chain, line, node = [], [], first, int(lines[first, 0])
        while not is_seen[line]:
            is_seen[line] = True
            nodes.append(node)
            chain.append(line)
            node = int(lines[line].sum()) - node
            pair = by_node[first_line[node] : first_line[node] + 2]
            line = int(pair.sum()) - line
        if chain:
            loops.append(np.array(nodes, dtype=np.intp))
            line_loops.append(np.array(chain, dtype=np.intp))
    return loops, line_loops


def _signed_area(corners: FloatArray) -> float:
    arms = corners - corners[0]
    return float(0.5 * cross(arms, np.roll(arms, -1, axis=0)).sum())
