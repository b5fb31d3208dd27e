"""Rows of a study in a JSON Lines file, complete after every row: an interrupted study resumes."""

from __future__ import annotations

import json
from collections.abc import Callable, Hashable, Iterable, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Generic, Protocol, TypeVar

from bemkit.atomic_files import OutputFileError, check_target
from bemkit.errors import BemkitError, shown_path

ENDING = ".jsonl"


class RowFileError(BemkitError):
    """A file of rows that cannot be read, or belongs to another study."""


class Record(Protocol):
    """A frozen dataclass whose fields are texts, numbers and tuples of numbers."""

    @property
    def key(self) -> Hashable:
        """Key of a record in its study."""


R = TypeVar("R", bound=Record)


@dataclass(frozen=True)
class RowFile(Generic[R]):
    """A file format: a first line with labels of the study, then a line for each row.

    Parameters
    ----------
    format : str
        Name of the format, with its version.
    record : type
        Of the rows.
    labels : tuple of str
        Names of the texts.
    """

    format: str
    record: type[R]
    labels: tuple[str, ...]

    def check(self, path: str | Path | None) -> list[Path]:
        """Check, before any computation, that rows can be written; return the file, if any.

        Raises
        ------
        OutputFileError, RowFileError
        """
        if path is None:
            return []
        if Path(path).is_file():
            self.read(path)
        if Path(path).suffix.lower() != ENDING:
            raise OutputFileError(f"{path}: rows are kept as JSON Lines: give a name that ends in {ENDING}")
        return [check_target(Path(path))]

    def read(self, path: str | Path) -> tuple[dict[str, str], tuple[R, ...]]:
        """Read labels and rows; a last line without its end was cut off and is not a row.

        Raises
        ------
        RowFileError
            If the file is not of this kind and version.
        """
        shown = shown_path(Path(path))
        try:
            first, *lines = Path(path).read_text("utf-8").split("\n")[:-1]
            header = json.loads(first)
            if header["format"] != self.format:
                raise RowFileError(
                    f"{shown}: has the format {header['format']!r}, not {self.format!r}: delete it first"
                )
            labels = {name: str(header["labels"][name]) for name in self.labels}
            return labels, tuple(self._row(json.loads(line)) for line in lines)
        except OSError as error:
            raise RowFileError(f"{shown}: cannot be read ({error.strerror}): give the name of a file") from error
        except (ValueError, LookupError, TypeError) as error:
            reason = f"is not a complete file of the format {self.format!r}"
            raise RowFileError(f"{shown}: {reason}: choose another name or delete it first") from error

    def finished(self, path: str | Path | None, labels: Mapping[str, str]) -> dict[Hashable, R]:
        """Return the rows of an earlier study under the same labels by their keys, nothing if there is no file.

        Raises
        ------
        RowFileError
            If the file cannot be read, or its labels differ.
        """
        if path is None or not Path(path).exists():
            return {}
        earlier, rows = self.read(path)
        for name in self.labels:
            if earlier[name] != labels[name]:
                # scenes and the like are too long to be shown
                is_long = "\n" in earlier[name] + labels[name]
                what = f"of another {name}" if is_long else f"with {name} {earlier[name]}, not {labels[name]}"
                raise RowFileError(f"{path}: holds a study {what}: choose another name or delete it first")
        return {row.key: row for row in rows}

    def completed(
        self,
        path: str | Path | None,
        labels: Mapping[str, str],
        compute: Callable[[Mapping[Hashable, R]], Iterable[R]],
    ) -> dict[Hashable, R]:
        """Return the rows of a study by their keys: the finished ones and the others, each in the file once it exists.

        `compute` takes the finished rows and yields the others.

        Raises
        ------
        OutputFileError
            If the file cannot be written.
        RowFileError
            As `finished` does.
        """
        rows, is_begun = self.finished(path, labels), False
        for row in compute(MappingProxyType(rows)):
            rows[row.key] = row
            if path is not None:
                self._append(Path(path), row, labels, is_begun=is_begun)
                is_begun = True
        return rows

    def _append(self, path: Path, row: R, labels: Mapping[str, str], *, is_begun: bool) -> None:
        """Add a row; the first one follows the header of a new file, or the last whole line of an old one."""
        try:
            with path.open("ab+") as stream:
                if not is_begun:
                    stream.seek(0)
                    n_whole = stream.read().rfind(b"\n") + 1
                    stream.truncate(n_whole)  # without a line that was cut off
                    if not n_whole:
                        header = {"format": self.format, "labels": dict(labels)}
                        stream.write(json.dumps(header).encode() + b"\n")
                stream.write(json.dumps(asdict(row), default=lambda number: number.item()).encode() + b"\n")  # type: ignore[call-overload]
        except OSError as error:
            reason = error.strerror or str(error)
            raise OutputFileError(f"{path}: cannot be written ({reason}): choose another name") from error

    def _row(self, entries: dict[str, Any]) -> R:
        return self.record(**entries)  # TypeError if the fields are others
