"""Stability rows in files: HDF5 that is complete after every row, CSV, and Markdown tables."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import asdict, fields
from pathlib import Path

import numpy as np

from bemkit.files import check_target
from bemkit.hdf5 import ResultFileError, created, opened, write_attributes, write_table, write_text
from bemkit.io import provenance
from bemkit.stability.cases import Axis
from bemkit.stability.sweep import Row

FORMAT = "bemkit-stability"
SCHEMA_VERSION = 1
CSV_START = "axis,value,verdict,status,"
MARKDOWN_START = "### "

_TEXTS = ("axis", "verdict", "status", "message")
_COUNTS = ("linear_solves",)
_NUMBERS = tuple(field.name for field in fields(Row) if field.name not in (*_TEXTS, *_COUNTS))
_MAX_SCENE = 1_000_000


def check_rows_target(path: str | Path) -> Path:
    """Find out, before any work is done, whether rows can be written to a file; see `bemkit.files.check_target`."""
    return check_target(Path(path), "bemkit stability file", _is_own)


def write_rows(path: str | Path, scene: str, rows: Sequence[Row]) -> None:
    """Write rows to an HDF5 file, replacing an older one at once or not at all.

    Parameters
    ----------
    path : str or Path
    scene : str
        The baseline as TOML.
    rows : sequence of Row

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file that is not a bemkit stability file stands in the way.
    """
    target = check_rows_target(path)
    with created(target) as file:
        write_attributes(file, {"format": FORMAT, "schema_version": SCHEMA_VERSION})
        write_text(file, "scene", scene)
        write_attributes(file.create_group("provenance"), provenance())
        columns = {name: [getattr(row, name) for row in rows] for name in _TEXTS}
        numbers = {name: np.array([getattr(row, name) for row in rows], dtype=float) for name in _NUMBERS}
        counts = {name: np.array([getattr(row, name) for row in rows], dtype=np.int64) for name in _COUNTS}
        write_table(file.create_group("rows"), columns | numbers | counts)


def read_rows(path: str | Path) -> tuple[str, tuple[Row, ...]]:
    """Read the scene (TOML) and the rows of a stability file.

    Raises
    ------
    ResultFileError
        If the file is not a complete stability file of a known version.
    """
    with opened(Path(path), made_by="bemkit stability -o") as reader:
        marks = reader.attributes("/")
        if marks.get("format") != FORMAT:
            raise reader.error("an HDF5 file, but not of 'bemkit stability -o': choose another name")
        if marks.get("schema_version") != SCHEMA_VERSION:
            raise reader.error(
                f"has layout version {marks.get('schema_version')}, this bemkit reads version {SCHEMA_VERSION}: "
                "use the bemkit that wrote it, or delete it to begin anew"
            )
        scene = reader.text("scene", _MAX_SCENE)
        columns = reader.table("rows", texts=_TEXTS, floats=_NUMBERS, integers=_COUNTS)
        values = zip(*columns.values(), strict=True)
        rows = tuple(_row(dict(zip(columns, row, strict=True))) for row in values)
        reader.check_seal()
    return scene, rows


def finished_rows(path: str | Path, scene: str) -> dict[tuple[str, float], Row]:
    """Return the rows of an earlier sweep of the same scene, nothing if there is no file.

    Raises
    ------
    ResultFileError
        If the file cannot be read, or belongs to another scene.
    """
    if not Path(path).exists():
        return {}
    earlier, rows = read_rows(path)
    if earlier != scene:
        raise ResultFileError(f"{path}: holds the sweep of another scene: choose another name or delete it first")
    return {(row.axis, row.value): row for row in rows}


def to_csv(rows: Iterable[Row]) -> str:
    """Return the rows as comma-separated values with a header line."""
    stream = io.StringIO()
    writer = csv.DictWriter(stream, [field.name for field in fields(Row)], lineterminator="\n")
    writer.writeheader()
    writer.writerows(asdict(row) for row in rows)
    return stream.getvalue()


def to_markdown(axes: Sequence[Axis], rows: Sequence[Row]) -> str:
    """Return one Markdown table for each axis; run times are left out, so that equal results make equal text."""
    head = ("verdict", "status", "solves", "certificate", "check", "Betti", "condition", "drift", "twin")
    lines = []
    for axis in axes:
        lines += [f"{MARKDOWN_START}{axis.name}", "", f"Promise: {axis.promise}.", ""]
        lines += [f"| {axis.label} | {' | '.join(head)} |", "|---:|---|---|" + "---:|" * (len(head) - 2)]
        lines += [f"| {' | '.join(cells(row))} |" for row in rows if row.axis == axis.name]
        lines.append("")
    return "\n".join(lines)


def cells(row: Row) -> list[str]:
    """Return the entries of a row as short texts: value, verdict, status, linear solves, then the numbers."""
    numbers = (row.certificate, row.check, row.reciprocity, row.condition, row.drift, row.twin)
    solves = str(row.linear_solves) if row.linear_solves else ""
    return [f"{row.value:.8g}", row.verdict, row.status.replace("_", " "), solves, *(_short(x) for x in numbers)]


def _short(value: float) -> str:
    return "" if np.isnan(value) else f"{value:.0e}"


def _row(values: dict[str, object]) -> Row:
    texts = {name: str(values[name]) for name in _TEXTS}
    counts = {name: int(values[name]) for name in _COUNTS}  # type: ignore[call-overload]
    return Row(**texts, **counts, **{name: float(values[name]) for name in _NUMBERS})  # type: ignore[arg-type]


def _is_own(path: Path) -> bool:
    try:
        read_rows(path)
    except ResultFileError:
        return False
    return True
