"""The engine of all studies: tasks computed here or in other processes."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Callable, Hashable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import groupby
from multiprocessing import active_children, get_context, parent_process
from threading import Thread
from typing import Generic, NamedTuple

from bemkit.errors import CANNOT_BE_SENT, BemkitError, InputError, printable, why_not_sent
from bemkit.interrupts import uninterrupted
from bemkit.results.solution import Solution
from bemkit.studies.row_file import R

REFUSED = "refused"
"""Status of a scene that is refused by a named error before any step."""


MOST_TOGETHER = 16
"""Largest number of tasks of a group that go to another process together."""


PATIENCE_SECONDS = 20.0
"""Time after which a process hands back the finished records of a bundle."""
SHARED_RATIO = 4.0
"""The same in units of the time of its first record, most of which may be shared data that the rest needs again."""


CONNECT_SECONDS = 10.0
"""Time limit for the answer of a scheduler."""


class StudyError(InputError):
    """A study that cannot begin or continue."""


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
        """Whether a solution is certified by its solver."""
        return self.solution is not None and self.solution.is_converged


def attempt(solve: Callable[[], Solution]) -> Attempt:
    """Solve a scene; a named error of bemkit is a result, too."""
    begin = time.perf_counter()
    try:
        solution = solve()
    except BemkitError as error:
        return Attempt(None, str(error), time.perf_counter() - begin)
    return Attempt(solution, solution.message, time.perf_counter() - begin)


@dataclass(frozen=True)
class Task(Generic[R]):
    """One record to compute: its key, a label for the progress bar, and what computes it.

    It must be picklable to be sent to another process.

    Tasks of one group share costly data, kept by their common objects: neighbouring tasks of a group go to another
    process together.
    """

    key: Hashable
    label: str
    compute: Callable[[], R]
    group: Hashable = None


def compute(
    tasks: Sequence[Task[R]],
    executor: Executor | None = None,
    *,
    begins: Callable[[Task[R]], None] | None = None,
    n_workers: int = 1,
) -> Iterator[R]:
    """Compute the records of some tasks.

    Parameters
    ----------
    tasks : sequence of Task
    executor : Executor, optional
        Such as a `ProcessPoolExecutor` or that of a `distributed` client; by default tasks are computed here, in turn.
    begins : callable, optional
        Called with each task before it is computed here.
    n_workers : int
        Of the executor: groups of tasks are split so that all have work.

    Yields
    ------
    record
        In the order of the tasks; from an executor as they are ready.

    Raises
    ------
    StudyError
        If the executor breaks down, or a task cannot be sent to another process.
    """
    if executor is not None:
        yield from _computed_elsewhere(tasks, executor, n_workers)
        return
    for task in tasks:
        if begins is not None:
            begins(task)
        yield task.compute()


@contextmanager
def executor_of(processes: int = 1, cluster: str | None = None) -> Iterator[tuple[Executor | None, int]]:
    """Give an executor of some processes, none for one, and the number of its workers.

    An error or an interrupt ends the processes at once. With the address of a `distributed` scheduler, such as
    ``tcp://10.0.0.1:8786``, the workers of its cluster take the place of processes.

    Raises
    ------
    StudyError
        If the cluster cannot be reached.
    """
    if cluster is not None:
        with _cluster(cluster) as found:
            yield found
    elif processes > 1:
        others = active_children()
        # spawned processes do not inherit threads that hold locks
        executor = ProcessPoolExecutor(processes, get_context("spawn"), initializer=_prepare_process)
        try:
            yield executor, processes
        except BaseException:  # only a terminal sends an interrupt to the workers, too
            for worker in active_children():
                if worker not in others:
                    worker.terminate()
            raise
        finally:
            executor.shutdown(cancel_futures=True)
    else:
        yield None, 1


@contextmanager
def _cluster(address: str) -> Iterator[tuple[Executor, int]]:
    """Give an executor of a cluster, and the number of its threads."""
    try:
        from distributed import Client
    except ImportError:
        raise StudyError('a cluster needs distributed: pip install "bemkit[cluster]"') from None
    try:
        client = Client(address, timeout=CONNECT_SECONDS)
    except (OSError, ValueError) as error:
        reason = printable(str(error))[:200] or type(error).__name__
        raise StudyError(
            f"cluster {address}: no scheduler answers ({reason}): start one with 'dask scheduler'"
        ) from error
    with client:
        n_workers = sum(client.nthreads().values())
        if not n_workers:
            raise StudyError(f"cluster {address}: it has no workers: start some with 'dask worker {address}'")
        yield client.get_executor(), n_workers


def _computed_elsewhere(tasks: Sequence[Task[R]], executor: Executor, n_workers: int) -> Iterator[R]:
    left: dict[Future[list[R]], Sequence[Callable[[], R]]] = {}

    def submit(bundle: Sequence[Callable[[], R]]) -> None:
        with uninterrupted():  # a process that is known to nobody until it has started would wait for ever
            left[executor.submit(_computed_for_a_while, bundle)] = bundle

    try:
        for bundle in _bundles(tasks, n_workers):
            submit(bundle)
        while left:
            for future in wait(left, return_when=FIRST_COMPLETED).done:
                computed, records = left[future], future.result()
                if len(records) < len(computed):
                    submit(computed[len(records) :])
                del left[future]
                yield from records
    except BrokenExecutor as error:
        reason = str(error) or type(error).__name__
        raise StudyError(
            f"the executor failed ({reason}): finished rows are saved; run again with fewer processes"
        ) from error
    except CANNOT_BE_SENT as error:
        if not (reason := why_not_sent([task.compute for task in tasks])):
            raise
        raise StudyError(
            f"the scene cannot be sent to another process ({reason}): write its functions as formulas"
        ) from error
    finally:
        for future in left:
            future.cancel()


def _bundles(tasks: Sequence[Task[R]], n_workers: int) -> Iterator[list[Callable[[], R]]]:
    """Yield bundles of tasks for another process: one task, or neighbours of one group."""
    most = min(MOST_TOGETHER, -(-len(tasks) // n_workers))
    for group, members in groupby(tasks, key=lambda task: task.group):
        size = 1 if group is None else most
        left = [task.compute for task in members]
        yield from (left[first : first + size] for first in range(0, len(left), size))


def _computed_for_a_while(bundle: Sequence[Callable[[], R]]) -> list[R]:
    """Compute the first records of a bundle; the rest is computed elsewhere, since what takes long must not be lost."""
    begin, records = time.perf_counter(), [bundle[0]()]
    longest = max(PATIENCE_SECONDS, SHARED_RATIO * (time.perf_counter() - begin))
    for compute_record in bundle[1:]:
        if time.perf_counter() - begin > longest:
            break
        records.append(compute_record())
    return records


def _prepare_process() -> None:
    """Make a worker end on Ctrl-C, and when its parent process ends, even if that is killed."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    """Exit when the parent ends; a worker that holds both ends of its queue would wait for ever."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
