"""Processes that compute rows, and end with the one that started them."""

from __future__ import annotations

import os
import signal
from multiprocessing import parent_process
from threading import Thread


def end_with_parent() -> None:
    """Prepare a worker process: it ends at once when its parent ends, however that is killed, and on Ctrl-C.

    A worker that waits for work holds both ends of its queue and would otherwise wait for ever.
    """
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    Thread(target=_end_after_parent, daemon=True).start()


def _end_after_parent() -> None:
    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)
