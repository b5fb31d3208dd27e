"""Threads of the linear algebra: one for small matrices, all for large ones."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

LARGE = 1500
"""Order of a matrix above which several threads factor it faster than one."""


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
    import scipy.linalg.lapack  # noqa: F401 - the limit only reaches libraries that are loaded
    from threadpoolctl import threadpool_limits

    with threadpool_limits(limits=1, user_api="blas"):
        yield
