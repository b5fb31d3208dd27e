"""The command ``bemkit show``."""

from __future__ import annotations

from contextlib import ExitStack

import click

from bemkit.cli import options
from bemkit.cli.options import outputs_of, result_target, shown_progress, write_animation
from bemkit.cli.outputs import STDOUT
from bemkit.cli.process import print_data


@click.command()
@click.argument("result")
@options.csv_option
@click.option(
    "--table",
    type=click.Choice(["contact", "boundary", "history", "steps", "forces", "pressures"]),
    help="Table of --csv (contact).",
)
@options.json_option
@options.plot_option
@options.what_option
@click.option("--scene", "shows_scene", is_flag=True, help="Print the scene of the result as TOML.")
@click.option("--step", type=int, metavar="N", help="Show load step N, counted from 1.")
@click.option("-o", "--output", metavar="FILE", help="Write another format: .json, .csv, .npz or .vtu.")
@options.inside_option
def show(
    result: str,
    csv_file: str | None,
    table: str | None,
    json_file: str | None,
    folder: str | None,
    what: tuple[str, ...] | None,
    shows_scene: bool,
    step: int | None,
    output: str | None,
    inside: int,
) -> None:
    """Show RESULT, a file written by bemkit run -o."""
    if table is not None and csv_file is None:
        raise click.UsageError("--table names the table of --csv: add --csv FILE, or --csv -")
    if shows_scene and STDOUT in (csv_file, json_file):
        raise click.UsageError("--scene prints to standard output: give files to --csv and --json")
    outputs = outputs_of(json_file, csv_file, folder, table=table or "contact", what=what)
    outputs.check(result_target(output, inside))
    with ExitStack() as stack:
        stack.enter_context(shown_progress(quiet=False))
        from bemkit.results.result_file import read_result

        solution = read_result(result)
        if step is not None:
            solution = solution.at_step(step)
        if output is not None:
            from bemkit.results.export import export_result

            export_result(output, solution, inside=inside)
        if outputs.uses_stdout:
            stack.close()  # no bar among the data
        outputs.write(solution)
        write_animation(solution, folder, what)
    if shows_scene:
        from bemkit.scene.toml import scene_to_toml

        print_data(scene_to_toml(solution.stated))
    elif not (csv_file or json_file or folder or output):
        from bemkit.cli.console import print_summary

        print_summary(solution)
