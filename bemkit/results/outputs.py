"""Texts and figures in files: checked before any work is done, then replaced as a whole or not at all."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.results.streams import print_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STDOUT = "-"
PNG_START = "\x89PNG"
JSON_START = "{"

Content = TypeVar("Content")


@dataclass(frozen=True)
class TextFile(Generic[Content]):
    """A text that is asked for, or not.

    Parameters
    ----------
    place : str or None
        File name, ``"-"`` for standard output, or None if the text is not wanted.
    kind : str
        What will be written, for messages: "JSON file".
    start : str
        How files of this kind begin; only such files are replaced.
    text : callable (content) -> str
    """

    place: str | None
    kind: str
    start: str
    text: Callable[[Content], str]

    def check(self) -> list[Path]:
        """Find out, before any work is done, whether the text can be written; return the file, if it is one.

        Raises
        ------
        OutputFileError
        """
        if self.place in (None, STDOUT):
            return []
        return [check_target(Path(str(self.place)), self.kind, lambda path: begins_with(path, self.start))]

    def write(self, content: Content) -> None:
        """Write the text of some content to the file or to standard output, if it is wanted.

        Raises
        ------
        OutputFileError
        """
        if self.place is not None:
            write_text(self.place, self.text(content))


def write_text(place: str, text: str) -> None:
    """Write a text to a file, all or nothing, or to standard output if the place is ``"-"``."""
    if place == STDOUT:
        print_data(text)
        return
    with replacing(Path(place).resolve()) as temporary:
        temporary.write_text(text, encoding="utf-8")


def csv_text(head: Iterable[str], lines: Iterable[Sequence[Any]]) -> str:
    """Return a header line and lines of values as comma-separated values."""
    stream = io.StringIO()
    writer = csv.writer(stream, lineterminator="\n")
    writer.writerow(head)
    writer.writerows(lines)
    return stream.getvalue()


def begins_with(path: Path, start: str) -> bool:
    """Tell whether a file begins like one of its kind; every character stands for one byte."""
    expected = start.encode("latin-1")
    with path.open("rb") as stream:
        return stream.read(len(expected)) == expected


def check_figures(folder: Path, name: str) -> None:
    """Find out, before any work is done, whether figures can be drawn and written.

    Parameters
    ----------
    folder : Path
        Need not exist yet.
    name : str
        One of the figures: if it can be written, any other can.

    Raises
    ------
    OutputFileError
    """
    if find_spec("matplotlib") is None:
        raise OutputFileError('figures need matplotlib: pip install "bemkit[plot]"')
    if folder.exists() and not folder.is_dir():
        raise OutputFileError(f"{folder}: exists and is not a folder: choose another name for the figures")
    _check_figure(folder / f"{name}.png" if folder.exists() else folder)


def write_figures(figures: Mapping[str, Figure], folder: Path, dots_per_inch: int = 150) -> tuple[Path, ...]:
    """Write figures as PNG, each all or nothing, into a folder that is made if need be; return their paths.

    Parameters
    ----------
    figures : mapping of str to matplotlib.figure.Figure
        By file names without ``.png``.
    folder : Path
    dots_per_inch : int

    Raises
    ------
    OutputFileError
        If a file cannot be written, or a file of another kind stands in the way.
    """
    make_folder(folder)
    targets = [_check_figure(folder / f"{name}.png") for name in figures]
    for target, figure in zip(targets, figures.values(), strict=True):
        with replacing(target) as temporary:
            # without the time and version stamps the same picture is the same file
            figure.savefig(temporary, dpi=dots_per_inch, format="png", metadata={"Software": None})
    return tuple(targets)


def make_folder(folder: Path) -> None:
    """Make a folder if need be.

    Raises
    ------
    OutputFileError
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"the folder cannot be made ({error.strerror})"
        raise OutputFileError(f"{folder}: {reason}: give the name of a folder") from error


def _check_figure(path: Path) -> Path:
    return check_target(path, "figure", lambda existing: begins_with(existing, PNG_START))
