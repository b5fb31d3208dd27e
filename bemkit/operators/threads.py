"""Threads: one for small work, all for large."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

Result = TypeVar("Result")

LARGE = 2500
"""Order of a matrix above which several threads factor it faster than one."""
MANY_PAIRS = 500_000
"""Element pairs above which several threads assemble faster than one."""
MAX_THREADS = 8


@contextmanager
def blas_threads_for(order: int) -> Iterator[None]:
    """Hold BLAS to one thread while matrices of a small order are at work.

    Parameters
    ----------
    order : int
        Order of the largest matrix.

    Notes
    -----
    On matrices of a few hundred rows a second thread gains nothing, and on a machine that is busy with other things
    waiting for it has been seen to cost ten times the work itself.
    """
    if order > LARGE:
        yield
        return
    with _blas_libraries().limit(limits=1):
        yield


@cache
def _blas_libraries() -> ThreadpoolController:
    """Find the BLAS libraries of numpy and scipy; that takes as long as the LU of a matrix of order 200."""
    import scipy.linalg.lapack  # noqa: F401 - only libraries that are loaded are found
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController().select(user_api="blas")


def for_each_chunk(work: Callable[[slice], Result], chunks: Iterable[slice], *, n_pairs: int) -> list[Result]:
    """Call a function on every chunk of rows, from several threads if there are many element pairs.

    Parameters
    ----------
    work : callable
        Takes a slice of rows; array operations release the interpreter, so threads help although this is Python.
    chunks : iterable of slice
    n_pairs : int
        Element pairs in all chunks together.

    Returns
    -------
    list
        What the function returned, in the order of the chunks.
    """
    count = n_threads(n_pairs)
    if count == 1:
        return [work(chunk) for chunk in chunks]
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(work, chunks))


def n_threads(n_pairs: int) -> int:
    """Return how many threads assemble a number of element pairs."""
    affinity = getattr(os, "sched_getaffinity", None)
    available = len(affinity(0)) if affinity else os.cpu_count() or 1
    return 1 if n_pairs < MANY_PAIRS else min(available, MAX_THREADS)
