"""The command line: ``bemkit run | show | scenes | plan | study | stability``.

Exit codes: 0 solved, 1 solved but not converged, 2 bad input (one line on standard error), 130 interrupted.
"""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import click

from bemkit import __version__
from bemkit.stability.command import stability

if TYPE_CHECKING:
    from bemkit.scene import Scene
    from bemkit.solution import Solution

NOT_CONVERGED, BAD_INPUT, INTERRUPTED, PIPE_CLOSED = 1, 2, 130, 141


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Parameters
    ----------
    arguments : list of str, optional
        By default those of the process.
    """
    try:
        code = commands.main(args=arguments, prog_name="bemkit", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        click.echo(error.format_message())
        code = BAD_INPUT
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context is not None else ""
        _complain(" ".join(error.format_message().split()) + hint)
        code = BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        _complain("interrupted; no file is half written")
        code = INTERRUPTED
    except MemoryError:
        _complain("not enough memory: use fewer elements (--elements N)")
        code = BAD_INPUT
    except BrokenPipeError:  # the reader, such as head, has seen enough
        _drop_stdout()
        code = PIPE_CLOSED
    except OSError as error:
        if error.errno not in (errno.ENOSPC, errno.EIO):
            raise
        _drop_stdout()  # files have their own checks, so this is the stream that the shell redirected
        _complain(f"standard output: cannot be written ({error.strerror}): send it to another place")
        code = BAD_INPUT
    sys.exit(code if isinstance(code, int) else 0)


@click.group(context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="bemkit")
def commands() -> None:
    """Frictional contact of elastic bodies by boundary elements."""


@commands.command()
@click.argument("scene")
@click.option("-o", "--output", metavar="FILE", help="Write the result (HDF5).")
@click.option("--json", "json_file", metavar="FILE", help="Write the summary as JSON; - is standard output.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the contact table as CSV; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw figures into a folder.")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--accuracy", type=float, metavar="E", help="Refine until the estimated relative error is below E.")
@click.option("--discretisation", metavar="WORD", help="linear, quadratic or constant, instead of the scene's.")
@click.option("--solver", metavar="WORD", help="Such as augmented-lagrangian, instead of the scene's.")
@click.option("--rho", type=float, metavar="R", help="Penalty of the solver in units of E'/L, instead of the scene's.")
@click.option("--cascade", is_flag=True, help="Solve on coarser meshes first and start from there.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither the convergence table nor the summary.")
def run(
    scene: str,
    output: str | None,
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    elements: int | None,
    accuracy: float | None,
    discretisation: str | None,
    solver: str | None,
    rho: float | None,
    cascade: bool,
    quiet: bool,
) -> int:
    """Solve SCENE, a TOML file or the name of a shipped scene."""
    from bemkit.outputs import Outputs

    with _bad_input():
        wanted = Outputs(_path(output), json_file, csv_file, plots=_path(folder))
        wanted.check()
        chosen = _load(scene, elements, discretisation, solver, rho, accuracy)
    with _bad_input(scene):
        solution = _solve(chosen, cascade=cascade, is_live=not quiet and sys.stderr.isatty())
    with _bad_input():
        wanted.write(solution)
    if not quiet and not wanted.uses_stdout:
        from bemkit.report import print_summary

        print_summary(solution)
    return 0 if solution.is_converged else NOT_CONVERGED


@commands.command()
@click.argument("result")
@click.option("--csv", "table", type=click.Choice(["contact", "boundary", "history"]), help="Print a table as CSV.")
@click.option("--json", "json_file", metavar="FILE", help="Write the summary as JSON; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw figures into a folder.")
@click.option("--scene", "shows_scene", is_flag=True, help="Print the scene inside as TOML.")
def show(result: str, table: str | None, json_file: str | None, folder: str | None, shows_scene: bool) -> None:
    """Show RESULT, a file written by bemkit run -o."""
    from bemkit.io import read_result
    from bemkit.outputs import STDOUT, Outputs
    from bemkit.scenefile import scene_to_toml

    if sum([table is not None, json_file == STDOUT, shows_scene]) > 1:
        raise click.UsageError("--csv, --json - and --scene all print to standard output: give one of them")
    with _bad_input():
        wanted = Outputs(json=json_file, csv=STDOUT if table else None, table=table or "contact", plots=_path(folder))
        wanted.check()
        solution = read_result(result)
        wanted.write(solution)
    if shows_scene:
        click.echo(scene_to_toml(solution.scene), nl=False)
    elif wanted == Outputs():
        from bemkit.report import print_summary

        print_summary(solution)


@commands.command()
def scenes() -> None:
    """List the scenes that are shipped with bemkit."""
    from bemkit.shipped import shipped_scenes

    titles = shipped_scenes()
    width = max(map(len, titles))
    for name, title in titles.items():
        click.echo(f"{name:<{width}}  {title}")


@commands.command()
@click.argument("scene")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--discretisation", metavar="WORD", help="linear, quadratic or constant, instead of the scene's.")
@click.option("--json", "is_json", is_flag=True, help="Print the plan as JSON.")
def plan(scene: str, elements: int | None, discretisation: str | None, is_json: bool) -> None:
    """Say what SCENE needs and what it leaves out, without solving it."""
    from bemkit.plan import make_plan

    with _bad_input():
        chosen = _load(scene, elements, discretisation)
    with _bad_input(scene):
        made = make_plan(chosen, chosen.build_mesh())
    if is_json:
        import json

        click.echo(json.dumps(made.as_dict(), indent=2))
    else:
        from bemkit.report import print_plan

        print_plan(chosen.title, made)


commands.add_command(stability)


@commands.group()
def study() -> None:
    """Many runs that answer one question."""


@study.command("paper-tables")
@click.option("--json", "json_file", metavar="FILE", help="Write the tables as JSON; - is standard output.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write one row for each pair of rho; - is standard output.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither the progress bar nor the tables.")
def paper_tables(json_file: str | None, csv_file: str | None, quiet: bool) -> None:
    """Reproduce the source paper's Tables 1 and 2: outer steps of the augmented Lagrangian method over rho."""
    from bemkit.outputs import STDOUT, check_text, write_text
    from bemkit.study import report

    if json_file == csv_file == STDOUT:
        raise click.UsageError("--csv - and --json - both print to standard output: give one of them")
    with _bad_input():
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
    from bemkit.outputs import STDOUT, check_text, write_text
    from bemkit.plan import check_memory
    from bemkit.runner import run_probe
    from bemkit.study import report

    with _bad_input():
        check_text(json_file, "JSON file", "{")
        chosen = _load(scene, elements, None)
    with _bad_input(scene):
        check_memory(chosen)
        found = run_probe(chosen, n_starts=starts)
    with _bad_input():
        if json_file is not None:
            write_text(json_file, report.solutions_to_json(found, starts))
    if json_file != STDOUT:
        report.print_solutions(found, starts)
    return 0 if found else NOT_CONVERGED


