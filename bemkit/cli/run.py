"""The command ``bemkit run``."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bemkit.cli import options
from bemkit.cli.options import outputs_of, place_of, reserve, result_target, shown_progress, write_animation
from bemkit.cli.outputs import Outputs
from bemkit.cli.process import complain, exit_code_of, exit_code_of_error, most_serious
from bemkit.errors import BemkitError, concerning, one_line

if TYPE_CHECKING:
    from bemkit.results.solution import Solution
    from bemkit.scene.scene import Scene
    from bemkit.solvers.base import StepRecord

_COARSEST = 40
"""Least number of elements of the coarsest mesh of `--cascade`."""


@dataclass(frozen=True)
class _Run:
    """How a scene is solved, and where its result goes."""

    load: Callable[[str], Scene]
    output: str | None
    inside: int
    outputs: Outputs[Solution]
    what: tuple[str, ...] | None
    cascade: bool
    explain: bool
    quiet: bool


@click.command()
@click.argument("scenes", metavar="SCENE...", nargs=-1, required=True)
@click.option("-o", "--output", metavar="FILE", help="Write the result: .h5, .json, .csv, .npz or .vtu.")
@options.inside_option
@options.json_option
@options.csv_option
@options.plot_option
@options.what_option
@options.changes_scene("settings", "elements", "accuracy", "discretisation", "degree", "solver", "rho")
@click.option("--cascade", is_flag=True, help="Solve on coarser meshes first and start from there.")
@click.option("--explain", is_flag=True, help="Print planned and measured time and memory, and what was skipped.")
@options.quiet_option
def run(
    scenes: tuple[str, ...],
    output: str | None,
    inside: int,
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    what: tuple[str, ...] | None,
    cascade: bool,
    explain: bool,
    quiet: bool,
    load: Callable[[str], Scene],
) -> int:
    """Solve each SCENE, a TOML file or the name of a shipped scene.

    With several scenes the names of files and folders end with that of the scene, and an error of one does not stop
    the others; the exit code is the most serious one.
    """
    names = options.names_of_scenes(scenes, writes=any((output, json_file, csv_file, folder)))
    runs = []
    for name in names:
        place = place_of(output, name)
        outputs = outputs_of(place_of(json_file, name), place_of(csv_file, name), place_of(folder, name), what=what)
        reserve(outputs.check(result_target(place, inside)))
        runs.append(_Run(load, place, inside, outputs, what, cascade, explain, quiet))
    if len(scenes) == 1:
        return _solve_and_write(scenes[0], runs[0])
    codes = []
    for scene, own in zip(scenes, runs, strict=True):
        try:
            codes.append(_solve_and_write(scene, own))
        except BemkitError as error:
            complain(one_line(error))
            codes.append(exit_code_of_error(error))
    return most_serious(codes)


def _solve_and_write(scene: str, own: _Run) -> int:
    """Solve a scene, write and print its result, and return the exit code."""
    with ExitStack() as stack:
        callback = stack.enter_context(shown_progress(own.quiet))  # shown before anything is loaded
        chosen = own.load(scene)
        with concerning(scene):
            history_file = _history_file(chosen, own.output)
            if own.explain:
                _start_tracing()
            try:
                solution = _solve(chosen, cascade=own.cascade, callback=callback, history_file=history_file)
            finally:
                tracemalloc.stop()
        if own.outputs.uses_stdout:
            stack.close()  # no bar among the data
        begin = time.perf_counter()
        if own.output is not None and history_file is None:
            from bemkit.results.export import export_result

            export_result(own.output, solution, inside=own.inside)
        own.outputs.write(solution)
        write_animation(solution, own.outputs.folder, own.what)
        output_seconds = time.perf_counter() - begin
    if not own.quiet and not own.outputs.uses_stdout:
        from bemkit.cli.console import print_summary

        print_summary(solution)
    if own.explain:
        from bemkit.cli.console import print_explanation

        print_explanation(solution, output_seconds, to_stderr=own.outputs.uses_stdout)
    return exit_code_of(solution)


def _history_file(scene: Scene, output: str | None) -> str | None:
    """Return the result file of a load history, which is written step by step; None of other runs."""
    return (
        output if scene.n_steps > 1 and output is not None and Path(output).suffix.lower() in (".h5", ".hdf5") else None
    )


def _solve(
    scene: Scene, *, cascade: bool, callback: Callable[[StepRecord], None] | None, history_file: str | None
) -> Solution:
    from bemkit.runs.run import run as solve_scene

    file, coarsest = (None, _COARSEST) if cascade else (history_file, None)
    solution: Solution = solve_scene(scene, coarsest=coarsest, file=file, callback=callback)
    return solution


def _start_tracing() -> None:
    """Begin to trace memory, after loading the modules that every run uses."""
    import scipy.linalg  # noqa: F401

    import bemkit.results.error_indicators
    import bemkit.runs.run  # noqa: F401

    tracemalloc.start()
