"""Number of threads: one for small problems, all for large ones."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, nullcontext
from functools import cache
from threading import Condition, Event, Thread, get_ident
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

Result = TypeVar("Result")
Chunk = TypeVar("Chunk")

LARGE = 2500
"""Order of a matrix above which several threads factor it faster than one."""
MANY_INTEGRALS = 300_000
"""Number of integrals (element pairs times products of polynomials) above which several threads are faster than one."""
MAX_THREADS = 8


class _Turns:
    """Lets threads share a setting of the whole process.

    Threads that request the same setting share it; the others wait in the order of their requests. The first thread
    that shares a setting switches it on, the last one switches it off. Nested calls of a thread that has the setting
    return at once, because waiting for itself would never end.
    """

    def __init__(self) -> None:
        self._change = Condition()
        self._waiting: list[object] = []
        self._users: Counter[int] = Counter()
        self._shared = False
        self._setting = ExitStack()

    @contextmanager
    def shared(self, is_wanted: bool, setting: Callable[[], AbstractContextManager[Any]]) -> Iterator[None]:
        """Hold the setting on or off within a context."""
        thread = get_ident()
        with self._change:
            if not self._users[thread]:
                self._take_turn(is_wanted)
            if not self._users.total() and is_wanted:
                self._setting.enter_context(setting())
            self._users[thread] += 1
        try:
            yield
        finally:
            with self._change:
                self._users[thread] -= 1
                if not self._users.total():
                    self._setting.close()
                self._users += Counter()  # remove threads with the count zero
                self._change.notify_all()

    def _take_turn(self, is_wanted: bool) -> None:
        ticket = object()
        self._waiting.append(ticket)
        try:
            self._change.wait_for(
                lambda: self._waiting[0] is ticket and (not self._users.total() or self._shared == is_wanted)
            )
        finally:  # also after an interrupt
            self._waiting.remove(ticket)
            self._change.notify_all()
        self._shared = is_wanted


@contextmanager
def _held_by_a_thread(setting: Callable[[], AbstractContextManager[Any]]) -> Iterator[None]:
    """Hold a setting in a separate thread.

    threadpoolctl requires that the thread that set a limit also removes it, but the first of the threads that share the
    setting need not be the last.
    """
    is_on, is_over = Event(), Event()

    def hold() -> None:
        try:
            with setting():
                is_on.set()
                is_over.wait()
        finally:
            is_on.set()

    thread = Thread(target=hold, daemon=True)
    thread.start()
    is_on.wait()
    try:
        yield
    finally:
        is_over.set()
        thread.join()


_TURNS = _Turns()
"""A single object, because the threads of BLAS belong to the process."""


@contextmanager
def blas_threads_for(order: int) -> Iterator[None]:
    """Limit BLAS to one thread for matrices of small order, and allow all threads for larger matrices.

    Parameters
    ----------
    order : int
        Order of the largest matrix.

    Notes
    -----
    For matrices of a few hundred rows a second thread gains nothing; on a busy computer waiting for it has taken ten
    times as long as the work itself.

    The last bits of a product depend on the number of threads, which most BLAS libraries set for the whole process.
    Results must not depend on other threads of the program, so small and large problems take turns: either small ones
    run at the same time, or large ones. Afterwards BLAS has its previous number of threads. Libraries with a limit for
    each thread get that limit, too.
    """
    is_small = order <= LARGE
    with _TURNS.shared(is_small, _one_blas_thread_for_all), _one_blas_thread() if is_small else nullcontext():
        yield


def _one_blas_thread_for_all() -> AbstractContextManager[Any]:
    has_one = all(library.num_threads == 1 for library in _blas_libraries().lib_controllers)
    return nullcontext() if has_one else _held_by_a_thread(_one_blas_thread)


def _one_blas_thread() -> AbstractContextManager[Any]:
    limit: AbstractContextManager[Any] = _blas_libraries().limit(limits=1)
    return limit


@cache
def _blas_libraries() -> ThreadpoolController:
    """Return the BLAS libraries of numpy and scipy; the search takes as long as an LU of order 200."""
    import scipy.linalg.lapack  # noqa: F401 - only libraries that are loaded are found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def for_each_chunk(work: Callable[[Chunk], Result], chunks: Iterable[Chunk], *, n_integrals: int) -> list[Result]:
    """Call a function for each chunk of rows, in several threads if there are many integrals.

    Parameters
    ----------
    work : callable
        Function of a chunk. Array operations release the interpreter lock, so threads run in parallel.
    chunks : iterable
        Slices of rows, or indices of clusters.
    n_integrals : int
        Integrals of one kind in all chunks: element pairs times products of the polynomials on both elements.

    Returns
    -------
    list
        Results in the order of the chunks.
    """
    count = n_threads(n_integrals)
    if count == 1:
        return [work(chunk) for chunk in chunks]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, chunks))


def n_threads(n_integrals: int) -> int:
    """Return the number of threads for a number of integrals."""
    affinity = getattr(os, "sched_getaffinity", None)
    available = len(affinity(0)) if affinity else os.cpu_count() or 1
    return 1 if n_integrals < MANY_INTEGRALS else min(available, MAX_THREADS)