def _load(
    source: str,
    elements: int | None,
    discretisation: str | None,
    solver: str | None = None,
    rho: float | None = None,
    accuracy: float | None = None,
) -> Scene:
    from bemkit.scenefile import load_scene, with_overrides

    scene = load_scene(source)
    return with_overrides(
        scene, elements=elements, accuracy=accuracy, discretisation=discretisation, solver=solver, rho=rho
    )


def _solve(scene: Scene, *, cascade: bool, is_live: bool) -> Solution:
    from bemkit.plan import check_memory
    from bemkit.runner import run as solve_scene

    check_memory(scene)
    callback = None
    if is_live:
        from bemkit.report import ConvergenceTable

        callback = ConvergenceTable()
    if cascade:
        from bemkit.cascade import run_cascade

        return run_cascade(scene, callback=callback)[-1]
    return solve_scene(scene, callback=callback)


def _path(name: str | None) -> Path | None:
    return None if name is None else Path(name)


@contextmanager
def _bad_input(prefix: str = "") -> Iterator[None]:
    """Turn the errors that bemkit itself names into one line; anything else is a defect and keeps its traceback."""
    try:
        yield
    except (ValueError, OSError) as error:
        if type(error).__module__.partition(".")[0] != "bemkit":
            raise
        message = f"{prefix}: {error}" if prefix else str(error)
        raise click.ClickException(message) from error


def _drop_stdout() -> None:
    """Send what is still in the buffer of standard output nowhere, or the interpreter would fail on it at its end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())


def _complain(message: str) -> None:
    click.echo(f"bemkit: error: {message}", err=True)
