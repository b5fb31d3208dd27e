"""Ctrl-C that nothing swallows, or that waits for a short statement."""

from __future__ import annotations

import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


class _Remembering:
    """Handler of SIGINT that raises like Python's own and keeps in mind that it did.

    Python prints and drops an exception that is raised inside a callback of a weak reference or a finalizer.
    """

    def __init__(self) -> None:
        self.has_come = False

    def __call__(self, number: int, frame: FrameType | None) -> None:
        self.has_come = True
        signal.default_int_handler(number, frame)


@contextmanager
def interruptible() -> Iterator[None]:
    """Let Ctrl-C end a ``with`` statement, or as a decorator a function, wherever it falls.

    It raises KeyboardInterrupt at once. If that was swallowed, `raise_missed_interrupt` raises it again, at the latest
    the end of the statement. Only in the main thread, and only in place of Python's own handler, which returns
    afterwards.
    """
    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield
        raise_missed_interrupt()
        return
    signal.signal(signal.SIGINT, _Remembering())
    try:
        yield
        raise_missed_interrupt()
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def raise_missed_interrupt() -> None:
    """Raise KeyboardInterrupt if one was swallowed since `interruptible` began."""
    handler = signal.getsignal(signal.SIGINT)
    if isinstance(handler, _Remembering) and handler.has_come and threading.current_thread() is threading.main_thread():
        raise KeyboardInterrupt


@contextmanager
def uninterrupted() -> Iterator[None]:
    """Hold back Ctrl-C and SIGTERM until the end of a short ``with`` statement; only in the main thread."""
    came: list[int] = []
    is_main = threading.current_thread() is threading.main_thread()
    handlers = {number: signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM) if is_main}
    known = {number: handler for number, handler in handlers.items() if handler is not None}  # set by Python
    for number in known:
        signal.signal(number, lambda number, _: came.append(number))
    try:
        yield
    finally:
        for number, handler in known.items():
            signal.signal(number, handler)
        for signal_number in came:
            signal.raise_signal(signal_number)
