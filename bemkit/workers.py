"""Processes that compute rows, and end with the one that started them."""

from __future__ import annotations

import os
import signal
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context, parent_process
from threading import Thread


@contextmanager
def worker_processes(count: int) -> Iterator[ProcessPoolExecutor]:
    """Give an executor of several processes; what has not begun when the ``with`` statement ends is left out.

    The processes end at once when the one that started them ends, however that is killed, and on Ctrl-C.
    """
    # spawned processes do not inherit threads that hold locks
    executor = ProcessPoolExecutor(count, mp_context=get_context("spawn"), initializer=_prepare)
    try:
        yield executor
    finally:
        executor.shutdown(cancel_futures=True)


def _prepare() -> None:
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    """Wait for the end of the parent: a worker holds both ends of its queue, and would wait for work for ever."""
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
