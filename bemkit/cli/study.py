"""The commands of studies: ``bemkit study errors | solutions | increments``."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Container, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import click

from bemkit.cli import options
from bemkit.cli.options import StudyProgress, reserve, shown_progress, study_output
from bemkit.cli.outputs import STDOUT, Outputs, csv_of, json_of, plain_table, stdout_console
from bemkit.cli.process import NOT_CONVERGED
from bemkit.errors import concerning

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from bemkit.results.solution import Solution
    from bemkit.scene.scene import Scene
    from bemkit.studies.accuracy.records import ErrorRecord

DEFAULT_COMMAND = "errors"
DEFAULT_REPEAT = 3
DEFAULT_SOLVERS = "semismooth-newton,augmented-lagrangian"
DEFAULT_MEASURES = "energy,sigma_n,displacement,transitions"


class StudyGroup(click.Group):
    """``bemkit study SCENE`` is short for ``bemkit study errors SCENE``."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Put the name of the default command in front where no command is named."""
        if args and args[0] not in {*self.commands, *self.get_help_option_names(ctx)}:
            args = [DEFAULT_COMMAND, *args]
        return super().parse_args(ctx, args)


@click.group(cls=StudyGroup)
def study() -> None:
    """Compare many runs of one scene; bemkit study SCENE is short for bemkit study errors SCENE."""


@study.command(DEFAULT_COMMAND)
@click.argument("scene")
@click.option("--sizes", default="40,80,160,320", metavar="N,...", help="Elements of fixed meshes.")
@click.option("--accuracies", default="1e-2,1e-3,1e-4", metavar="E,...", help="Accuracies of adaptive meshes.")
@click.option("--discretisations", metavar="NAME,...", help="Elements: constant,linear,quadratic.")
@click.option("--degrees", metavar="P,...", help="Galerkin elements of these degrees, such as 1,2,4,8,hp.")
@click.option("--solvers", default=DEFAULT_SOLVERS, metavar="NAME,...", help="Solvers.")
@click.option("--meshes", default="uniform,graded,adaptive", metavar="NAME,...", help="Sequences of meshes.")
@click.option("--exponent", type=float, default=3.0, metavar="P", help="Exponent of graded meshes (3).")
@click.option("--most-elements", type=int, default=500, metavar="N", help="Limit of adaptive meshes (500).")
@click.option("--over-resolve", type=click.IntRange(40), metavar="N", help="Measure against up to N fine elements.")
@click.option("--repeat", type=click.IntRange(1), metavar="N", help="Timed repetitions of each run (3).")
@click.option("--jobs", type=click.IntRange(1), default=1, metavar="N", help="Number of processes (1).")
@click.option("--errors", "measures", default=DEFAULT_MEASURES, metavar="NAME,...", help="Errors to show and draw.")
@options.rows_option
@options.csv_option
@options.plot_option
@options.quiet_option
def errors(
    scene: str,
    repeat: int | None,
    jobs: int,
    measures: str,
    output: str | None,
    csv_file: str | None,
    folder: str | None,
    quiet: bool,
    **chosen: Any,
) -> int:
    """Measure errors and run times of SCENE over element types, meshes and solvers.

    Errors are measured against a closed form or a reference solution, or with --over-resolve against a fine solution.
    With more than one process, times are not measured. The exit code is 1 if a run did not converge.
    """
    if jobs > 1 and repeat is not None:
        raise click.UsageError("--jobs measures no run times: remove --repeat or --jobs")
    with StudyProgress(quiet) as progress:
        from bemkit.cli.printed_errors import print_reference, print_study
        from bemkit.scene.toml import load_scene, single_body
        from bemkit.studies.accuracy.figures import FIGURE, draw_errors
        from bemkit.studies.accuracy.options import StudyOptions, read_measures
        from bemkit.studies.accuracy.records import FILE, table_of
        from bemkit.studies.accuracy.runs import error_tasks

        shown = read_measures(measures)
        problem = single_body(load_scene(scene), scene)

        def figures(records: Sequence[ErrorRecord]) -> dict[str, Figure]:
            return {FIGURE: draw_errors(records, shown, title=problem.title)}

        def computed(finished: Container[object]) -> Iterator[ErrorRecord]:
            reference = asked.reference(problem)
            tasks = error_tasks([run for run in runs if run.key not in finished], reference, asked.repeat)
            records = progress.compute(tasks, "error study", processes=jobs)
            if shows_tables:
                print_reference(problem.title, reference)
            return records

        rows, table = study_output(output, table_of)
        texts = table, csv_of(csv_file, table_of)
        # sharp at the width of a page, and a small file
        outputs = Outputs(texts, folder, figures, FIGURE, dots_per_inch=110)
        reserve(outputs.check(FILE.check(rows)))
        asked = StudyOptions(**chosen, repeat=None if jobs > 1 else repeat or DEFAULT_REPEAT)
        runs = asked.runs(problem)
        shows_tables = not quiet and not outputs.uses_stdout
        with concerning(scene):
            by_key = FILE.completed(rows, asked.labels(problem), computed)
            records = [by_key[run.key] for run in runs]
            if shows_tables:
                print_study(records, shown)
    outputs.write(records)
    return 0 if all(record.is_certified for record in records) else NOT_CONVERGED


