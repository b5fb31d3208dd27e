"""The commands ``bemkit study``: ``errors`` (also without the word), ``paper-tables``, ``solutions``."""

from __future__ import annotations

import sys

import click

from bemkit.cli.errors import concerning

DEFAULT_COMMAND = "errors"
DEFAULT_REPEAT = 3
NOT_CONVERGED = 1


class StudyGroup(click.Group):
    """``bemkit study SCENE`` is short for ``bemkit study errors SCENE``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the name of the default command in front where no command is named."""
        if args and args[0] not in {*self.commands, *self.get_help_option_names(ctx)}:
            args = [DEFAULT_COMMAND, *args]
        return super().parse_args(ctx, args)


@click.group(cls=StudyGroup)
def study() -> None:
    """Many runs that answer one question; bemkit study SCENE is short for bemkit study errors SCENE."""


@study.command(DEFAULT_COMMAND)
@click.argument("scene")
@click.option("--elements", default="40,80,160,320", metavar="N,...", help="Sizes of uniform and graded meshes.")
@click.option("--accuracies", default="1e-2,1e-3,1e-4", metavar="E,...", help="Aims of adaptive meshes.")
@click.option("--discretisation", default="constant,linear,quadratic", metavar="WORD,...", help="Element types.")
@click.option("--solver", default="semismooth-newton,augmented-lagrangian", metavar="WORD,...", help="Drivers.")
@click.option("--meshes", default="uniform,graded,adaptive", metavar="WORD,...", help="Sequences of meshes.")
@click.option("--exponent", type=float, default=3.0, metavar="P", help="Grading of graded meshes (3).")
@click.option("--most-elements", type=int, default=500, metavar="N", help="Limit of adaptive meshes (500).")
@click.option("--over-resolve", type=click.IntRange(40), metavar="N", help="Measure against up to N fine elements.")
@click.option("--repeat", type=click.IntRange(1), metavar="N", help="Timed repetitions of each run (3).")
@click.option("--jobs", type=click.IntRange(1), default=1, metavar="N", help="Processes; more than one: no times.")
@click.option("--errors", "measures", metavar="WORD,...", help="Errors to show and draw.")
@click.option("-o", "--output", metavar="FILE", help="Keep the rows (HDF5); rows already in the file are not repeated.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the rows as CSV; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw error-against-run-time.png into a folder.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither progress nor tables.")
def errors(
    scene: str,
    elements: str,
    accuracies: str,
    discretisation: str,
    solver: str,
    meshes: str,
    exponent: float,
    most_elements: int,
    over_resolve: int | None,
    repeat: int | None,
    jobs: int,
    measures: str | None,
    output: str | None,
    csv_file: str | None,
    folder: str | None,
    quiet: bool,
) -> int:
    """Measure errors and run times of SCENE over element types, meshes and drivers.

    Errors are measured against a closed form or a reference solution, or with --over-resolve against a fine solution.
    The exit code is 1 if a run did not converge.
    """
    from bemkit.atomic_files import reserved
    from bemkit.cli.outputs import STDOUT
    from bemkit.studies.accuracy.session import Outputs, Session
    from bemkit.studies.accuracy.wishes import DEFAULT_MEASURES, Lists, read_measures, read_wishes

    if jobs > 1 and repeat is not None:
        raise click.UsageError("--jobs measures no run times: leave out --repeat, or --jobs")
    outputs = Outputs(output, csv_file, folder, read_measures(measures or DEFAULT_MEASURES))
    click.get_current_context().with_resource(reserved(outputs.check()))
    wishes = read_wishes(
        scene,
        Lists(elements, accuracies, discretisation, meshes, solver),
        exponent=exponent,
        most_elements=most_elements,
        over_resolve=over_resolve,
        repeat=None if jobs > 1 else repeat or DEFAULT_REPEAT,
    )
    is_live, shows_tables = not quiet and sys.stderr.isatty(), not quiet and csv_file != STDOUT
    session = Session(wishes, outputs, jobs=jobs, is_live=is_live, shows_tables=shows_tables)
    with concerning(scene):
        rows = session.run()
    outputs.write(wishes.scene.title, rows)
    return 0 if all(row.is_certified for row in rows) else NOT_CONVERGED


@study.command("paper-tables")
@click.option("--json", "json_file", metavar="FILE", help="Write the tables as JSON; - is standard output.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write one row for each pair of rho; - is standard output.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither the progress bar nor the tables.")
def paper_tables(json_file: str | None, csv_file: str | None, quiet: bool) -> None:
    """Reproduce the source paper's Tables 1 and 2: outer steps of the augmented Lagrangian method over rho."""
    from bemkit.cli.outputs import STDOUT, check_text, write_text
    from bemkit.studies.accuracy import report

    if json_file == csv_file == STDOUT:
        raise click.UsageError("--csv - and --json - both print to standard output: give one of them")
    check_text(json_file, "JSON file", "{")
    check_text(csv_file, "CSV file of the paper's tables", "table,rho_1")
    tables = report.compute_with_progress(is_live=not quiet and sys.stderr.isatty())
    if json_file is not None:
        write_text(json_file, report.to_json(tables))
    if csv_file is not None:
        write_text(csv_file, report.to_csv(tables))
    if not quiet and STDOUT not in (json_file, csv_file):
        report.print_paper_tables(tables)


@study.command()
@click.argument("scene")
@click.option("--starts", type=click.IntRange(min=0), default=8, metavar="N", help="Number of starts (8).")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--json", "json_file", metavar="FILE", help="Write all summaries as JSON; - is standard output.")
def solutions(scene: str, starts: int, elements: int | None, json_file: str | None) -> int:
    """Look for several solutions of SCENE from several starts."""
    from bemkit.cli.outputs import STDOUT, check_text, write_text
    from bemkit.runs.run import run_probe
    from bemkit.scene.toml import load_scene, with_overrides
    from bemkit.studies.accuracy import report

    check_text(json_file, "JSON file", "{")
    chosen = with_overrides(load_scene(scene), elements=elements)
    with concerning(scene):
        found = run_probe(chosen, n_starts=starts)
    if json_file is not None:
        write_text(json_file, report.solutions_to_json(found, starts))
    if json_file != STDOUT:
        report.print_solutions(found, starts)
    return 0 if found else NOT_CONVERGED
