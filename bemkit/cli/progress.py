"""Progress in a terminal: stage, mesh and step, and a bar with the remaining time."""

from __future__ import annotations

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.progress_bar import ProgressBar
from rich.text import Text

from bemkit.stopwatch import PROGRESS

if TYPE_CHECKING:
    from bemkit.solvers.base import StepRecord
    from bemkit.studies.engine import Task as Job
    from bemkit.studies.row_file import R

_ALMOST = 0.98
"""Share of the bar at which it waits if a run takes longer than planned."""


@contextmanager
def live_progress() -> Iterator[Callable[[StepRecord], None]]:
    """Show the progress of a ``with`` statement on standard error, a terminal.

    Yields
    ------
    callable
        Callback for a run: it prints a line for each step of the solver above the bar.
    """
    console = Console(stderr=True, highlight=False)
    columns = TextColumn("{task.description}"), _PlannedBar(bar_width=24), TimeElapsedColumn(), _TimeLeft()
    # what goes to standard output stays there
    with Progress(*columns, console=console, transient=True, redirect_stdout=False, redirect_stderr=False) as bar:
        display = _Display(bar, console)
        level = PROGRESS.level
        PROGRESS.addHandler(display)
        PROGRESS.setLevel(logging.DEBUG)
        try:
            yield display.step
        finally:
            PROGRESS.removeHandler(display)
            PROGRESS.setLevel(level)


def compute_with_progress(
    tasks: Sequence[Job[R]],
    name: str,
    *,
    is_live: bool,
    processes: int = 1,
    cluster: str | None = None,
    console: Console | None = None,
) -> Iterator[R]:
    """Compute records as `bemkit.studies.engine.compute` does, while a bar, by default on standard error, shows it.

    Raises
    ------
    StudyError
        As `compute` and `executor_of` do.
    """
    from bemkit.studies.engine import compute, executor_of

    counts = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    times = (TimeElapsedColumn(), TextColumn("left"), TimeRemainingColumn())
    bar = Progress(*counts, *times, console=console or Console(stderr=True), transient=True, disable=not is_live)
    with executor_of(processes, cluster) as (executor, n_workers), bar:
        row = bar.add_task(name, total=len(tasks))

        def begins(task: Job[R]) -> None:
            bar.update(row, description=task.label)

        for record in compute(tasks, executor, begins=begins, n_workers=n_workers):
            bar.advance(row)
            yield record


class _Display(logging.Handler):
    """Shows what `bemkit.stopwatch.announce` announces."""

    def __init__(self, bar: Progress, console: Console) -> None:
        super().__init__()
        self._bar, self._console = bar, console
        self._row = bar.add_task("begin", total=None)
        self._table: Callable[[StepRecord], None] | None = None
        self._mesh, self._n_meshes = "", 0

    def emit(self, record: logging.LogRecord) -> None:
        """Show a stage; a plan gives the number of elements of the next mesh and its time."""
        seconds: float | None = getattr(record, "seconds", None)
        if seconds is None:
            self._bar.update(self._row, description=f"{self._mesh}{record.getMessage()}")
            return
        self._n_meshes += 1
        number = f"mesh {self._n_meshes}, " if self._n_meshes > 1 else ""
        self._mesh = f"{number}{record.getMessage()}: "
        self._bar.reset(self._row, total=max(seconds, 1e-3), description=f"{self._mesh}assemble")

    def step(self, record: StepRecord) -> None:
        """Print a line for a step of the solver."""
        if self._table is None:
            from bemkit.cli.console import ConvergenceTable  # loads what a run loads anyway

            self._table = ConvergenceTable(self._console)
        self._bar.update(self._row, description=f"{self._mesh}solve, step {record.step}", refresh=True)
        self._table(record)


class _PlannedBar(BarColumn):
    """A bar of the elapsed share of the planned time."""

    def render(self, task: Task) -> ProgressBar:
        """Return the bar; without a plan it pulses."""
        if task.total is not None:
            task.completed = min(task.elapsed or 0.0, _ALMOST * task.total)
        return super().render(task)


class _TimeLeft(ProgressColumn):
    """The remaining planned time."""

    def render(self, task: Task) -> Text:
        """Return nothing without a plan, and when it is over."""
        left = (task.total or 0.0) - (task.elapsed or 0.0)
        return Text(f"about {left:.0f} s left" if left >= 1.0 else "", style="cyan")
