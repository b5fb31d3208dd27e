"""Stability rows in files: HDF5 that is complete after every row, CSV, and Markdown tables."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import astuple, fields
from pathlib import Path

import numpy as np

from bemkit.results.record_file import RowFile, csv_text
from bemkit.studies.stability.cases import Axis
from bemkit.studies.stability.sweep import Row

FILE = RowFile("bemkit-stability", 1, "bemkit stability", Row, ("scene",))
CSV_START = "axis,value,verdict,status,"
MARKDOWN_START = "### "


def write_rows(path: str | Path, scene: str, rows: Sequence[Row]) -> None:
    """Write rows and the baseline as TOML to an HDF5 file; see `bemkit.results.record_file.RowFile.write`."""
    FILE.write(path, {"scene": scene}, rows)


def read_rows(path: str | Path) -> tuple[str, tuple[Row, ...]]:
    """Read the scene (TOML) and the rows of a stability file; see `bemkit.results.record_file.RowFile.read`."""
    labels, rows = FILE.read(path)
    return labels["scene"], rows


def finished_rows(path: str | Path, scene: str) -> dict[tuple[str, float], Row]:
    """Return the rows of an earlier sweep of the same scene; see `bemkit.results.record_file.RowFile.finished`."""
    return {(row.axis, row.value): row for row in FILE.finished(path, {"scene": scene})}


def to_csv(rows: Iterable[Row]) -> str:
    """Return the rows as comma-separated values with a header line."""
    return csv_text([field.name for field in fields(Row)], map(astuple, rows))


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
