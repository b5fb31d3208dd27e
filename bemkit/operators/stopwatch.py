"""What the matrices of boundary operators take, wherever on the way of a solve they are computed."""

from __future__ import annotations

import logging
import time
import tracemalloc
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

PROGRESS = logging.getLogger("bemkit.progress")
"""Where runs say what they are doing, at the level DEBUG."""

_running: ContextVar[AssemblyTime | None] = ContextVar("assembly time", default=None)


@dataclass
class AssemblyTime:
    """What was spent in assembly since the stopwatch was started.

    Parameters
    ----------
    seconds : float [s]
    peak, peak_outside : int [bytes]
        Largest memory during assembly, and before and between; zero unless `tracemalloc` is tracing.
    """

    seconds: float = 0.0
    peak: int = 0
    peak_outside: int = 0


def announce(what: str, seconds: float | None = None) -> None:
    """Say what happens next, to those who listen to `PROGRESS`.

    Parameters
    ----------
    what : str
        A stage such as ``"solve"``; of a new mesh its size.
    seconds : float, optional [s]
        Time that a new mesh will take about.
    """
    if PROGRESS.isEnabledFor(logging.DEBUG):
        PROGRESS.debug(what, extra={"seconds": seconds})


def traced_peak() -> int:
    """Return the largest traced memory since the last call [bytes], zero unless `tracemalloc` is tracing."""
    if not tracemalloc.is_tracing():
        return 0
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    return peak


@contextmanager
def assembly_time() -> Iterator[AssemblyTime]:
    """Measure what is spent in assembly inside a ``with`` statement."""
    spent = AssemblyTime()
    token = _running.set(spent)
    try:
        yield spent
    finally:
        _running.reset(token)


@contextmanager
def assembling() -> Iterator[None]:
    """Mark a piece of code, or as a decorator a function, as assembly."""
    spent = _running.get()
    if spent is None:
        yield
        return
    spent.peak_outside = max(spent.peak_outside, traced_peak())
    announce("assemble")
    begin = time.perf_counter()
    token = _running.set(None)  # a marked function that calls another one counts once
    try:
        yield
    finally:
        _running.reset(token)
        spent.seconds += time.perf_counter() - begin
        spent.peak = max(spent.peak, traced_peak())
        announce("condense")
