"""Outputs of a command: texts and tables to files or standard output, figures to a folder, tables to the terminal.

Files are checked before any work is done, then replaced as a whole or not at all.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from bemkit.cli.process import print_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from rich.console import Console
    from rich.table import Table as PrintedTable

    from bemkit.table import Table

STDOUT = "-"
Content = TypeVar("Content")
_TABLE_TEXTS: Mapping[str, Callable[[Table], str]] = MappingProxyType(
    {
        ".csv": lambda table: table.to_csv(),
        ".json": lambda table: table.to_json(),
        ".md": lambda table: table.to_markdown(),
    }
)
"""Texts of a table by the ending of a file."""


@dataclass(frozen=True)
class TextFile(Generic[Content]):
    """A text to write to a file or to standard output, or nothing.

    Parameters
    ----------
    target : str or None
        File name, ``"-"`` for standard output, or None if the text is not wanted.
    text : callable (content) -> str
    """

    target: str | None
    text: Callable[[Content], str]

    def check(self) -> list[Path]:
        """Check, before any computation, that the text can be written; return the file, if any.

        Raises
        ------
        OutputFileError
        """
        return [] if self.target in (None, STDOUT) else [_checked(Path(str(self.target)))]

    def write(self, content: Content) -> None:
        """Write the text of some content to the file or to standard output, if it is wanted.

        Raises
        ------
        OutputFileError
        """
        if self.target == STDOUT:
            print_data(self.text(content))
        elif self.target is not None:
            _write(Path(self.target), self.text(content))


def csv_of(target: str | None, table: Callable[[Content], Table]) -> TextFile[Content]:
    """Return a table to write as comma-separated values, or nothing."""
    return TextFile(target, lambda content: table(content).to_csv())


def json_of(target: str | None, entries: Callable[[Content], Mapping[str, Any]]) -> TextFile[Content]:
    """Return the entries of some content to write as JSON, or nothing."""

    def text(content: Content) -> str:
        from bemkit.table import json_text

        return json_text(entries(content))

    return TextFile(target, text)


@dataclass(frozen=True)
class TableFile(Generic[Content]):
    """A table to write in the format of the ending of its file, or nothing.

    Parameters
    ----------
    target : str or None
    table : callable (content) -> Table
    """

    target: str | None
    table: Callable[[Content], Table]

    def check(self) -> list[Path]:
        """Check, before any computation, that the table can be written; return the file, if any.

        Raises
        ------
        OutputFileError
            If the ending is unknown, or the file cannot be written.
        """
        if self.target is None:
            return []
        path = Path(self.target)
        if path.suffix.lower() not in (*_TABLE_TEXTS, ".h5", ".hdf5"):
            endings = ", ".join((*_TABLE_TEXTS, ".h5"))
            from bemkit.atomic_files import OutputFileError

            raise OutputFileError(
                f"{path}: the ending {path.suffix!r} names no format of tables: give one of {endings}, or .jsonl for "
                "rows that an interrupted study resumes from"
            )
        if path.suffix.lower() in _TABLE_TEXTS:
            return [_checked(path)]
        from bemkit.table import table_format

        return [table_format().check_target(path)]

    def write(self, content: Content) -> None:
        """Write the table of some content, if it is wanted.

        Raises
        ------
        OutputFileError
        """
        if self.target is None:
            return
        path, table = Path(self.target), self.table(content)
        if path.suffix.lower() in _TABLE_TEXTS:
            _write(path, _TABLE_TEXTS[path.suffix.lower()](table))
        else:
            table.to_hdf5(path)


@dataclass(frozen=True)
class Outputs(Generic[Content]):
    """Files of a result; each is optional.

    Parameters
    ----------
    texts : tuple of TextFile and TableFile
    folder : str or None
        For figures; need not exist yet.
    figures : callable (content) -> mapping of str to Figure
        By file names without ``.png``.
    figure : str
        Name of one figure, to check that figures can be written.
    dots_per_inch : int
    """

    texts: tuple[TextFile[Content] | TableFile[Content], ...] = ()
    folder: str | None = None
    figures: Callable[[Content], Mapping[str, Figure]] = field(default=lambda content: {})
    figure: str = ""
    dots_per_inch: int = 150

    @property
    def uses_stdout(self) -> bool:
        """Whether standard output is taken by data, so that nothing else may be printed there."""
        return any(text.target == STDOUT for text in self.texts)

    def check(self, others: Sequence[Path] = ()) -> list[Path]:
        """Check, before any computation, that these outputs and `others` can be written; return all files.

        Raises
        ------
        OutputFileError
            If a file or folder cannot be written, two outputs go to one place, or a package for figures is missing.
        """
        targets = [*others, *(target for text in self.texts for target in text.check())]
        places = [text.target for text in self.texts if text.target is not None]
        if len(set(targets)) < len(targets) or places.count(STDOUT) > 1:
            shown = ", ".join([*map(str, others), *places])
            from bemkit.atomic_files import OutputFileError

            raise OutputFileError(f"two outputs go to the same file ({shown}): name two files")
        if self.folder is not None:
            from bemkit.pictures.figure_files import check_figure_folder

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
            from bemkit.pictures.figure_files import write_figures

            write_figures(self.figures(content), Path(self.folder), self.dots_per_inch)


def _checked(path: Path) -> Path:
    from bemkit.atomic_files import check_target  # only needed where something is written

    return check_target(path)


def _write(path: Path, text: str) -> None:
    from bemkit.atomic_files import write_text

    write_text(path, text)


def stdout_console(console: Console | None = None, *, width: int | None = None) -> Console:
    """Return a console of rich, by default one that writes plain numbers to standard output."""
    from rich.console import Console

    return Console(highlight=False, width=width) if console is None else console


def plain_table(left: Sequence[str] = (), right: Sequence[str] = (), *, gap: int = 1) -> PrintedTable:
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
