"""Threads: one for small work, all for large."""

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
"""Integrals, of products of polynomials on pairs of elements, above which several threads assemble faster than one."""
MAX_THREADS = 8


class _Turns:
    """Lets threads of one process share a setting that only the whole process can have.

    Threads that want the same setting share it, others wait for their turn, in the order in which they came. The
    first of those who share switches the setting on and the last one off again. A thread that has it already keeps
    it, in every call: waiting for itself would never end.
    """

    def __init__(self) -> None:
        self._change = Condition()
        self._waiting: list[object] = []
        self._users: Counter[int] = Counter()
        self._shared = False
        self._setting = ExitStack()

    @contextmanager
    def shared(self, is_wanted: bool, setting: Callable[[], AbstractContextManager[Any]]) -> Iterator[None]:
        """Hold the setting if it is wanted, and keep it off if it is not."""
        me = get_ident()
        with self._change:
            if not self._users[me]:
                self._take_turn(is_wanted)
            if not self._users.total() and is_wanted:
                self._setting.enter_context(setting())
            self._users[me] += 1
        try:
            yield
        finally:
            with self._change:
                self._users[me] -= 1
                if not self._users.total():
                    self._setting.close()
                self._users += Counter()  # drops the threads that have left
                self._change.notify_all()

    def _take_turn(self, is_wanted: bool) -> None:
        ticket = object()
        self._waiting.append(ticket)
        try:
            self._change.wait_for(
                lambda: self._waiting[0] is ticket and (not self._users.total() or self._shared == is_wanted)
            )
        finally:  # an interrupt ends the waiting, too
            self._waiting.remove(ticket)
            self._change.notify_all()
        self._shared = is_wanted


@contextmanager
def _held_by_a_thread(setting: Callable[[], AbstractContextManager[Any]]) -> Iterator[None]:
    """Hold a setting in a thread of its own: threadpoolctl lets no other thread lift a limit than the one that set it.

    The threads that share the setting come and go; the first need not be the last.
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
"""One for the process, because the threads of BLAS belong to the process."""


@contextmanager
def blas_threads_for(order: int) -> Iterator[None]:
    """Hold BLAS to one thread while matrices of a small order are at work, and to all while larger ones are.

    Parameters
    ----------
    order : int
        Order of the largest matrix.

    Notes
    -----
    On matrices of a few hundred rows a second thread gains nothing, and on a machine that is busy with other things
    waiting for it has been seen to cost ten times the work itself.

    The last bits of a product depend on the number of threads, which most BLAS libraries keep for the whole process. So
    that a result does not depend on what other threads of the program compute, small and large work take turns: any
    number of small runs at the same time, or any number of large ones. When nothing runs, BLAS has the threads that it
    had before. Libraries that know a limit for each thread get it besides.
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
    """Find the BLAS libraries of numpy and scipy; that takes as long as the LU of a matrix of order 200."""
    import scipy.linalg.lapack  # noqa: F401 - only libraries that are loaded are found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def for_each_chunk(work: Callable[[Chunk], Result], chunks: Iterable[Chunk], *, n_integrals: int) -> list[Result]:
    """Call a function on every chunk of rows, from several threads if there are many integrals.

    Parameters
    ----------
    work : callable
        Takes a chunk; array operations release the interpreter, so threads help although this is Python.
    chunks : iterable
        Slices of rows, or the numbers of clusters of rows.
    n_integrals : int
        Of one kind in all chunks together: element pairs times products of the polynomials on both elements.

    Returns
    -------
    list
        What the function returned, in the order of the chunks.
    """
    count = n_threads(n_integrals)
    if count == 1:
        return [work(chunk) for chunk in chunks]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, chunks))


def n_threads(n_integrals: int) -> int:
    """Return how many threads compute a number of integrals."""
    affinity = getattr(os, "sched_getaffinity", None)
    available = len(affinity(0)) if affinity else os.cpu_count() or 1
    return 1 if n_integrals < MANY_INTEGRALS else min(available, MAX_THREADS)
