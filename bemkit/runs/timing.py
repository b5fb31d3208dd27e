"""Where the time and the memory of a run go, stage by stage."""

from __future__ import annotations

import enum
import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

from bemkit.operators.stopwatch import AssemblyTime, announce, traced_peak


class Stage(enum.Enum):
    """The parts of a run, by their names in `Solution.timings`; writing outputs comes after it."""

    MESH = "mesh"
    ASSEMBLE = "assemble"
    CONDENSE = "condense"
    SOLVE = "solve"
    RECOVER = "recover"


_FOLLOWING = {Stage.MESH: Stage.ASSEMBLE, Stage.CONDENSE: Stage.SOLVE, Stage.SOLVE: Stage.RECOVER}
"""What comes after the end of a stage."""


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
