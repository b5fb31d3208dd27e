"""Rows that were added to a sealed file since it was written: one line each, in a file beside it.

Adding a row costs the same however many there are, where the sealed file is written as a whole. The journal belongs to
the very file whose checksum it begins with, and says nothing of another one.
"""

from __future__ import annotations

import json
import os
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from bemkit.atomic_files import OutputFileError, hidden_beside, replacing
from bemkit.errors import shown_path
from bemkit.hdf5 import checksum_in


class RowJournal:
    """The journal of a sealed file.

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
