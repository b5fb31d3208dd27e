"""The engine of all studies: tasks computed here or in other processes, kept as they finish, shown and written."""

from __future__ import annotations

import os
import pickle
import signal
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, ProcessPoolExecutor, as_completed
from contextlib import ExitStack
from dataclasses import dataclass
from multiprocessing import get_context, parent_process
from threading import Thread
from typing import Generic, NamedTuple

from bemkit.errors import BemkitError, InputError
from bemkit.results.record_file import R
from bemkit.results.solution import Solution

REFUSED = "refused"
"""Status of a scene that is refused by a named error before any step."""


class StudyError(InputError):
    """A study that cannot begin or cannot go on."""


class Attempt(NamedTuple):
    """A solution, or why there is none."""

    solution: Solution | None
    message: str
    seconds: float

    @property
    def status(self) -> str:
        """The status in small letters."""
        return REFUSED if self.solution is None else self.solution.status.name.lower()

    @property
    def is_converged(self) -> bool:
        """Whether the solver vouches for a solution."""
        return self.solution is not None and self.solution.is_converged


def attempt(solve: Callable[[], Solution]) -> Attempt:
    """Solve a scene; errors that bemkit names are answers too."""
    begin = time.perf_counter()
    try:
        solution = solve()
    except BemkitError as error:
        return Attempt(None, str(error), time.perf_counter() - begin)
    return Attempt(solution, solution.message, time.perf_counter() - begin)


@dataclass(frozen=True)
class Task(Generic[R]):
    """One record to compute: its key, a label for the progress bar, and what computes it.

    To be sent to another process that must be picklable.
    """

    key: Hashable
    label: str
    compute: Callable[[], R]


def compute(
    tasks: Sequence[Task[R]],
    executor: Executor | None = None,
    *,
    finished: Mapping[Hashable, R] | None = None,
    begins: Callable[[Task[R]], None] | None = None,
) -> Iterator[R]:
    """Compute the records of some tasks.

    Parameters
    ----------
    tasks : sequence of Task
    executor : Executor, optional
        Such as a `ProcessPoolExecutor` or that of a `distributed` client; by default tasks are computed here, in turn.
    finished : mapping of keys to records, optional
        Of an earlier study; they are handed on instead of computed again.
    begins : callable, optional
        Called with each task before it is computed here.

    Yields
    ------
    record
        In the order of the tasks; from an executor finished ones first, the others as they are ready.

    Raises
    ------
    StudyError
        If the executor breaks down, or a task cannot be sent to another process.
    """
    finished = {} if finished is None else finished
    if executor is not None:
        yield from (finished[task.key] for task in tasks if task.key in finished)
        yield from _computed_elsewhere([task for task in tasks if task.key not in finished], executor)
        return
    for task in tasks:
        if task.key not in finished and begins is not None:
            begins(task)
        yield finished[task.key] if task.key in finished else task.compute()


def compute_with_progress(
    tasks: Sequence[Task[R]],
    name: str,
    *,
    is_live: bool,
    processes: int = 1,
    finished: Mapping[Hashable, R] | None = None,
) -> Iterator[R]:
    """Compute records as `compute` does, here or in several processes, while a bar on standard error shows how far.

    The bar bears a name, and is shown only if it is live.
    """
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    with ExitStack() as stack:
        executor = None
        if processes > 1:
            # spawned processes do not inherit threads that hold locks
            executor = ProcessPoolExecutor(processes, get_context("spawn"), initializer=_prepare_process)
            stack.callback(executor.shutdown, cancel_futures=True)  # what has not begun is left out
        bar = Progress(*columns, console=Console(stderr=True), transient=True, disable=not is_live)
        row = stack.enter_context(bar).add_task(name, total=len(tasks))
        for record in compute(
            tasks, executor, finished=finished, begins=lambda task: bar.update(row, description=task.label)
        ):
            bar.advance(row)
            yield record


def _computed_elsewhere(tasks: Sequence[Task[R]], executor: Executor) -> Iterator[R]:
    futures = []
    try:
        futures = [executor.submit(task.compute) for task in tasks]
        for future in as_completed(futures):
            yield future.result()
    except BrokenExecutor as error:
        reason = str(error) or type(error).__name__
        raise StudyError(
            f"the executor broke down ({reason}): finished rows are good; go on with fewer processes or with one"
        ) from error
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        if "pickle" not in str(error):
            raise
        raise StudyError(
            f"the scene cannot be sent to another process ({error}): write its functions as formulas"
        ) from error
    finally:
        for future in futures:
            future.cancel()


def _prepare_process() -> None:
    """Let a worker end at once on Ctrl-C, and when the process that started it ends, however that is killed."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    """Wait for the end of the parent: a worker holds both ends of its queue, and would wait for work for ever."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
