"""Time and memory of a run by stage, and those of assembly in any stage."""

from __future__ import annotations

import enum
import logging
import time
import tracemalloc
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace

PROGRESS = logging.getLogger("bemkit.progress")
"""Logger of the progress of runs, at the level DEBUG."""

_running: ContextVar[AssemblyTime | None] = ContextVar("assembly time", default=None)


@dataclass
class AssemblyTime:
    """Time and memory of assembly since the start of the stopwatch.

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


class Stage(enum.Enum):
    """The parts of a run, by their names in `Solution.timings`; outputs of the whole result come after it."""

    MESH = "mesh"
    ASSEMBLE = "assemble"
    CONDENSE = "condense"
    SOLVE = "solve"
    RECOVER = "recover"
    WRITE = "write"
    """Write the step before to a result file that grows with the steps."""


_FOLLOWING = {Stage.MESH: Stage.ASSEMBLE, Stage.CONDENSE: Stage.SOLVE, Stage.SOLVE: Stage.RECOVER}
"""The stage that follows the end of a stage."""


@dataclass(frozen=True)
class StageClock:
    """Measures one stage after the other; memory only where `tracemalloc` is tracing.

    Parameters
    ----------
    seconds : mapping of Stage to float [s]
    peaks : mapping of Stage to int [bytes]
    last : float [s]
        When the last stage was closed; what happens afterwards belongs to the stage that is closed next.
    """

    seconds: Mapping[Stage, float]
    peaks: Mapping[Stage, int]
    last: float

    @classmethod
    def start(cls) -> StageClock:
        """Return a clock that has measured nothing yet."""
        traced_peak()
        announce(Stage.MESH.value)
        return cls(dict.fromkeys(Stage, 0.0), dict.fromkeys(Stage, 0), time.perf_counter())

    def closed(self, stage: Stage) -> StageClock:
        """Charge what has happened since the last call to a stage."""
        now = time.perf_counter()
        if stage in _FOLLOWING:
            announce(_FOLLOWING[stage].value)
        seconds = {**self.seconds, stage: self.seconds[stage] + now - self.last}
        return StageClock(seconds, {**self.peaks, stage: max(self.peaks[stage], traced_peak())}, now)

    def closed_build(self, assembly: AssemblyTime) -> StageClock:
        """Charge it to assembly, as far as that was measured there, and to condensation."""
        clock = self.closed(Stage.CONDENSE)
        seconds, peaks = dict(clock.seconds), dict(clock.peaks)
        seconds[Stage.CONDENSE] -= assembly.seconds
        seconds[Stage.ASSEMBLE] += assembly.seconds
        peaks[Stage.CONDENSE] = max(peaks[Stage.CONDENSE], assembly.peak_outside)
        peaks[Stage.ASSEMBLE] = max(peaks[Stage.ASSEMBLE], assembly.peak)
        return replace(clock, seconds=seconds, peaks=peaks)

    @property
    def timings(self) -> dict[str, float]:
        """Seconds of each stage, and of all."""
        result = {stage.value: seconds for stage, seconds in self.seconds.items()}
        return {**result, "total": sum(self.seconds.values())}

    @property
    def memory(self) -> dict[str, int]:
        """Largest traced memory of each stage [bytes]; empty if nothing was traced."""
        return {stage.value: peak for stage, peak in self.peaks.items() if peak}
