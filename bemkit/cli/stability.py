"""The command ``bemkit stability``."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import click

if TYPE_CHECKING:
    from bemkit.scene.scene import Scene
    from bemkit.studies.stability.cases import Axis
    from bemkit.studies.stability.sweep import Row


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
    from bemkit.atomic_files import reserved
    from bemkit.scene.toml import load_scene, with_overrides
    from bemkit.studies.stability.axes import all_axes
    from bemkit.studies.stability.cases import find_axes

    uses_stdout = "-" in (csv_file, markdown)
    if csv_file == markdown == "-":
        raise click.UsageError("--csv - and --markdown - both print to standard output: give one of them")
    click.get_current_context().with_resource(reserved(_check_outputs(output, csv_file, markdown)))
    chosen = with_overrides(load_scene(scene or "paper-1"), elements=elements, discretisation=discretisation)
    axes = find_axes(all_axes(), names)
    rows = _computed(chosen, axes, output, is_quiet=quiet, shows_tables=not quiet and not uses_stdout)
    _write(axes, rows, csv_file, markdown, folder)
    if not quiet and not uses_stdout:
        from bemkit.studies.stability.report import print_verdicts

        print_verdicts(rows)
    return int(any(row.verdict == "wrong" for row in rows))


def _refuse(options: Mapping[str, object], remedy: str) -> None:
    """Refuse the first option that is given."""
    for name, value in options.items():
        if value not in (None, ()):
            raise click.UsageError(f"{name} {remedy}")


def _try_random(count: int, seed: int, first: int, jobs: int | None, folder: str | None, *, quiet: bool) -> int:
    from os import cpu_count

    from bemkit.studies.stability.trial_session import TrialSession, print_trials

    is_live = not quiet and sys.stderr.isatty()
    trials = TrialSession(count, seed, first, jobs or cpu_count() or 1, folder, is_live).run()
    if not quiet:
        print_trials(trials)
    return int(any(trial.is_failure for trial in trials))


def _computed(
    scene: Scene, axes: tuple[Axis, ...], output: str | None, *, is_quiet: bool, shows_tables: bool
) -> list[Row]:
    """Compute what is missing; with an output file every finished row is on the disk at once."""
    from bemkit.scene.toml import scene_to_toml
    from bemkit.studies.stability.files import finished_rows, write_rows
    from bemkit.studies.stability.report import print_axis
    from bemkit.studies.stability.sweep import sweep

    text = scene_to_toml(scene) if output else ""
    known = finished_rows(output, text) if output else {}
    rows: list[Row] = []

    def announce(axis: Axis, value: float) -> None:
        if not is_quiet and sys.stderr.isatty():
            print(f"\r\x1b[K{axis.name} {value:.6g}", end="", file=sys.stderr)

    for row in sweep(scene, axes, finished=known, begins=announce):
        rows.append(row)
        if output and (row.axis, row.value) not in known:
            known[row.axis, row.value] = row
            write_rows(output, text, list(known.values()))
        axis = next(axis for axis in axes if axis.name == row.axis)
        if shows_tables and row.value == axis.values[-1]:
            if sys.stderr.isatty():
                print("\r\x1b[K", end="", file=sys.stderr)
            print_axis(axis, [other for other in rows if other.axis == axis.name])
    return rows


def _check_outputs(output: str | None, csv_file: str | None, markdown: str | None) -> list[Path]:
    """Find out, before any work is done, whether everything can be written; return the files to be reserved."""
    from bemkit.cli.outputs import check_text
    from bemkit.studies.stability.files import CSV_START, FILE, MARKDOWN_START

    if output is not None and Path(output).is_file():
        FILE.read(output)  # says more about a broken file than that it stands in the way
    targets = [] if output is None else [FILE.check_target(output)]
    check_text(csv_file, "CSV file of stability rows", CSV_START)
    check_text(markdown, "Markdown file of stability tables", MARKDOWN_START)
    return targets


def _write(
    axes: tuple[Axis, ...], rows: list[Row], csv_file: str | None, markdown: str | None, folder: str | None
) -> None:
    from bemkit.cli.outputs import write_text
    from bemkit.studies.stability.files import to_csv, to_markdown

    if csv_file is not None:
        write_text(csv_file, to_csv(rows))
    if markdown is not None:
        write_text(markdown, to_markdown(axes, rows))
    if folder is not None:
        from bemkit.studies.stability.plots import save_plots

        save_plots(axes, rows, Path(folder))
