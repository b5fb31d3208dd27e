"""The command ``bemkit stability``."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from os import cpu_count
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from bemkit.cli.options import StudyProgress, reserve
from bemkit.results.outputs import Outputs, TextFile, make_folder

if TYPE_CHECKING:
    from bemkit.studies.engine import Task
    from bemkit.studies.stability.records import StabilityRecord


@click.command()
@click.argument("scene", required=False)
@click.option("--axis", "axis", multiple=True, metavar="NAME", help="Only this axis; may be given several times.")
@click.option("-o", "--output", metavar="FILE", help="Keep the rows (HDF5); rows already in the file are not repeated.")
@click.option("--csv", "csv", metavar="FILE", help="Write the rows as CSV; - is standard output.")
@click.option("--markdown", "markdown", metavar="FILE", help="Write tables as Markdown; - is standard output.")
@click.option("--plot", "plot", metavar="DIR", help="Draw one figure for each axis into a folder.")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--discretisation", metavar="WORD", help="Such as linear or constant, instead of the scene's.")
@click.option("--random", "count", type=click.IntRange(1), metavar="N", help="Solve N random scenes instead.")
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Of the random scenes (0).")
@click.option("--first", type=click.IntRange(0), metavar="N", help="Number of the first random scene (0).")
@click.option("--jobs", type=click.IntRange(1), metavar="N", help="Processes for random scenes (all processors).")
@click.option("--save", metavar="DIR", help="Keep random scenes that fail as TOML in a folder.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither progress nor tables.")
def stability(count: int | None, quiet: bool, **asked: Any) -> int:
    """Drive SCENE (paper-1 by default) to its extremes and judge every answer by independent evidence.

    With --random many scenes of every kind are judged instead. The exit code is 1 if an answer is wrong or an error
    has no name.
    """
    of_trials = {name: asked.pop(name) for name in ("seed", "first", "jobs", "save")}
    superfluous = of_trials if count is None else asked
    for name, value in superfluous.items():
        if value not in (None, ()):
            remedy = "goes with random scenes: add --random, such as --random 200"
            if count is not None:
                remedy = "goes with a sweep of one scene: leave it out, or --random"
            raise click.UsageError(f"{'SCENE' if name == 'scene' else '--' + name} {remedy}")
    return _sweep(**asked, quiet=quiet) if count is None else _try_random(count, **of_trials, quiet=quiet)


def _try_random(
    count: int, *, seed: int | None, first: int | None, jobs: int | None, save: str | None, quiet: bool
) -> int:
    """Solve and judge random scenes; those that fail are on the disk as soon as they are known."""
    with StudyProgress(quiet) as progress:
        from bemkit.studies.stability.report import print_trials
        from bemkit.studies.stability.trials import save_trial, trial_tasks

        if save is not None:
            make_folder(Path(save))
        tasks = trial_tasks(seed or 0, range(first or 0, (first or 0) + count))
        trials = []
        for trial in progress.compute(tasks, "random scenes", processes=min(jobs or cpu_count() or 1, count)):
            trials.append(trial)
            if save is not None and trial.is_failure:
                save_trial(trial, Path(save))
    trials.sort(key=lambda trial: trial.index)
    if not quiet:
        print_trials(trials)
    return int(any(trial.is_failure for trial in trials))


def _sweep(
    scene: str | None,
    *,
    axis: tuple[str, ...],
    output: str | None,
    csv: str | None,
    markdown: str | None,
    plot: str | None,
    elements: int | None,
    discretisation: str | None,
    quiet: bool,
) -> int:
    """Compute what is missing, keep every record at once, and print each axis when it is complete."""
    with StudyProgress(quiet) as progress:
        from bemkit.scene.assembly import Assembly
        from bemkit.scene.toml import load_scene, scene_to_toml, with_overrides
        from bemkit.studies.stability.assembly_axes import ASSEMBLY_AXES
        from bemkit.studies.stability.axes import AXES, find_axes
        from bemkit.studies.stability.records import CSV_START, FILE, MARKDOWN_START, to_csv, to_markdown
        from bemkit.studies.stability.report import draw_axes, figure_name, print_axis, print_left_out, print_verdicts
        from bemkit.studies.stability.sweep import sweep

        chosen = with_overrides(load_scene(scene or "paper-1"), elements=elements, discretisation=discretisation)
        every = find_axes(axis, ASSEMBLY_AXES if isinstance(chosen, Assembly) else AXES)
        # an axis that is asked for by its name is refused by the sweep
        axes = every if axis else tuple(each for each in every if not each.reason_against(chosen))
        texts = (
            TextFile(csv, "CSV file of stability rows", CSV_START, to_csv),
            TextFile(markdown, "Markdown file of stability tables", MARKDOWN_START, partial(to_markdown, axes)),
        )
        outputs = Outputs(texts, plot, partial(draw_axes, axes), figure_name(axes[0]))
        reserve(outputs.check(FILE.check(output)))
        shows_tables = not quiet and not outputs.uses_stdout
        labels = {"scene": scene_to_toml(chosen) if output else ""}
        finished = FILE.finished(output, labels)
        remaining = iter(axes)

        def run_axis(tasks: Sequence[Task[StabilityRecord]]) -> list[StabilityRecord]:
            axis = next(remaining)
            computed = progress.compute(tasks, axis.name, finished=finished)
            records = list(FILE.keep(output, computed, finished, labels))
            if shows_tables:
                print_axis(axis, records)
            return records

        records = list(sweep(chosen, axes, run_axis))
    outputs.write(records)
    if shows_tables:
        print_left_out({each.name: each.reason_against(chosen) for each in every if each not in axes})
        print_verdicts(records)
    return int(any(record.verdict == "wrong" for record in records))
