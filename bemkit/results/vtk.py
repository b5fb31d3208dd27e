"""Results for ParaView and the like: boundaries as lines, contact nodes as vertices, triangles inside.

The files are unstructured grids in the XML of VTK. Arrays are written in base64, each behind the number of its bytes;
see "VTK XML file formats" in the documentation of VTK.
"""

from __future__ import annotations

from base64 import b64encode
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import numpy.typing as npt

from bemkit.arrays import FloatArray, IntArray
from bemkit.atomic_files import replacing
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.neighbours import drawn_points
from bemkit.geometry.proximity.location import Locator
from bemkit.operators.material import Material, Plane
from bemkit.operators.somigliana.stress import von_mises
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.stress_mesh import stress_mesh

_CELL_TYPES = {"vertex": 1, "line": 3, "triangle": 5}
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}
_CONTACT = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "status", "weight")


@dataclass(frozen=True)
class Block:
    """Points (n, 2), cells (m, k) of them, and values at both; missing values are not a number.

    Cells are of the kind vertex, line or triangle.
    """

    kind: str
    points: FloatArray
    cells: IntArray
    point_data: Mapping[str, FloatArray]
    cell_data: Mapping[str, FloatArray]


def write_vtk_xml(path: Path, blocks: Sequence[Block]) -> None:
    """Write blocks of cells into a file.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    """
    blocks = [block for block in blocks if len(block.cells)]
    counts = [len(block.points) for block in blocks]
    starts = (np.cumsum(counts) - counts).tolist()
    cells = [block.cells + start for block, start in zip(blocks, starts, strict=True)]
    kind = "UnstructuredGrid"
    root = ElementTree.Element("VTKFile", type=kind, version="1.0", byte_order="LittleEndian", header_type="UInt64")
    piece = ElementTree.SubElement(ElementTree.SubElement(root, kind), "Piece", NumberOfPoints=str(sum(counts)))
    _add(piece, "Points", {"Points": in_space(np.concatenate([block.points for block in blocks]))})
    piece.set("NumberOfCells", str(sum(map(len, cells))))
    types = np.concatenate([np.full(len(block.cells), _CELL_TYPES[block.kind], np.uint8) for block in blocks])
    _add(piece, "Cells", {**_joined(cells), "types": types})
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


def write_vtk(path: Path, solution: Solution, inside: int = 0) -> None:
    """Write a .vtu file.

    Parameters
    ----------
    path : Path
    solution : Solution
    inside : int
        Points across each body at which there are fields inside; 0 for none.

    Notes
    -----
    Point data: ``displacement`` [m], ``stress`` [Pa], the nine components of the tensor row by row, and ``von_mises``
    [Pa] everywhere; ``u_n``, ``u_t``, ``slip``, ``sigma_n``, ``sigma_t``, ``gap``, ``clearance``, ``status``
    (`NodeStatus` values) and ``weight`` at contact nodes, where ``slip`` is u_t of nodes that touch. Cell data:
    ``traction`` [Pa] of lines and ``body``, its number. What is not defined somewhere is not a number there. Triangles
    end at the boundary; an exterior and a half-plane are cut at half their size from it.
    """
    bodies = list(solution.bodies.values())
    blocks = [_contact_nodes(solution, bodies)] if solution.contact.n_contact else []
    blocks += [_boundary(body, number) for number, body in enumerate(bodies)]
    if inside:
        blocks += [_inside(body, number, inside) for number, body in enumerate(bodies)]
    write_vtk_xml(path, blocks)


def _boundary(body: SolvedBody, number: int) -> Block:
    """Return the boundary of a body as lines, each element sampled by itself."""
    mesh, space = body.mesh, body.scene.discretisation.displacement_space(body.mesh)
    xi = drawn_points(mesh, space.degree)
    n_points = xi.size
    points = mesh.points(np.arange(mesh.n_elements), xi).reshape(-1, 2)
    at_nodes = values_on_elements(space, body.boundary.displacement)
    moved = np.einsum("pq,epc->eqc", space.basis(xi), at_nodes).reshape(-1, 2)
    stress = body.boundary_stress.at(np.arange(mesh.n_elements), xi).reshape(-1, 2, 2)
    start = (n_points * np.arange(mesh.n_elements)[:, None] + np.arange(n_points - 1)).ravel()
    cells = {
        "traction": in_space(np.repeat(body.boundary.traction, n_points - 1, axis=0)),
        "body": np.full(len(start), float(number)),
    }
    return Block(
        "line", points, np.stack([start, start + 1], axis=1), _fields(body.scene.material, moved, stress), cells
    )


def _fields(material: Material, displacement: FloatArray, stress: FloatArray) -> dict[str, FloatArray]:
    """Return displacement, stress tensors in space and equivalent stress of points (n,) by their names."""
    tensor = np.zeros((len(stress), 3, 3))
    tensor[:, :2, :2] = stress
    if material.plane is Plane.STRAIN:
        tensor[:, 2, 2] = material.poisson_ratio * (stress[:, 0, 0] + stress[:, 1, 1])
    return {
        "displacement": in_space(displacement),
        "stress": tensor.reshape(-1, 9),
        "von_mises": von_mises(stress, material.poisson_ratio, material.plane),
    }


def _contact_nodes(solution: Solution, bodies: Sequence[SolvedBody]) -> Block:
    table = solution.contact
    points = table.points
    values = {name: np.asarray(getattr(table, name), float) for name in _CONTACT}
    values["slip"] = np.where(table.is_closed, table.u_t, np.nan)
    nearest = np.full(len(points), np.inf)
    on_bodies: dict[str, FloatArray] = {}
    for body in bodies:
        boundary = body.boundary_stress
        location = Locator(boundary.mesh).locate(points)
        element, xi = location.element, location.xi[:, None]
        moved, stress = boundary.displacement_at(element, xi)[:, 0], boundary.at(element, xi)[:, 0]
        is_closer = location.distance < nearest
        nearest = np.minimum(nearest, location.distance)
        for name, field in _fields(body.scene.material, moved, stress).items():
            is_new = is_closer.reshape(-1, *[1] * (field.ndim - 1))
            on_bodies[name] = np.where(is_new, field, on_bodies.get(name, field))
    return Block("vertex", points, np.arange(table.n_contact)[:, None], values | on_bodies, {})


def _inside(body: SolvedBody, number: int, across: int) -> Block:
    """Return triangles that fill a body."""
    mesh = body.mesh.whole
    low, high = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    size = float((high - low).max())
    spare = 0.5 * size if mesh.is_exterior else 0.0
    filled = stress_mesh(body, size / (across - 1), np.stack([low - spare, high + spare], axis=1))
    values = _fields(body.scene.material, filled.displacement, filled.stress)
    return Block(
        "triangle", filled.points, filled.triangles, values, {"body": np.full(len(filled.triangles), float(number))}
    )
