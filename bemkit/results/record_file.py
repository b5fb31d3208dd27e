"""Records of a study in an HDF5 file and its journal, complete after every record: a stopped study can go on."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Generic, Protocol, TypeVar, get_type_hints

import numpy as np

from bemkit.atomic_files import OutputFileError, hidden_beside, replacing
from bemkit.errors import shown_path
from bemkit.hdf5 import FileFormat, ResultFileError, checksum_in, rows_of, write_table, write_text

_MAX_LABEL = 1_000_000


class RowJournal:
    """Rows that were added to a sealed file since it was written: one line each, in a file beside it.

    Adding a row costs the same however many there are, where the sealed file is written as a whole. The journal belongs
    to the very file whose checksum it begins with, and says nothing of another one.

    Parameters
    ----------
    target : Path
        The sealed file.
    """

    def __init__(self, target: Path) -> None:
        self._target = target.resolve()
        self._path = hidden_beside(self._target, "rows")

    def begin(self) -> None:
        """Begin with no rows, for the sealed file as it is now."""
        with replacing(self._path) as temporary:
            temporary.write_text(checksum_in(self._target) + "\n", "utf-8")

    def add(self, row: Sequence[Any]) -> None:
        """Add a row of numbers, texts and lists of numbers, which is on the disk afterwards.

        Raises
        ------
        OutputFileError
            If the system refuses.
        """
        try:
            with self._path.open("a", encoding="utf-8") as stream:
                stream.write(json.dumps(row, default=lambda number: number.item()) + "\n")
                stream.flush()
                os.fsync(stream.fileno())
        except OSError as error:
            reason = error.strerror or str(error)
            raise OutputFileError(
                f"{shown_path(self._target)}: cannot be written ({reason}): choose another place"
            ) from error

    def end(self) -> None:
        """Remove the journal."""
        self._path.unlink(missing_ok=True)

    def read(self) -> tuple[str, list[list[Any]]]:
        """Return the checksum of the file it belongs to, and its rows; a last line that was cut off is no row."""
        try:
            checksum, *lines = self._path.read_text("utf-8").split("\n")
            return checksum, [json.loads(line) for line in lines[:-1]]
        except (OSError, ValueError):  # none, or not written by bemkit
            return "", []


class Record(Protocol):
    """A frozen dataclass whose fields are texts, floats, whole numbers, and as many floats in each record."""

    @property
    def key(self) -> Hashable:
        """What tells the records of one study apart."""


R = TypeVar("R", bound=Record)


@dataclass(frozen=True)
class RecordFile(Generic[R]):
    """A kind of file: labels that say what was studied, and records.

    Parameters
    ----------
    format : FileFormat
    record : type
        Of the records.
    labels : tuple of str
        Names of the texts.
    """

    format: FileFormat
    record: type[R]
    labels: tuple[str, ...]

    def check(self, path: str | Path | None) -> list[Path]:
        """Find out, before any work is done, whether records can be written; return the file, if there is one to write.

        Raises
        ------
        OutputFileError, ResultFileError
        """
        if path is None:
            return []
        if Path(path).is_file():
            self.read(path)  # says more about a broken file than that it stands in the way
        return [self.format.check_target(path)]

    def write(self, path: str | Path, labels: Mapping[str, str], records: Sequence[R]) -> None:
        """Write labels and records, replacing an older file at once or not at all.

        Raises
        ------
        OutputFileError
            If the file cannot be written, or a file of another kind stands in the way.
        """
        with self.format.created(path) as file:
            for name in self.labels:
                write_text(file, name, labels[name])
            columns: dict[str, Any] = {}
            for name, kind in self._types.items():
                values = [getattr(record, name) for record in records]
                columns[name] = values if kind is str else np.array(values, dtype=np.int64 if kind is int else float)
            write_table(file.create_group("rows"), columns)

    def read(self, path: str | Path) -> tuple[dict[str, str], tuple[R, ...]]:
        """Read labels and records, those in the journal beside the file too.

        Raises
        ------
        ResultFileError
            If the file is not a complete file of this kind and version.
        """
        checksum, journal = RowJournal(Path(path)).read()  # first: it never holds rows that a newer file lacks
        with self.format.opened(path) as reader:
            labels = {name: reader.text(name, _MAX_LABEL) for name in self.labels}
            types = self._types
            texts, integers = ([name for name in types if types[name] is kind] for kind in (str, int))
            floats = [name for name in types if types[name] not in (str, int)]
            rows = rows_of(reader.table("rows", texts=texts, floats=floats, integers=integers))
            if checksum and checksum == checksum_in(Path(path)):
                if any(not isinstance(row, list) or len(row) != len(types) for row in journal):
                    raise reader.error(f"a row in .{Path(path).name[:100]}.rows is damaged: delete that file")
                rows += [dict(zip(types, row, strict=True)) for row in journal]
        return labels, tuple(self.record(**row) for row in rows)

    def finished(self, path: str | Path | None, labels: Mapping[str, str]) -> dict[Hashable, R]:
        """Return the records of an earlier study under the same labels by their keys, nothing if there is no file.

        Raises
        ------
        ResultFileError
            If the file cannot be read, or its labels differ.
        """
        if path is None or not Path(path).exists():
            return {}
        earlier, records = self.read(path)
        for name in self.labels:
            if earlier[name] != labels[name]:
                # scenes and the like are too long to be shown
                is_long = "\n" in earlier[name] + labels[name]
                what = f"of another {name}" if is_long else f"with {name} {earlier[name]}, not {labels[name]}"
                raise ResultFileError(f"{path}: holds the sweep {what}: choose another name or delete it first")
        return {record.key: record for record in records}

    def keep(
        self, path: str | Path | None, records: Iterator[R], finished: dict[Hashable, R], labels: Mapping[str, str]
    ) -> Iterator[R]:
        """Hand records on after those that are new were added to the finished ones and to the file, if any."""
        with nullcontext(_drop) if path is None else self._added(Path(path), labels, finished) as add:
            for record in records:
                if record.key not in finished:
                    finished[record.key] = record
                    add(record)
                yield record

    @contextmanager
    def _added(
        self, path: Path, labels: Mapping[str, str], finished: Mapping[Hashable, R]
    ) -> Iterator[Callable[[R], None]]:
        """Give what adds a record, already among the finished ones, to the file.

        The first is written with all others. Further ones go to the journal, at the same cost however many there are,
        and into the file at the end, or when a study goes on whose process was killed.
        """
        journal, n_added = RowJournal(path), 0
        checksum, left = journal.read()
        if left and checksum == checksum_in(path):
            self.write(path, labels, list(finished.values()))

        def add(record: R) -> None:
            nonlocal n_added
            if n_added:
                journal.add([getattr(record, name) for name in self._types])
            else:
                self.write(path, labels, list(finished.values()))
                journal.begin()
            n_added += 1

        try:
            yield add
        finally:
            if n_added > 1:
                self.write(path, labels, list(finished.values()))
            journal.end()

    @property
    def _types(self) -> dict[str, Any]:
        return get_type_hints(self.record)


def _drop(record: object) -> None:
    """Add a record to no file."""
