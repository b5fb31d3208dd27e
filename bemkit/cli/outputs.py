"""Where the command line sends a solution: result file, JSON, CSV and figures."""

from __future__ import annotations

import io
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING

from bemkit.atomic_files import OutputFileError, check_target, replacing
from bemkit.results.solution import Solution
from bemkit.results.tables import CSV_STARTS, to_json, write_csv
from bemkit.streams import print_data

if TYPE_CHECKING:
    from matplotlib.figure import Figure

STDOUT = "-"
PNG_START = "\x89PNG"


@dataclass(frozen=True)
class Outputs:
    """The wishes for output; each may be left out.

    Parameters
    ----------
    result : Path or None
        HDF5 file.
    json, csv : str or None
        File names, or ``"-"`` for standard output.
    table : str
        Which table the CSV holds, see `bemkit.results.tables.write_csv`.
    plots : Path or None
        Folder for figures.
    """

    result: Path | None = None
    json: str | None = None
    csv: str | None = None
    table: str = "contact"
    plots: Path | None = None

    @property
    def uses_stdout(self) -> bool:
        """Whether standard output is taken by data, so that nothing else may be printed there."""
        return STDOUT in (self.json, self.csv)

    def check(self) -> list[Path]:
        """Find out, before any work is done, whether everything can be written.

        Returns
        -------
        list of Path
            The files, to be reserved.

        Raises
        ------
        OutputFileError
            If a file or folder cannot be written, something of another kind stands in the way, two outputs go to one
            place, or a package for figures is missing.
        """
        if self.result == Path(STDOUT):
            raise OutputFileError("- is standard output, which cannot take a binary result: give a file name")
        targets: list[Path] = []
        if self.result is not None:
            from bemkit.results.result_file import check_result_target

            targets.append(check_result_target(self.result))
        if self.json not in (None, STDOUT):
            targets.append(check_target(Path(str(self.json)), "JSON file", _is_json))
        if self.csv not in (None, STDOUT):
            targets.append(check_target(Path(str(self.csv)), f"CSV file of the {self.table} table", self._is_csv))
        if len(set(targets)) < len(targets) or self.json == self.csv == STDOUT:
            shown = ", ".join(str(place) for place in (self.result, self.json, self.csv) if place is not None)
            raise OutputFileError(f"two outputs go to the same place ({shown}): give each its own")
        if self.plots is not None:
            check_figures(self.plots, "deformation.png")
        return targets

    def write(self, solution: Solution) -> None:
        """Write everything that is wanted.

        Parameters
        ----------
        solution : Solution

        Raises
        ------
        OutputFileError
            If something cannot be written.
        SceneError
            If the scene cannot be part of a result file.
        """
        if self.result is not None:
            from bemkit.results.result_file import write_result

            write_result(self.result, solution)
        if self.json is not None:
            write_text(self.json, to_json(solution) + "\n")
        if self.csv is not None:
            stream = io.StringIO()
            write_csv(solution, self.table, stream)
            write_text(self.csv, stream.getvalue())
        if self.plots is not None:
            from bemkit.results.figures import save_figures

            save_figures(solution, self.plots)

    def _is_csv(self, path: Path) -> bool:
        return begins_with(path, CSV_STARTS[self.table])


def _is_json(path: Path) -> bool:
    return begins_with(path, "{")


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
    check_target(folder / name if folder.exists() else folder, "figure", lambda path: begins_with(path, PNG_START))


def save_figure(figure: Figure, path: Path, dots_per_inch: int = 150) -> Path:
    """Write a figure as PNG, all or nothing, into a folder that is made if need be; return its path.

    Raises
    ------
    OutputFileError
        If the file cannot be written, or a file of another kind stands in the way.
    """
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputFileError(f"{path.parent}: cannot be made ({error.strerror}): choose another name") from error
    target = check_target(path, "figure", lambda existing: begins_with(existing, PNG_START))
    with replacing(target) as temporary:
        # without the time and version stamps the same picture is the same file
        figure.savefig(temporary, dpi=dots_per_inch, format="png", metadata={"Software": None})
    return target


def check_text(place: str | None, kind: str, start: str) -> None:
    """Find out whether a text can be written; an existing file is replaced only if it begins like one of its kind.

    Parameters
    ----------
    place : str or None
        File name, or ``"-"`` for standard output, which can always be written.
    kind : str
        What will be written, for messages: "JSON file".
    start : str
        How files of this kind begin.

    Raises
    ------
    OutputFileError
    """
    if place not in (None, STDOUT):
        check_target(Path(str(place)), kind, lambda path: begins_with(path, start))


def write_text(place: str, text: str) -> None:
    """Write a text to a file, all or nothing, or to standard output if the place is ``"-"``."""
    if place == STDOUT:
        print_data(text)
        return
    with replacing(Path(place).resolve()) as temporary:
        temporary.write_text(text, encoding="utf-8")
