"""Mesh files: boundary meshes from and for other programs, through meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bemkit.geometry.errors import GeometryError
from bemkit.geometry.files.meshio_files import read_with_meshio, require_meshio
from bemkit.geometry.files.plane_mesh import PlaneMesh, boundary_chains
from bemkit.geometry.loops import following_in_loops
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.vectors import enclosed_area

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
    path = Path(path)
    try:
        if path.suffix.lower() in _SURFACES:
            raise GeometryError("such files hold surfaces alone: export the lines, for example as .msh")
        mesh = read_with_meshio(path)
        lines = tuple(block for block in mesh.blocks if block.n_corners == 2)
        if not lines:
            raise GeometryError("it has no line cells: export the lines of the boundary too")
        if any(block.order > 1 for block in lines):
            raise GeometryError("it has curved lines: write a mesh of first order")
        chains, _ = boundary_chains(PlaneMesh(mesh.points, lines))
    except GeometryError as error:
        raise GeometryError(f"read_mesh: {path}: {error}") from error
    loops = [(chain.points, chain.names) for chain in chains]
    largest = int(np.argmax([abs(enclosed_area(points)) for points, _ in loops]))
    for k, (points, names) in enumerate(loops):
        is_anticlockwise = enclosed_area(points) > 0.0
        if is_anticlockwise != (k == largest and not is_exterior):
            loops[k] = np.roll(points[::-1], 1, axis=0), names[::-1]  # the last chord, turned, is now the first
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
    require_meshio()
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
