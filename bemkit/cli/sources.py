"""Sources of pictures and reports: a result file, or a scene, which is solved first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from bemkit.errors import InputError, concerning
from bemkit.pictures.shown import Result
from bemkit.results.result_file import read_result
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene
from bemkit.solvers.base import StepRecord

RESULT_ENDINGS = (".h5", ".hdf5")


def solved(source: str, callback: Callable[[StepRecord], None] | None) -> Result:
    """Return the solution in a result file, or that of a scene; the callback as for `run`."""
    if Path(source).suffix.lower() in RESULT_ENDINGS:
        return read_result(source)
    scene = load_scene(source)
    with concerning(source):
        solution: Result = run(scene, callback=callback)
    return solution


def solved_steps(source: str, callback: Callable[[StepRecord], None] | None) -> Sequence[Result]:
    """Return the solutions of all load steps of a scene, or of the finished ones in a result file."""
    if Path(source).suffix.lower() in RESULT_ENDINGS:
        solution = read_result(source)
        if solution.loading is None:
            raise InputError(f"{source}: the result has no load steps: give a scene with [[steps]] or load_factors")
        return solution.each_step()
    scene: Any = load_scene(source)
    with concerning(source):
        steps: Sequence[Result] = run([scene], callback=callback)
    return steps
