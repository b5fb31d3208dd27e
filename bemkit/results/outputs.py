"""Where results go: texts to files or standard output, figures to files, tables to the terminal.

Files are checked before any work is done, then replaced as a whole or not at all.
"""

from __future__ import annotations

import csv
import io
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.results.streams import print_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.table import Table

STDOUT = "-"
JSON_START = "{"
FIGURE_FORMATS = {".png": "\x89PNG", ".svg": "<?xml", ".pdf": "%PDF"}
"""Formats of figures by the ending of the file, with what such files begin."""

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


def json_text(content: Any) -> str:
    """Return a content as JSON, null for numbers that are not finite."""
    return json.dumps(finite_only(content), indent=2, allow_nan=False) + "\n"


def finite_only(value: Any) -> Any:
    """Return tables, lists and numbers as JSON can hold them: numbers that are not finite become None."""
    if isinstance(value, Mapping):
        return {key: finite_only(item) for key, item in value.items()}
    if isinstance(value, str):
        return value
    if isinstance(value, Iterable):
        return [finite_only(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


def begins_with(path: Path, start: str) -> bool:
    """Tell whether a file begins like one of its kind; every character stands for one byte."""
    expected = start.encode("latin-1")
    with path.open("rb") as stream:
        return stream.read(len(expected)) == expected


@dataclass(frozen=True)
class Outputs(Generic[Content]):
    """Where a content goes; each may be left out.

    Parameters
    ----------
    texts : tuple of TextFile
    folder : str or None
        For figures; need not exist yet.
    figures : callable (content) -> mapping of str to Figure
        By file names without ``.png``.
    figure : str
        Name of one of them: if it can be written, any other can.
    dots_per_inch : int
    """

    texts: tuple[TextFile[Content], ...] = ()
    folder: str | None = None
    figures: Callable[[Content], Mapping[str, Figure]] = field(default=lambda content: {})
    figure: str = ""
    dots_per_inch: int = 150

    @property
    def uses_stdout(self) -> bool:
        """Whether standard output is taken by data, so that nothing else may be printed there."""
        return any(text.place == STDOUT for text in self.texts)

    def check(self, others: Sequence[Path] = ()) -> list[Path]:
        """Find out, before any work is done, whether everything can be written, `others` besides; return all files.

        Raises
        ------
        OutputFileError
            If a file or folder cannot be written, something of another kind stands in the way, two outputs go to one
            place, or a package for figures is missing.
        """
        targets = [*others, *(target for text in self.texts for target in text.check())]
        places = [text.place for text in self.texts if text.place is not None]
        if len(set(targets)) < len(targets) or places.count(STDOUT) > 1:
            shown = ", ".join([*map(str, others), *places])
            raise OutputFileError(f"two outputs go to the same place ({shown}): give each its own")
        if self.folder is not None:
            check_figure_folder(Path(self.folder), self.figure)
        return targets

    def write(self, content: Content) -> None:
        """Write everything that is wanted.

        Raises
        ------
        OutputFileError
        """
        for text in self.texts:
            text.write(content)
        if self.folder is not None:
            write_figures(self.figures(content), Path(self.folder), self.dots_per_inch)


def write_figures(figures: Mapping[str, Figure], folder: Path, dots_per_inch: int = 150) -> tuple[Path, ...]:
    """Write figures, by file names without ``.png``, each all or nothing, into a folder that is made if need be.

    Returns the paths.

    Raises
    ------
    OutputFileError
        If a file cannot be written, or a file of another kind stands in the way.
    """
    make_folder(folder)
    targets = [check_figure(folder / f"{name}.png") for name in figures]
    return tuple(
        write_figure(target, figure, dots_per_inch) for target, figure in zip(targets, figures.values(), strict=True)
    )


def write_figure(path: Path, figure: Figure, dots_per_inch: int = 150) -> Path:
    """Write a figure in the format that the ending names, all or nothing; see `FIGURE_FORMATS`."""
    target, ending = check_figure(path), path.suffix.lower()
    with replacing(target) as temporary:
        # without the time and version stamps the same picture is the same file
        stamp = {".png": "Software", ".svg": "Date", ".pdf": "CreationDate"}[ending]
        figure.savefig(
            temporary,
            dpi=dots_per_inch,
            format=ending[1:],
            metadata={stamp: None},
            bbox_inches="tight",
            pad_inches=0.08,
        )
    return target


def check_figure_folder(folder: Path | None, figure: str = "figure") -> None:
    """Find out, before any work is done, whether figures can be drawn and written into a folder, by the name of one.

    Raises
    ------
    OutputFileError
    """
    if find_spec("matplotlib") is None:
        raise OutputFileError('figures need matplotlib: pip install "bemkit[plot]"')
    if folder is None:
        return
    if folder.exists() and not folder.is_dir():
        raise OutputFileError(f"{folder}: exists and is not a folder: choose another name for the figures")
    check_figure(folder / f"{figure}.png" if folder.exists() else folder.with_suffix(".png"))


def make_folder(folder: Path) -> None:
    """Make a folder if need be; OutputFileError if that fails."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        reason = f"the folder cannot be made ({error.strerror})"
        raise OutputFileError(f"{folder}: {reason}: give the name of a folder") from error


def check_figure(path: Path) -> Path:
    """Find out whether a figure can be written; return the path with symbolic links resolved."""
    start = FIGURE_FORMATS[path.suffix.lower()]
    return check_target(path, "figure", lambda existing: begins_with(existing, start))


def stdout_console(console: Console | None = None, *, width: int | None = None) -> Console:
    """Return a console of rich, by default one that writes plain numbers to standard output."""
    from rich.console import Console

    return Console(highlight=False, width=width) if console is None else console


def plain_table(left: Sequence[str] = (), right: Sequence[str] = (), *, gap: int = 1) -> Table:
    """Return a table of rich without frame: columns of texts, which may be folded, then columns of numbers.

    Columns are named and have some spaces between them.
    """
    from rich.box import SIMPLE_HEAD
    from rich.table import Table

    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, gap, 0, 0))
    for name in left:
        table.add_column(name, overflow="fold")
    for name in right:
        table.add_column(name, justify="right", no_wrap=True)
    return table
