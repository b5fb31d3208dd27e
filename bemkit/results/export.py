"""Results in the format of the ending of a file name: .h5, .json, .csv, .npz, .vtu."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.atomic_files import OutputFileError, check_target, replacing, write_text
from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.results.tables import to_csv, to_json

MOST_ACROSS = 1000
"""Points across a body at most, a million in all."""


@dataclass(frozen=True)
class Format:
    """A format of result files.

    Parameters
    ----------
    check : callable
        Path -> the file, if it can be written, before any work is done.
    write : callable
        Path, solution and number of points across a body, zero without fields inside -> None.
    holds_inside : bool
        Whether it holds fields inside.
    """

    check: Callable[[Path], Path]
    write: Callable[[Path, Solution, int], None]
    holds_inside: bool = False


def format_of(path: str | Path, inside: int = 0) -> Format:
    """Return the format of the ending of a file name.

    Parameters
    ----------
    path : str or Path
    inside : int
        See `export_result`.

    Raises
    ------
    OutputFileError
        If the ending is unknown, naming those there are, or the format holds no fields inside that are asked for.
    """
    if str(path) == "-":
        raise OutputFileError("- is standard output, which cannot take a result: give a file name")
    ending = Path(path).suffix.lower()
    if ending not in FORMATS:
        known = ", ".join(FORMATS)
        raise OutputFileError(f"{path}: the ending {ending!r} names no format of results: give one of {known}")
    chosen = FORMATS[ending]
    if inside and not chosen.holds_inside:
        raise OutputFileError(f"{path}: {ending} holds no fields inside the body: give .vtu, or no inside")
    if inside and not 2 <= inside <= MOST_ACROSS:
        raise OutputFileError(f"{path}: inside is {inside}: give from 2 to {MOST_ACROSS} points across the body")
    return chosen


def export_result(path: str | Path, solution: Solution, *, inside: int = 0) -> None:
    """Write a solution in the format of the file ending, completely or not at all.

    Parameters
    ----------
    path : str or Path
        ``.h5`` or ``.hdf5``: everything, see `bemkit.results.result_file`; ``.json``: the summary; ``.csv``: the
        contact table; ``.npz``: contact table and fields on boundaries as numpy arrays; ``.vtu``: boundaries as lines
        with displacement and traction, contact nodes as vertices, for ParaView and the like.
    solution : Solution
    inside : int
        Points across each body, along its longer extent, on which they hold displacement and stress inside; 0 for
        none.

    Raises
    ------
    OutputFileError
        If the ending is unknown, or the file cannot be written.
    """
    chosen = format_of(path, inside)
    chosen.write(chosen.check(Path(path)), solution, inside)


def to_pyvista(solution: Solution, inside: int) -> Any:
    """Return what a ``.vtu`` file holds as a grid of pyvista.

    Raises
    ------
    InputError
        If pyvista is not installed, or `inside` is neither 0 nor from 2 to 1000.
    """
    try:
        import pyvista
    except ImportError:
        raise InputError('grids of pyvista need it: pip install "bemkit[viz]"') from None
    with TemporaryDirectory() as folder:
        path = Path(folder, "result.vtu")
        export_result(path, solution, inside=inside)
        return pyvista.read(path)


def boundary_arrays(solution: Solution) -> dict[str, FloatArray | IntArray]:
    """Return the contact table and the fields on boundaries by name; of several bodies as ``"body/field"``."""
    table = solution.contact
    arrays: dict[str, Any] = {f"contact/{name}": column for name, column in table.columns().items()}
    arrays["contact/part"] = np.array(table.part, dtype=str)
    for name, body in solution.bodies.items():
        prefix, fields = f"{name}/" if name else "", body.boundary
        arrays |= {f"{prefix}nodes": body.mesh.nodes, f"{prefix}elements": body.mesh.elements}
        for field in ("points", "displacement", "centres", "traction", "traction_dofs", "reaction"):
            arrays[prefix + field] = getattr(fields, field)
    return arrays


def _write_npz(path: Path, solution: Solution, inside: int) -> None:
    with replacing(path.resolve()) as temporary, temporary.open("wb") as stream:
        np.savez_compressed(stream, **boundary_arrays(solution))  # type: ignore[arg-type]  # names of arrays


def _write_vtu(path: Path, solution: Solution, inside: int) -> None:
    from bemkit.results.vtk import write_vtk

    write_vtk(path, solution, inside)


def _check_hdf5(path: Path) -> Path:
    from bemkit.results.result_file import check_result_target

    return check_result_target(path)


def _write_hdf5(path: Path, solution: Solution, inside: int) -> None:
    from bemkit.results.result_file import write_result

    write_result(path, solution)


def _text(text: Callable[[Solution], str]) -> Format:
    return Format(check_target, lambda path, solution, inside: write_text(path, text(solution)))


_HDF5 = Format(_check_hdf5, _write_hdf5)
FORMATS: Mapping[str, Format] = MappingProxyType(
    {
        ".h5": _HDF5,
        ".hdf5": _HDF5,
        ".json": _text(to_json),
        ".csv": _text(lambda each: to_csv(each, "contact")),
        ".npz": Format(check_target, _write_npz),
        ".vtu": Format(check_target, _write_vtu, holds_inside=True),
    }
)
"""By ending."""
