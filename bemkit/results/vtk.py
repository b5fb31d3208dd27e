"""Results for ParaView and the like: boundaries as lines, contact nodes as vertices, quadrilaterals inside.

The XML files of VTK are unstructured grids (.vtu) and polygonal data (.vtp). Arrays are written in base64, each behind
the number of its bytes; see "VTK XML file formats" in the documentation of VTK.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.atomic_files import replacing
from bemkit.geometry.local_values import values_on_elements
from bemkit.operators.material import Plane
from bemkit.operators.somigliana.stress import von_mises
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.interior import interior_fields
from bemkit.results.solution import Solution
from bemkit.solvers.active_sets import NodeStatus

_KINDS = {"vertex": (1, "Verts"), "line": (3, "Lines"), "quad": (9, "Polys")}
"""Cells in the order that polygonal data want: the number of their type in grids, their place in polygonal data."""
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
_POINTS_OF_CURVE = 9
"""Points of an element whose displacement or shape is curved."""
_CONTACT = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "status", "weight")
_CLEAR = 0.5
"""Distance of points inside from the boundary, in lengths of its elements: closer, stresses have peaks of their own."""


@dataclass(frozen=True)
class Block:
    """Points (n, 2), cells (m, k) of them, and values at both; what a block lacks is not a number.

    Cells are of the kind vertex, line or quad.
    """

    kind: str
    points: FloatArray
    cells: IntArray
    point_data: Mapping[str, FloatArray]
    cell_data: Mapping[str, FloatArray]


def write_vtk_xml(path: Path, blocks: Sequence[Block]) -> None:
    """Write blocks of cells into a file that ends in ``.vtu``, or in ``.vtp`` for polygonal data.

    Raises
    ------
    OutputFileError
        If the system refuses.
    """
    is_grid = path.suffix.lower() == ".vtu"
    blocks = sorted((block for block in blocks if len(block.cells)), key=lambda block: list(_KINDS).index(block.kind))
    counts = [len(block.points) for block in blocks]
    starts = (np.cumsum(counts) - counts).tolist()
    cells = [block.cells + start for block, start in zip(blocks, starts, strict=True)]
    kind = "UnstructuredGrid" if is_grid else "PolyData"
    root = ElementTree.Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian", header_type="UInt64")
    piece = ElementTree.SubElement(ElementTree.SubElement(root, kind), "Piece", NumberOfPoints=str(sum(counts)))
    _add(piece, "Points", {"Points": in_space(np.concatenate([block.points for block in blocks]))})
    if is_grid:
        piece.set("NumberOfCells", str(sum(map(len, cells))))
        types = np.concatenate([np.full(len(block.cells), _KINDS[block.kind][0], np.uint8) for block in blocks])
        _add(piece, "Cells", {**_joined(cells), "types": types})
    else:
        for name, (_, place) in _KINDS.items():
            own = [each for each, block in zip(cells, blocks, strict=True) if block.kind == name]
            piece.set(f"NumberOf{place}", str(sum(map(len, own))))
            _add(piece, place, _joined(own))
    _add(piece, "PointData", _values(blocks, lambda block: block.point_data, counts))
    _add(piece, "CellData", _values(blocks, lambda block: block.cell_data, list(map(len, cells))))
    with replacing(path.resolve()) as temporary:
        ElementTree.ElementTree(root).write(temporary, encoding="utf-8", xml_declaration=True)


def in_space(vectors: FloatArray) -> FloatArray:
    """Return vectors (n, 2) with a third component, zero."""
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _joined(cells: Sequence[IntArray]) -> dict[str, npt.NDArray[np.int64]]:
    """Return the points of all cells, one after the other, and where each of them ends."""
    sizes = [np.full(len(each), each.shape[1]) for each in cells]
    points = np.concatenate([np.zeros(0), *(each.ravel() for each in cells)])
    return {
        "connectivity": points.astype(np.int64),
        "offsets": np.cumsum(np.concatenate([np.zeros(0), *sizes])).astype(np.int64),
    }


def _values(
    blocks: Sequence[Block], of: Callable[[Block], Mapping[str, FloatArray]], counts: Sequence[int]
) -> dict[str, FloatArray]:
    """Return the values of all blocks by name."""
    shapes = {name: values.shape[1:] for block in blocks for name, values in of(block).items()}
    return {
        name: np.concatenate(
            [of(block).get(name, np.full((n, *shape), np.nan)) for block, n in zip(blocks, counts, strict=True)]
        )
        for name, shape in shapes.items()
    }


def _add(piece: ElementTree.Element[str], place: str, arrays: Mapping[str, npt.NDArray[np.generic]]) -> None:
    parent = ElementTree.SubElement(piece, place)
    for name, array in arrays.items():
        width = {} if array.ndim == 1 else {"NumberOfComponents": str(array.shape[1])}
        entry = ElementTree.SubElement(
            parent, "DataArray", type=_TYPES[array.dtype.name], Name=name, format="binary", attrib=width
        )
        data = np.ascontiguousarray(array, array.dtype.newbyteorder("<")).tobytes()
        entry.text = b64encode(len(data).to_bytes(8, "little") + data).decode("ascii")


def bodies_of(solution: Solution | AssemblySolution) -> Mapping[str, Solution | BodyResult]:
    """Return the bodies of a solution by the prefix of their arrays."""
    if isinstance(solution, Solution):
        return {"": solution}
    return {f"{name}/": body for name, body in solution.bodies.items()}


def write_vtk(path: Path, solution: Solution | AssemblySolution, inside: int = 0) -> None:
    """Write a .vtu or .vtp file.

    Parameters
    ----------
    path : Path
    solution : Solution or AssemblySolution
    inside : int
        Points across each body at which there are fields inside; 0 for none.

    Notes
    -----
    Point data: ``displacement`` [m] of boundaries and inside; ``stress`` [Pa], the nine components of the tensor row by
    row, and ``von_mises`` [Pa] inside; ``u_n``, ``u_t``, ``slip``, ``sigma_n``, ``sigma_t``, ``gap``, ``clearance``,
    ``status`` (`NodeStatus` values) and ``weight`` at contact nodes, where ``slip`` is u_t of nodes that touch. Cell
    data: ``traction`` [Pa] of lines and ``body``, its number. What is not defined somewhere is not a number there.
    """
    bodies = list(bodies_of(solution).values())
    blocks = [_boundary(body, number) for number, body in enumerate(bodies)]
    blocks.append(_contact_nodes(solution))
    if inside:
        blocks += [_inside(body, number, inside) for number, body in enumerate(bodies)]
    write_vtk_xml(path, blocks)


def _boundary(body: Solution | BodyResult, number: int) -> Block:
    """Return the boundary of a body as lines, each element sampled by itself."""
    mesh, space = body.mesh, body.scene.discretisation.displacement_space(body.mesh)
    n_points = 2 if space.degree <= 1 and bool(mesh.is_straight.all()) else _POINTS_OF_CURVE
    xi = np.linspace(-1.0, 1.0, n_points)
    points = mesh.points(np.arange(mesh.n_elements), xi).reshape(-1, 2)
    at_nodes = values_on_elements(space, body.boundary.displacement)
    values = np.einsum("pq,epc->eqc", space.basis(xi), at_nodes).reshape(-1, 2)
    start = (n_points * np.arange(mesh.n_elements)[:, None] + np.arange(n_points - 1)).ravel()
    traction = in_space(np.repeat(body.boundary.traction, n_points - 1, axis=0))
    of_body = np.full(len(start), float(number))
    lines = np.stack([start, start + 1], axis=1)
    return Block("line", points, lines, {"displacement": in_space(values)}, {"traction": traction, "body": of_body})


def _contact_nodes(solution: Solution | AssemblySolution) -> Block:
    table = solution.contact
    values = {name: np.asarray(getattr(table, name), float) for name in _CONTACT}
    values["slip"] = np.where(table.status == NodeStatus.SEPARATED, np.nan, table.u_t)
    nodes = np.arange(table.n_contact)[:, None]
    return Block("vertex", np.stack([table.x, table.y], axis=1), nodes, values, {})


def _inside(body: Solution | BodyResult, number: int, across: int) -> Block:
    """Return the squares of a grid whose corners lie inside a body, clear of its boundary; none without an end."""
    mesh = body.mesh.whole
    if mesh.is_exterior or mesh.surface is not None:
        return Block("quad", np.zeros((0, 2)), np.zeros((0, 4), np.intp), {}, {})
    low, size = mesh.nodes.min(axis=0), np.ptp(mesh.nodes, axis=0)
    step = float(size.max()) / (across - 1)
    n = np.maximum(np.ceil(size / step).astype(int), 1) + 1
    x, y = (low[k] + 0.5 * (size[k] - step * (n[k] - 1)) + step * np.arange(n[k]) for k in range(2))
    grid = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    fields = interior_fields(body)
    is_kept = fields.is_inside(grid)
    is_kept[is_kept] = _is_clear(mesh.centres, mesh.lengths, grid[is_kept])
    corner = np.arange(len(grid)).reshape(n[1], n[0])
    squares = np.stack([corner[:-1, :-1], corner[:-1, 1:], corner[1:, 1:], corner[1:, :-1]], axis=-1).reshape(-1, 4)
    squares = squares[is_kept[squares].all(axis=1)]
    used, cells = np.unique(squares, return_inverse=True)
    points = grid[used]
    if not len(points):
        return Block("quad", points, np.zeros((0, 4), np.intp), {}, {})
    stress, material = fields.stress(points), body.scene.material
    tensor = np.zeros((len(points), 3, 3))
    tensor[:, :2, :2] = stress
    if material.plane is Plane.STRAIN:
        tensor[:, 2, 2] = material.poisson_ratio * (stress[:, 0, 0] + stress[:, 1, 1])
    values = {
        "displacement": in_space(fields.displacement(points)),
        "stress": tensor.reshape(-1, 9),
        "von_mises": von_mises(stress, material.poisson_ratio, material.plane),
    }
    of_body = np.full(len(squares), float(number))
    return Block("quad", points, cells.reshape(-1, 4).astype(np.intp), values, {"body": of_body})


def _is_clear(centres: FloatArray, lengths: FloatArray, points: FloatArray) -> BoolArray:
    """Return which points are farther from every element than its half length; centres represent elements."""
    from scipy.spatial import cKDTree

    reach = (0.5 + _CLEAR) * lengths
    near = cKDTree(points).query_ball_point(centres, reach)
    is_clear = np.ones(len(points), bool)
    is_clear[[k for own in near for k in own]] = False
    return is_clear
