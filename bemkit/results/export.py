"""Results in the format that the ending of a file name asks for: .h5, .json, .csv, .npz, .vtu."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.outputs import JSON_START, STDOUT, begins_with, write_text
from bemkit.results.solution import Solution
from bemkit.results.tables import CSV_STARTS, to_csv, to_json

_POINTS_OF_CURVE = 9
"""Points of an element whose displacement or shape is curved."""
_CONTACT = ("u_n", "u_t", "sigma_n", "sigma_t", "gap", "clearance", "status", "weight")


@dataclass(frozen=True)
class Format:
    """A format of result files.

    Parameters
    ----------
    check : callable
        Path -> the file, if it can be written, before any work is done.
    write : callable
        Path and solution -> None.
    """

    check: Callable[[Path], Path]
    write: Callable[[Path, Solution | AssemblySolution], None]


def format_of(path: str | Path) -> Format:
    """Return the format that the ending of a file name asks for.

    Raises
    ------
    OutputFileError
        If the ending is unknown, naming those there are, or a package is missing.
    """
    if str(path) == STDOUT:
        raise OutputFileError("- is standard output, which cannot take a result: give a file name")
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        known = ", ".join(FORMATS)
        raise OutputFileError(f"{path}: the ending {ending!r} names no format of results: give one of {known}")
    return FORMATS[ending]


def export_result(path: str | Path, solution: Solution | AssemblySolution) -> None:
    """Write a solution in the format that the ending of the file name asks for, all or nothing.

    Parameters
    ----------
    path : str or Path
        ``.h5`` or ``.hdf5``: everything, see `bemkit.results.result_file`; ``.json``: the summary; ``.csv``: the
        contact table; ``.npz``: contact table and fields on boundaries as numpy arrays; ``.vtu``: boundaries as lines
        with displacement and traction, contact nodes as vertices, for ParaView and the like (needs meshio).
    solution : Solution or AssemblySolution

    Raises
    ------
    OutputFileError
        If the ending is unknown, a package is missing, the file cannot be written, or one of another kind stands in
        the way.
    """
    chosen = format_of(path)
    chosen.write(chosen.check(Path(path)), solution)


def boundary_arrays(solution: Solution | AssemblySolution) -> dict[str, FloatArray | IntArray]:
    """Return the contact table and the fields on boundaries by name; of several bodies as ``"body/field"``."""
    table = solution.contact
    arrays: dict[str, Any] = {f"contact/{name}": column for name, column in table.columns().items()}
    arrays["contact/part"] = np.array(table.part, dtype=str)
    for prefix, body in _bodies(solution).items():
        fields = body.boundary
        arrays |= {f"{prefix}nodes": body.mesh.nodes, f"{prefix}elements": body.mesh.elements}
        for name in ("points", "displacement", "centres", "traction", "traction_dofs"):
            arrays[prefix + name] = getattr(fields, name)
    return arrays


def _bodies(solution: Solution | AssemblySolution) -> Mapping[str, Solution | BodyResult]:
    if isinstance(solution, Solution):
        return {"": solution}
    return {f"{name}/": body for name, body in solution.bodies.items()}


def _write_npz(path: Path, solution: Solution | AssemblySolution) -> None:
    with replacing(path.resolve()) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **boundary_arrays(solution))  # type: ignore[arg-type]  # names of arrays


def _write_vtu(path: Path, solution: Solution | AssemblySolution) -> None:
    import meshio

    points, lines, moved, tractions, bodies = [], [], [], [], []
    first = 0
    for number, body in enumerate(_bodies(solution).values()):
        own, displacement, pieces = _sampled(body)
        points.append(own)
        moved.append(displacement)
        lines.append(first + pieces)
        n_pieces = len(pieces) // body.mesh.n_elements
        tractions.append(np.repeat(body.boundary.traction, n_pieces, axis=0))
        bodies.append(np.full(len(pieces), number))
        first += len(own)
    table = solution.contact
    n_nodes = table.n_contact
    points.append(np.stack([table.x, table.y], axis=1))
    moved.append(np.full((n_nodes, 2), np.nan))
    vertices = first + np.arange(n_nodes)[:, None]
    point_data = {"displacement": _in_space(np.concatenate(moved))}
    for name in _CONTACT:
        point_data[name] = np.concatenate([np.full(first, np.nan), np.asarray(getattr(table, name), float)])
    cell_data = {
        "traction": [_in_space(np.concatenate(tractions)), np.full((n_nodes, 3), np.nan)],
        "body": [np.concatenate(bodies), np.full(n_nodes, -1)],
    }
    blocks = [("line", np.concatenate(lines)), ("vertex", vertices)]
    kept = blocks if n_nodes else blocks[:1]
    cell_data = {name: values[: len(kept)] for name, values in cell_data.items()}
    mesh = meshio.Mesh(_in_space(np.concatenate(points)), kept, point_data=point_data, cell_data=cell_data)
    with replacing(path.resolve()) as temporary:
        mesh.write(temporary, file_format="vtu")


def _sampled(body: Solution | BodyResult) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return points (n, 2) of a boundary, displacements there, and pieces (m, 2) between them, element by element."""
    mesh, space = body.mesh, body.scene.discretisation.displacement_space(body.mesh)
    n_points = 2 if space.degree <= 1 and bool(mesh.is_straight.all()) else _POINTS_OF_CURVE
    xi = np.linspace(-1.0, 1.0, n_points)
    points = mesh.points(np.arange(mesh.n_elements), xi).reshape(-1, 2)
    values = np.einsum("pq,epc->eqc", space.basis(xi), body.boundary.displacement[space.element_dofs]).reshape(-1, 2)
    start = (n_points * np.arange(mesh.n_elements)[:, None] + np.arange(n_points - 1)).ravel()
    return points, values, np.stack([start, start + 1], axis=1)


def _in_space(vectors: FloatArray) -> FloatArray:
    return np.column_stack([vectors, np.zeros(len(vectors))])


def _check_vtu(path: Path) -> Path:
    if find_spec("meshio") is None:
        raise OutputFileError(f'{path}: .vtu files need meshio: pip install "bemkit[mesh]"')
    return check_target(path, "VTU file", lambda existing: begins_with(existing, "<"))


def _check_hdf5(path: Path) -> Path:
    from bemkit.results.result_file import check_result_target

    return check_result_target(path)


def _write_hdf5(path: Path, solution: Solution | AssemblySolution) -> None:
    from bemkit.results.result_file import write_result

    write_result(path, solution)


def _text(kind: str, start: str, text: Callable[[Solution | AssemblySolution], str]) -> Format:
    def check(path: Path) -> Path:
        return check_target(path, kind, lambda existing: begins_with(existing, start))

    return Format(check, lambda path, solution: write_text(str(path), text(solution)))


_HDF5 = Format(_check_hdf5, _write_hdf5)
FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        ".h5": _HDF5,
        ".hdf5": _HDF5,
        ".json": _text("JSON file", JSON_START, lambda each: to_json(each) + "\n"),
        ".csv": _text("CSV file of the contact table", CSV_STARTS["contact"], lambda each: to_csv(each, "contact")),
        ".npz": Format(lambda path: check_target(path, "NPZ file", lambda old: begins_with(old, "PK")), _write_npz),
        ".vtu": Format(_check_vtu, _write_vtu),
    }
)
"""By ending."""