@study.command()
@click.argument("scene")
@click.option("--starts", type=click.IntRange(min=0), default=8, metavar="N", help="Number of starts (8).")
@options.changes_scene("elements")
@options.json_option
def solutions(scene: str, starts: int, json_file: str | None, load: Callable[[str], Scene]) -> int:
    """Look for several solutions of SCENE from several starts."""
    with shown_progress(quiet=False):
        from bemkit.runs.distinct_solutions import distinct_solutions
        from bemkit.scene.toml import single_body

        def entries(found: Sequence[Solution]) -> dict[str, Any]:
            return {"starts": starts, "solutions": [solution.summary() for solution in found]}

        summaries = json_of(json_file, entries)
        summaries.check()
        chosen = single_body(load(scene), scene)
        with concerning(scene):
            found = distinct_solutions(chosen, n_starts=starts)
    summaries.write(found)
    if json_file != STDOUT:
        _print_solutions(found, starts)
    return 0 if found else NOT_CONVERGED


@study.command()
@click.argument("scene")
@options.changes_scene("elements")
@options.json_option
def increments(scene: str, json_file: str | None, load: Callable[[str], Scene]) -> None:
    """Solve the load history of SCENE with every increment halved, and compare."""
    with shown_progress(quiet=False), concerning(scene):
        from bemkit.studies.increments import increment_errors

        output = json_of(json_file, vars)
        output.check()
        errors = increment_errors(load(scene))
    output.write(errors)
    if json_file != STDOUT:
        print(f"{errors.n_increments} increments; halving all of them changes")
        for name in ("external_work", "dissipation", "tractions"):
            change = getattr(errors, name)
            shown = "none" if change is None else f"{change:.1e}"
            print(f"{name.replace('_', ' '):14} {shown}")


def _print_solutions(found: Sequence[Solution], n_starts: int) -> None:
    """Print how many distinct solutions there are, and how they differ."""
    from rich.text import Text

    console = stdout_console()
    if not found:
        console.print(f"none of {n_starts} starts leads to a solution")
        return
    title = f"{len(found)} distinct solution{'s' * (len(found) > 1)} from {n_starts} starts"
    console.print(Text(title, style="bold yellow" if len(found) > 1 else "bold"))
    table = plain_table(right=("separated", "slip", "stick", "normal force", "friction force", "energy"), gap=2)
    for solution in found:
        counts = Counter(solution.contact.status_words())
        forces = (solution.force_normal, solution.force_tangential, solution.energy)
        words = (str(counts[word]) for word in ("separated", "slip", "stick"))
        table.add_row(*words, *(f"{value:.6g}" for value in forces))
    console.print(table)
