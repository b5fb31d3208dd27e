"""Profiles from files: text of two columns, or files of instruments read by SurfaceTopography."""

from __future__ import annotations

import importlib.util
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError, printable

LARGEST_STEP = 5.0
"""Largest distance of two neighbours, relative to the median step; at larger distances points are missing."""


class ProfileError(InputError):
    """A file contains no profile; the message gives the file, the line and the remedy."""


@dataclass(frozen=True)
class ReadProfile:
    """Content of a file.

    Parameters
    ----------
    x, heights : (n,) arrays
        Increasing positions, and heights, in the unit of the file.
    unit : str
        Unit of length from the file; empty if it has none.
    """

    x: FloatArray
    heights: FloatArray
    unit: str = ""


def read_profile(file: str | Path, row: int | None = None) -> ReadProfile:
    """Read a profile; see `bemkit.contact.rough_profile.Profile`.

    Parameters
    ----------
    file : str or Path
        Text of two columns. Other files are read as files of instruments, with lengths in metres.
    row : int, optional
        Row of a map of heights, counted from 0 along y.

    Raises
    ------
    ProfileError
    """
    name = printable(str(file))
    try:
        content = Path(file).read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ProfileError(f"{name}: cannot be read ({reason}): give a text file of two columns") from error
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError:
        return _read_instrument(name, Path(file), row)
    return _read_instrument(name, Path(file), row) if "\0" in text else _read_text(name, text, row)


def _read_text(name: str, text: str, row: int | None) -> ReadProfile:
    if row is not None:
        raise ProfileError(f"{name}: row is {row}, but the file is one profile: remove row")
    rows: list[tuple[float, float]] = []
    numbers: list[int] = []
    for number, line in enumerate(text.splitlines(), start=1):
        cells = _cells(line)
        if not cells or cells[0].startswith("#") or (not rows and number == 1 and not _is_number(cells[0])):
            continue
        if len(cells) != 2 or not all(map(_is_number, cells)):
            raise ProfileError(
                f"{name}: line {number} is {printable(line.strip())[:60]!r}: give two finite numbers, position and "
                "height; if a height is unknown, cut the profile there or fill it in"
            )
        rows.append((float(cells[0]), float(cells[1])))
        numbers.append(number)
    if len(rows) < 2:
        raise ProfileError(f"{name}: has {len(rows)} points: give at least two lines of position and height")
    x, heights = np.array(rows).T
    steps = np.diff(x)
    if steps[k := int(np.argmin(steps))] <= 0.0:
        raise ProfileError(
            f"{name}: line {numbers[k + 1]}: the position {x[k + 1]:.6g} comes after {x[k]:.6g}: sort the lines by "
            "position, and remove repeated points"
        )
    if steps[k := int(np.argmax(steps))] > LARGEST_STEP * float(np.median(steps)):
        raise ProfileError(
            f"{name}: line {numbers[k + 1]}: no points between {x[k]:.6g} and {x[k + 1]:.6g}, "
            f"{steps[k] / np.median(steps):.3g} usual steps: cut the profile there or fill the gap"
        )
    return ReadProfile(x, heights)


def _cells(line: str) -> list[str]:
    """Split a line into cells; a cell between two separators may be empty."""
    for separator in (",", ";"):
        if separator in line:
            return [cell.strip() for cell in line.split(separator)]
    return line.split()


def _is_number(cell: str) -> bool:
    try:
        return math.isfinite(float(cell))
    except ValueError:
        return False


def _read_instrument(name: str, path: Path, row: int | None) -> ReadProfile:
    """Read a line scan, or a row of a map of heights, in metres if the file has a unit."""
    if importlib.util.find_spec("SurfaceTopography") is None:
        raise ProfileError(
            f"{name}: is not a text of two columns; files of instruments need SurfaceTopography: "
            'pip install "bemkit[surface]"'
        )
    from SurfaceTopography import open_topography

    try:
        with path.open("rb") as stream:
            scan = open_topography(stream).topography()
            unit = scan.unit or ""
            scan = scan.to_unit("m") if unit else scan
            x, heights = scan.positions_and_heights() if scan.dim == 1 else (scan.positions()[0], scan.heights())
    except Exception as error:  # readers of forty formats raise many kinds of errors
        raise ProfileError(
            f"{name}: SurfaceTopography cannot read it ({printable(str(error))[:200] or type(error).__name__}): export "
            "it as text of two columns"
        ) from error
    if scan.dim == 1 and row is not None:
        raise ProfileError(f"{name}: row is {row}, but the file is one profile: remove row")
    if scan.dim == 2:
        if row is None or not 0 <= row < heights.shape[1]:
            raise ProfileError(
                f"{name}: row is {row}: the file is a map of {heights.shape[0]} x {heights.shape[1]} heights: give the "
                f"row of a profile, from 0 to {heights.shape[1] - 1}"
            )
        x, heights = x[:, row], heights[:, row]
    if missing := int(np.count_nonzero(np.ma.getmaskarray(heights))):
        raise ProfileError(f"{name}: {missing} of {heights.size} heights are unknown: fill them in")
    return ReadProfile(np.asarray(x, float), np.asarray(heights, float), "m" if unit else "")
