"""Rows of a long sweep in an HDF5 file that is complete after every row, so that a stopped sweep can go on."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, TypeVar, get_type_hints

import numpy as np

from bemkit.atomic_files import check_target
from bemkit.hdf5 import ResultFileError, created, opened, write_attributes, write_table, write_text
from bemkit.results.result_file import provenance

_MAX_LABEL = 1_000_000

Row = TypeVar("Row")
"""A frozen dataclass whose fields are texts, floats and whole numbers."""


@dataclass(frozen=True)
class RowFile(Generic[Row]):
    """A kind of file: labels that say what was swept, and rows.

    Parameters
    ----------
    format : str
        Mark by which such files are recognised.
    version : int
        Of the layout.
    command : str
        That writes such files, for messages.
    row : type
        Of the rows.
    labels : tuple of str
        Names of the texts.
    """

    format: str
    version: int
    command: str
    row: type[Row]
    labels: tuple[str, ...]

    def check_target(self, path: str | Path) -> Path:
        """Find out, before any work is done, whether rows can be written; see `bemkit.atomic_files.check_target`."""
        return check_target(Path(path), f"{self.command} file", self._is_own)

    def write(self, path: str | Path, labels: Mapping[str, str], rows: Sequence[Row]) -> None:
        """Write labels and rows, replacing an older file at once or not at all.

        Raises
        ------
        OutputFileError
            If the file cannot be written, or a file of another kind stands in the way.
        """
        target = self.check_target(path)
        with created(target) as file:
            write_attributes(file, {"format": self.format, "schema_version": self.version})
            for name in self.labels:
                write_text(file, name, labels[name])
            write_attributes(file.create_group("provenance"), provenance())
            write_table(file.create_group("rows"), {name: self._column(name, rows) for name in self._types})

    def read(self, path: str | Path) -> tuple[dict[str, str], tuple[Row, ...]]:
        """Read labels and rows.

        Raises
        ------
        ResultFileError
            If the file is not a complete file of this kind and version.
        """
        with opened(Path(path), made_by=f"{self.command} -o") as reader:
            marks = reader.attributes("/")
            if marks.get("format") != self.format:
                raise reader.error(f"an HDF5 file, but not of '{self.command} -o': choose another name")
            if marks.get("schema_version") != self.version:
                raise reader.error(
                    f"has layout version {marks.get('schema_version')}, this bemkit reads version {self.version}: "
                    "use the bemkit that wrote it, or delete it to begin anew"
                )
            labels = {name: reader.text(name, _MAX_LABEL) for name in self.labels}
            types = self._types
            columns = reader.table(
                "rows",
                texts=[name for name in types if types[name] is str],
                floats=[name for name in types if types[name] is float],
                integers=[name for name in types if types[name] is int],
            )
            rows = tuple(
                self.row(**{name: types[name](value) for name, value in zip(columns, values, strict=True)})
                for values in zip(*columns.values(), strict=True)
            )
        return labels, rows

    def finished(self, path: str | Path, labels: Mapping[str, str]) -> tuple[Row, ...]:
        """Return the rows of an earlier sweep under the same labels, nothing if there is no file.

        Raises
        ------
        ResultFileError
            If the file cannot be read, or its labels differ.
        """
        if not Path(path).exists():
            return ()
        earlier, rows = self.read(path)
        for name in self.labels:
            if earlier[name] != labels[name]:
                # scenes and the like are too long to be shown
                is_long = "\n" in earlier[name] + labels[name]
                what = f"of another {name}" if is_long else f"with {name} {earlier[name]}, not {labels[name]}"
                raise ResultFileError(f"{path}: holds the sweep {what}: choose another name or delete it first")
        return rows

    @property
    def _types(self) -> dict[str, Any]:
        return get_type_hints(self.row)

    def _column(self, name: str, rows: Sequence[Row]) -> Any:
        values = [getattr(row, name) for row in rows]
        kind = self._types[name]
        return values if kind is str else np.array(values, dtype=np.int64 if kind is int else float)

    def _is_own(self, path: Path) -> bool:
        try:
            self.read(path)
        except ResultFileError:
            return False
        return True


def csv_text(head: Sequence[str], lines: Iterable[Sequence[Any]]) -> str:
    """Return a header line and lines of values as comma-separated values."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(lines)
    return stream.getvalue()
