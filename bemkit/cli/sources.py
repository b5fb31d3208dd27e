"""Sources of pictures and reports: a result file, or a scene, which is solved first."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

from bemkit.errors import InputError, concerning
from bemkit.results.result_file import read_result
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.toml import load_scene
from bemkit.solvers.base import StepRecord

RESULT_ENDINGS = (".h5", ".hdf5")


def solved(source: str, callback: Callable[[StepRecord], None] | None) -> Solution:
    """Return the solution in a result file, or that of a scene; the callback as for `run`."""
    if Path(source).suffix.lower() in RESULT_ENDINGS:
        return read_result(source)
    scene = load_scene(source)
    with concerning(source):
        solution: Solution = run(scene, callback=callback)
    return solution


def solved_steps(source: str, callback: Callable[[StepRecord], None] | None) -> Sequence[Solution]:
    """Return the solutions of the finished load steps, the last one with the status of the whole history."""
    solution = solved(source, callback)
    if solution.loading is not None:
        return [*solution.each_step()[:-1], solution]
    if Path(source).suffix.lower() in RESULT_ENDINGS:
        raise InputError(f"{source}: the result has no load steps: give a scene with [[steps]] or load_factors")
    return [solution]
