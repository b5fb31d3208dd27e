"""The command ``bemkit stability``."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator, Sequence
from functools import partial
from typing import TYPE_CHECKING

import click

from bemkit.cli import options
from bemkit.cli.options import StudyProgress, reserve, study_output
from bemkit.cli.outputs import Outputs, TextFile, csv_of

if TYPE_CHECKING:
    from bemkit.scene.scene import Scene
    from bemkit.studies.engine import Task
    from bemkit.studies.stability.axes import Axis
    from bemkit.studies.stability.records import StabilityRecord


@click.command()
@click.argument("scene", required=False)
@click.option("--axis", "axis", multiple=True, metavar="NAME,...", callback=options.names_of, help="Only these axes.")
@options.rows_option
@options.csv_option
@options.markdown_option
@options.plot_option
@options.changes_scene("elements", "discretisation")
@options.quiet_option
def stability(
    scene: str | None,
    axis: tuple[str, ...],
    output: str | None,
    csv_file: str | None,
    markdown: str | None,
    folder: str | None,
    quiet: bool,
    load: Callable[[str], Scene],
) -> int:
    """Solve extreme variants of SCENE (paper-1 by default) and check every result independently.

    The exit code is 1 if a result is wrong. Random scenes are in the repository: python -m checks.random_scenes 200.
    """
    with StudyProgress(quiet) as progress:
        from bemkit.cli.printed_stability import print_axis, print_left_out, print_verdicts
        from bemkit.scene.toml import scene_to_toml
        from bemkit.studies.stability.axes import axes_of, find_axes
        from bemkit.studies.stability.figures import draw_axes, figure_name
        from bemkit.studies.stability.records import FILE, table_of, to_markdown
        from bemkit.studies.stability.sweep import sweep

        chosen = load(scene or "paper-1")
        every = find_axes(axis)
        # an axis that is asked for by its name is refused by the sweep
        axes = every if axis else axes_of(chosen)
        rows, table = study_output(output, table_of)
        texts = table, csv_of(csv_file, table_of), TextFile(markdown, partial(to_markdown, axes))
        outputs = Outputs(texts, folder, partial(draw_axes, axes), figure_name(axes[0]))
        reserve(outputs.check(FILE.check(rows)))
        shows_tables = not quiet and not outputs.uses_stdout
        labels = {"scene": scene_to_toml(chosen) if rows else ""}

        def run_axis(axis: Axis, tasks: Sequence[Task[StabilityRecord]]) -> list[StabilityRecord]:
            def computed(finished: Container[object]) -> Iterator[StabilityRecord]:
                return progress.compute([task for task in tasks if task.key not in finished], axis.name)

            by_key = FILE.completed(rows, labels, computed)
            records = [by_key[task.key] for task in tasks]
            if shows_tables:
                print_axis(axis, records)
            return records

        records = list(sweep(chosen, axes, run_axis))
    outputs.write(records)
    if shows_tables:
        print_left_out({each.name: each.reason_against(chosen) for each in every if each not in axes})
        print_verdicts(records)
    return int(any(record.verdict == "wrong" for record in records))
