"""XML files of VTK: unstructured grids (.vtu) and polygonal data (.vtp).

Arrays stand in the file in base64, each behind the number of its bytes; see "VTK XML file formats" in the
documentation of VTK.
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

_KINDS = {"vertex": (1, "Verts"), "line": (3, "Lines"), "quad": (9, "Polys")}
"""Cells in the order that polygonal data want: the number of their type in grids, their place in polygonal data."""
_TYPES = {"float64": "Float64", "int64": "Int64", "uint8": "UInt8"}


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
