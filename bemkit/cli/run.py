"""The command ``bemkit run``."""

from __future__ import annotations

import time
import tracemalloc
from collections.abc import Callable
from contextlib import ExitStack
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from bemkit.cli import options
from bemkit.cli.exit_codes import exit_code_of
from bemkit.cli.options import outputs_of, reserve, result_target, shown_progress, write_animation
from bemkit.errors import concerning

if TYPE_CHECKING:
    from bemkit.results.solution import Solution
    from bemkit.scene.scene import Scene
    from bemkit.solvers.base import StepRecord

_COARSEST = 40
"""Elements of the coarsest mesh of `--cascade`, at least."""


@click.command()
@click.argument("scene")
@click.option("-o", "--output", metavar="FILE", help="Write the result: .h5, .json, .csv, .npz or .vtu.")
@options.inside_option
@options.json_option
@options.csv_option
@options.plot_option
@options.what_option
@options.settings_option
@options.elements_option
@options.accuracy_option
@options.discretisation_option
@options.degree_option
@click.option("--solver", metavar="NAME", help="Such as augmented-lagrangian.")
@click.option("--rho", type=float, metavar="R", help="Penalty of the solver [E'/L].")
@click.option("--cascade", is_flag=True, help="Solve on coarser meshes first and start from there.")
@click.option("--explain", is_flag=True, help="Print planned and measured time and memory, and what was skipped.")
@options.quiet_option
def run(
    scene: str,
    output: str | None,
    inside: int,
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    what: tuple[str, ...] | None,
    settings: tuple[str, ...],
    elements: int | None,
    accuracy: float | None,
    discretisation: str | None,
    degree: int | Literal["hp"] | None,
    solver: str | None,
    rho: float | None,
    cascade: bool,
    explain: bool,
    quiet: bool,
) -> int:
    """Solve SCENE, a TOML file or the name of a shipped scene."""
    with ExitStack() as stack:
        callback = stack.enter_context(shown_progress(quiet))  # shown before anything is loaded
        from bemkit.scene.keys import with_settings
        from bemkit.scene.toml import load_scene, with_overrides

        outputs = outputs_of(json_file, csv_file, folder, what=what)
        reserve(outputs.check(result_target(output, inside)))
        chosen = with_overrides(
            with_settings(load_scene(scene), settings),
            elements=elements,
            accuracy=accuracy,
            discretisation=discretisation,
            degree=degree,
            solver=solver,
            rho=rho,
        )
        with concerning(scene):
            history_file = _history_file(chosen, output)
            if explain:
                _start_tracing()
            try:
                solution = _solve(chosen, cascade=cascade, callback=callback, history_file=history_file)
            finally:
                tracemalloc.stop()
        if outputs.uses_stdout:
            stack.close()  # no bar among the data
        begin = time.perf_counter()
        if output is not None and history_file is None:
            from bemkit.results.export import export_result

            export_result(output, solution, inside=inside)
        outputs.write(solution)
        write_animation(solution, folder, what)
        output_seconds = time.perf_counter() - begin
    if not quiet and not outputs.uses_stdout:
        from bemkit.cli.console import print_summary

        print_summary(solution)
    if explain:
        from bemkit.cli.console import print_explanation

        print_explanation(solution, output_seconds, to_stderr=outputs.uses_stdout)
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
    """Trace memory from now on, with what every run loads on first use behind it."""
    import scipy.linalg  # noqa: F401

    import bemkit.results.error_indicators
    import bemkit.runs.run  # noqa: F401

    tracemalloc.start()
