"""The command ``bemkit stability``."""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from bemkit.scene.scene import Scene
    from bemkit.studies.engine import StudyOutputs
    from bemkit.studies.stability.cases import Axis
    from bemkit.studies.stability.records import StabilityRecord


@click.command()
@click.argument("scene", required=False)
@click.option("--axis", "names", multiple=True, metavar="NAME", help="Only this axis; may be given several times.")
@click.option("-o", "--output", metavar="FILE", help="Keep the rows (HDF5); rows already in the file are not repeated.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the rows as CSV; - is standard output.")
@click.option("--markdown", "markdown", metavar="FILE", help="Write tables as Markdown; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw one figure for each axis into a folder.")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--discretisation", metavar="WORD", help="Such as linear or constant, instead of the scene's.")
@click.option("--random", "count", type=click.IntRange(1), metavar="N", help="Solve N random scenes instead.")
@click.option("--seed", type=click.IntRange(0), metavar="N", help="Of the random scenes (0).")
@click.option("--first", type=click.IntRange(0), metavar="N", help="Number of the first random scene (0).")
@click.option("--jobs", type=click.IntRange(1), metavar="N", help="Processes for random scenes (all processors).")
@click.option("--save", "failures", metavar="DIR", help="Keep random scenes that fail as TOML in a folder.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither progress nor tables.")
def stability(
    scene: str | None,
    names: tuple[str, ...],
    output: str | None,
    csv_file: str | None,
    markdown: str | None,
    folder: str | None,
    elements: int | None,
    discretisation: str | None,
    count: int | None,
    seed: int | None,
    first: int | None,
    jobs: int | None,
    failures: str | None,
    quiet: bool,
) -> int:
    """Drive SCENE (paper-1 by default) to its extremes and judge every answer by independent evidence.

    With --random many scenes of every kind are judged instead. The exit code is 1 if an answer is wrong or an error
    has no name.
    """
    sweeps = {
        "SCENE": scene, "--axis": names, "--output": output, "--csv": csv_file, "--markdown": markdown,
        "--plot": folder, "--elements": elements, "--discretisation": discretisation,
    }  # fmt: skip
    trials = {"--seed": seed, "--first": first, "--jobs": jobs, "--save": failures}
    if count is not None:
        _refuse(sweeps, "goes with a sweep of one scene: leave it out, or --random")
        return _try_random(count, seed or 0, first or 0, jobs, failures, quiet=quiet)
    _refuse(trials, "goes with random scenes: add --random, such as --random 200")
    uses_stdout = "-" in (csv_file, markdown)
    if csv_file == markdown == "-":
        raise click.UsageError("--csv - and --markdown - both print to standard output: give one of them")
    from bemkit.atomic_files import reserved
    from bemkit.scene.toml import load_scene, with_overrides
    from bemkit.studies.stability.axes import AXES
    from bemkit.studies.stability.cases import find_axes

    axes = find_axes(AXES, names)
    outputs = _outputs(axes, output, csv_file, markdown, folder)
    click.get_current_context().with_resource(reserved(outputs.check()))
    chosen = with_overrides(load_scene(scene or "paper-1"), elements=elements, discretisation=discretisation)
    shows_tables = not quiet and not uses_stdout
    records = _records(chosen, axes, outputs, is_live=_is_live(quiet), shows_tables=shows_tables)
    outputs.write(records)
    if shows_tables:
        from bemkit.studies.stability.report import print_verdicts

        print_verdicts(records)
    return int(any(record.verdict == "wrong" for record in records))


def _refuse(options: Mapping[str, object], remedy: str) -> None:
    """Refuse the first option that is given."""
    for name, value in options.items():
        if value not in (None, ()):
            raise click.UsageError(f"{name} {remedy}")


def _try_random(count: int, seed: int, first: int, jobs: int | None, folder: str | None, *, quiet: bool) -> int:
    """Solve and judge random scenes; those that fail are on the disk as soon as they are known."""
    from os import cpu_count

    from bemkit.results.outputs import make_folder
    from bemkit.studies.engine import compute_with_progress
    from bemkit.studies.stability.report import print_trials
    from bemkit.studies.stability.trials import save_trial, trial_tasks

    if folder is not None:
        make_folder(Path(folder))
    tasks = trial_tasks(seed, range(first, first + count))
    trials = []
    processes = min(jobs or cpu_count() or 1, count)
    for trial in compute_with_progress(tasks, "random scenes", is_live=_is_live(quiet), processes=processes):
        trials.append(trial)
        if folder is not None and trial.is_failure:
            save_trial(trial, Path(folder))
    trials.sort(key=lambda trial: trial.index)
    if not quiet:
        print_trials(trials)
    return int(any(trial.is_failure for trial in trials))


def _outputs(
    axes: Sequence[Axis], path: str | None, csv_file: str | None, markdown: str | None, folder: str | None
) -> StudyOutputs[StabilityRecord]:
    from bemkit.results.outputs import TextFile
    from bemkit.studies.engine import StudyOutputs
    from bemkit.studies.stability.records import CSV_START, FILE, MARKDOWN_START, to_csv, to_markdown
    from bemkit.studies.stability.report import draw_axes, figure_name

    texts = (
        TextFile(csv_file, "CSV file of stability rows", CSV_START, to_csv),
        TextFile(markdown, "Markdown file of stability tables", MARKDOWN_START, partial(to_markdown, axes)),
    )
    return StudyOutputs(FILE, path, texts, folder, partial(draw_axes, axes), figure_name(axes[0]))


def _records(
    scene: Scene,
    axes: Sequence[Axis],
    outputs: StudyOutputs[StabilityRecord],
    *,
    is_live: bool,
    shows_tables: bool,
) -> list[StabilityRecord]:
    """Compute what is missing, keep every record at once, and print each axis when it is complete."""
    from bemkit.scene.toml import scene_to_toml
    from bemkit.studies.engine import Task, compute_with_progress
    from bemkit.studies.stability.report import print_axis
    from bemkit.studies.stability.sweep import sweep

    labels = {"scene": scene_to_toml(scene) if outputs.path else ""}
    finished = outputs.finished(labels)
    remaining = iter(axes)

    def run_axis(tasks: Sequence[Task[StabilityRecord]]) -> list[StabilityRecord]:
        axis = next(remaining)
        computed = compute_with_progress(tasks, axis.name, is_live=is_live, finished=finished)
        records = list(outputs.keep(computed, finished, labels))
        if shows_tables:
            print_axis(axis, records)
        return records

    return list(sweep(scene, axes, run_axis))


def _is_live(quiet: bool) -> bool:
    return not quiet and sys.stderr.isatty()
