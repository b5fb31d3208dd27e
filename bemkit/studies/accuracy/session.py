"""One call of ``bemkit study errors``: compute what is missing, keep every row at once, show and write the rest."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from bemkit.cli.outputs import check_figures, check_text, save_figure, write_text
from bemkit.reference.values import Reference
from bemkit.studies.accuracy.files import CSV_START, FILE, to_csv
from bemkit.studies.accuracy.rows import Row
from bemkit.studies.accuracy.runs import Run
from bemkit.studies.accuracy.sweep import timed_rows, untimed_rows
from bemkit.studies.accuracy.wishes import Wishes
from bemkit.workers import worker_processes

FIGURE = "error-against-run-time.png"
_DOTS_PER_INCH = 110  # sharp at the width of a page, and a small file


@dataclass(frozen=True)
class Outputs:
    """Where rows go; each may be left out.

    Parameters
    ----------
    rows : str or None
        HDF5 file, complete after every row.
    csv : str or None
        File name, or ``"-"`` for standard output.
    folder : str or None
        For the figure.
    measures : tuple of str
        Errors to show and to draw.
    """

    rows: str | None
    csv: str | None
    folder: str | None
    measures: tuple[str, ...]

    def check(self) -> list[Path]:
        """Find out, before any work is done, whether everything can be written; return the files to be reserved."""
        if self.rows is not None and Path(self.rows).is_file():
            FILE.read(self.rows)  # says more about a broken file than that it stands in the way
        targets = [] if self.rows is None else [FILE.check_target(self.rows)]
        check_text(self.csv, "CSV file of an error study", CSV_START)
        if self.folder is not None:
            check_figures(Path(self.folder), FIGURE)
        return targets

    def write(self, title: str, rows: Sequence[Row]) -> None:
        """Write CSV and figure."""
        if self.csv is not None:
            write_text(self.csv, to_csv(rows))
        if self.folder is not None:
            from bemkit.studies.accuracy.plots import draw_errors

            save_figure(draw_errors(rows, self.measures, title=title), Path(self.folder) / FIGURE, _DOTS_PER_INCH)


@dataclass(frozen=True)
class Session:
    """A study with its outputs.

    Parameters
    ----------
    wishes : Wishes
    outputs : Outputs
    jobs : int
        Processes among which the rows are spread if no times are measured.
    is_live : bool
        Show on standard error how far it is.
    shows_tables : bool
        Print tables on standard output.
    """

    wishes: Wishes
    outputs: Outputs
    jobs: int
    is_live: bool
    shows_tables: bool

    def run(self) -> list[Row]:
        """Return the rows in the order of the runs, after they were kept and shown.

        Raises
        ------
        ResultFileError
            If the file of rows belongs to another study.
        StudyError, OverResolutionError, ValueError
            If there is no reference or the rows cannot be computed.
        """
        from bemkit.studies.accuracy.table import print_reference, print_study

        target, labels = self.outputs.rows, self.wishes.labels
        kept = {} if target is None else {row.key: row for row in FILE.finished(target, labels)}
        reference = self.wishes.reference()
        if self.shows_tables:
            print_reference(self.wishes.scene.title, reference)
        rows: dict[tuple[str, str, str, float], Row] = {}
        for row in self._computed(reference, kept.values()):
            rows[row.key] = row
            if target is not None and row.key not in kept:
                kept[row.key] = row
                FILE.write(target, labels, list(kept.values()))
        in_order = [rows[run.key] for run in self.wishes.runs]
        if self.shows_tables:
            print_study(in_order, self.outputs.measures)
        return in_order

    def _computed(self, reference: Reference, kept: Collection[Row]) -> Iterator[Row]:
        """Compute rows while a bar on standard error shows how far it is."""
        runs = self.wishes.runs
        wanted = {run.key for run in runs}
        finished = [row for row in kept if row.key in wanted]
        with show_progress(len(runs), is_live=self.is_live) as (begins, ends):
            for row in self._rows(reference, finished, begins):
                ends()
                yield row

    def _rows(self, reference: Reference, finished: Collection[Row], begins: Callable[[Run], None]) -> Iterator[Row]:
        runs, repeat = self.wishes.runs, self.wishes.repeat
        if repeat is not None:
            yield from timed_rows(runs, reference, repeat=repeat, finished=finished, begins=begins)
            return
        with worker_processes(self.jobs) as executor:
            yield from untimed_rows(runs, reference, executor, finished=finished)


@contextmanager
def show_progress(total: int, *, is_live: bool) -> Iterator[tuple[Callable[[Run], None], Callable[[], None]]]:
    """Give what to call when a run begins and when a row is there."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True, disable=not is_live) as bar:
        task = bar.add_task("error study", total=total)

        def begins(run: Run) -> None:
            bar.update(task, description=f"{run.discretisation}, {run.meshes} {run.size:g}, {run.solver}")

        yield begins, lambda: bar.advance(task)
