"""The command ``bemkit sweep``."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING

import click

from bemkit.cli import options
from bemkit.cli.options import StudyProgress, reserve, study_output
from bemkit.cli.outputs import Outputs, TextFile, csv_of
from bemkit.cli.process import NOT_CONVERGED
from bemkit.errors import concerning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bemkit.scene.scene import Scene
    from bemkit.studies.sweep.table import Sweep

DEFAULT_SHOWN = "force_tangential"


@click.command()
@click.argument("scene")
@click.option(
    "--vary", multiple=True, required=True, metavar="KEY=...", help="Values A:B:N or A,B,...; repeat it for a grid."
)
@options.rows_option
@options.csv_option
@options.json_option
@options.plot_option
@click.option("--over", metavar="KEY", help="Abscissa of the figures (the first key).")
@click.option(
    "--show",
    multiple=True,
    metavar="NAME,...",
    callback=options.names_of,
    help=f"Results to draw ({DEFAULT_SHOWN}).",
)
@options.changes_scene("settings", "elements", "accuracy", "discretisation")
@click.option("--cold", is_flag=True, help="Start each row from zero, not from the row before.")
@click.option("--jobs", type=click.IntRange(1), metavar="N", help="Number of processes (1).")
@click.option("--on", "cluster", metavar="ADDRESS", help="Scheduler of a dask cluster, such as tcp://10.0.0.1:8786.")
@options.quiet_option
def sweep(
    scene: str,
    vary: tuple[str, ...],
    output: str | None,
    csv_file: str | None,
    json_file: str | None,
    folder: str | None,
    over: str | None,
    show: tuple[str, ...],
    cold: bool,
    jobs: int | None,
    cluster: str | None,
    quiet: bool,
    load: Callable[[str], Scene],
) -> int:
    """Solve SCENE for several values of its numbers, such as --vary law.friction_coefficient=0:1:11.

    The exit code is 1 if a row has no certified result, or is less accurate than requested.
    """
    if jobs is not None and cluster is not None:
        raise click.UsageError("--jobs and --on exclude each other: give one of them")
    if folder is None and (over is not None or show):
        raise click.UsageError("--over and --show go with figures: add --plot DIR")
    with StudyProgress(quiet) as progress:
        from bemkit.studies.sweep.grid import read_variations
        from bemkit.studies.sweep.records import FILE
        from bemkit.studies.sweep.sweep import run_sweep
        from bemkit.studies.sweep.table import Sweep

        values = read_variations(vary)
        rows, table = study_output(output, Sweep.as_table)
        texts = table, csv_of(csv_file, Sweep.as_table), TextFile(json_file, Sweep.to_json)
        outputs = Outputs(texts, folder, *_figures(tuple(values), over, show or (DEFAULT_SHOWN,)))
        reserve(outputs.check(FILE.check(rows)))
        chosen = load(scene)
        computed = partial(progress.compute, name="sweep", processes=jobs or 1, cluster=cluster)
        with concerning(scene):
            found = run_sweep(chosen, values, computed, file=rows, cold=cold)
    outputs.write(found)
    if not quiet and not outputs.uses_stdout:
        from bemkit.cli.printed_sweep import print_sweep

        print_sweep(found)
    return 0 if all(row.status == "converged" for row in found.rows) else NOT_CONVERGED


def _figures(
    keys: tuple[str, ...], over: str | None, shown: tuple[str, ...]
) -> tuple[Callable[[Sweep], dict[str, Figure]], str]:
    """Return how to draw some columns over the first key or another column, and the name of the first figure."""
    from bemkit.studies.sweep.figures import draw_all, figure_name
    from bemkit.studies.sweep.records import NUMBERS

    abscissa, names = over or keys[0], [*keys, *NUMBERS]
    for name in (abscissa, *shown):
        if name not in names:
            raise click.UsageError(f"{name!r} is not a column of numbers: give one of {', '.join(names)}")
    return partial(draw_all, abscissa, shown), figure_name(abscissa, shown[0])
