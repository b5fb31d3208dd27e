"""The command line: the program ``bemkit`` and its commands.

Exit codes: 0 solved, 1 solved but not converged, 2 bad input (one line on standard error), 3 accuracy not reached, 130
interrupted.
"""

from __future__ import annotations

import sys
import time
import tracemalloc
from collections.abc import Callable
from contextlib import AbstractContextManager, ExitStack, nullcontext
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from bemkit.cli.result_outputs import result_outputs, result_target
from bemkit.errors import BemkitError, NoResultError, concerning, one_line, printable
from bemkit.results.outputs import STDOUT, PipeClosedError, guarded_streams, print_data
from bemkit.version import __version__

if TYPE_CHECKING:
    from bemkit.plan import Plan
    from bemkit.results.assembly_solution import AssemblySolution
    from bemkit.results.solution import Solution
    from bemkit.scene.assembly import Assembly
    from bemkit.scene.scene import Scene
    from bemkit.solvers.base import StepRecord

NOT_CONVERGED, BAD_INPUT, INACCURATE, INTERRUPTED, PIPE_CLOSED = 1, 2, 3, 130, 141
_ON_DEMAND = {
    "cite": "cite",
    "critical-friction": "critical_friction",
    "outline": "outline",
    "plot": "plot",
    "report": "report",
    "schema": "schema",
    "stability": "study",
    "study": "study",
    "sweep": "sweep",
    "verify": "verify",
}
"""Commands that are loaded only when they are asked for, and their modules."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Parameters
    ----------
    arguments : list of str, optional
        By default those of the process.
    """
    with guarded_streams():
        code = _run_to_end(arguments)
    sys.exit(code)


def _run_to_end(arguments: list[str] | None) -> int:
    """Run the command line and return its exit code; the one place where errors end."""
    try:
        code = commands.main(args=arguments, prog_name="bemkit", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        print(error.format_message())
        code = BAD_INPUT
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context is not None else ""
        _complain(error.format_message() + hint)
        code = BAD_INPUT
    except PipeClosedError:  # the reader, such as head, has seen enough
        code = PIPE_CLOSED
    except BemkitError as error:
        _complain(one_line(error))
        code = NOT_CONVERGED if isinstance(error, NoResultError) else BAD_INPUT
    except (click.Abort, KeyboardInterrupt):
        _complain("interrupted; no file is half written")
        code = INTERRUPTED
    except MemoryError:
        _complain("not enough memory: use fewer elements (--elements N)")
        code = BAD_INPUT
    return code if isinstance(code, int) else 0


class _Commands(click.Group):
    """Loads some commands only when they are asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return sorted([*super().list_commands(ctx), *_ON_DEMAND])

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name."""
        if cmd_name not in _ON_DEMAND:
            return super().get_command(ctx, cmd_name)
        command: click.Command = getattr(
            import_module(f"bemkit.cli.{_ON_DEMAND[cmd_name]}"), cmd_name.replace("-", "_")
        )
        return command


def _degree(context: click.Context, parameter: click.Parameter, value: str | None) -> int | Literal["hp"] | None:
    """Return a polynomial degree, or the word for degrees that rise until an accuracy is reached."""
    if value is None:
        return None
    if value == "hp":
        return "hp"
    if not value.lstrip("+-").isdecimal():
        raise click.BadParameter(f"{value} is no whole number: give one from 1 to 12, or hp", context, parameter)
    return int(value)


def _pictures(context: click.Context, parameter: click.Parameter, value: str | None) -> tuple[str, ...] | None:
    """Return the names of pictures, all of them known; None if none is named."""
    if value is None:
        return None
    from bemkit.pictures.catalogue import find_picture

    return tuple(find_picture(name.strip()).name for name in value.split(","))


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="bemkit")
def commands() -> None:
    """Frictional contact of elastic bodies by boundary elements."""


@commands.command()
@click.argument("scene")
@click.option("-o", "--output", metavar="FILE", help="Write the result: .h5, .json, .csv, .npz or .vtu.")
@click.option("--inside", type=int, default=0, metavar="N", help="Stress inside on N points across, in a .vtu.")
@click.option("--json", "json_file", metavar="FILE", help="Write the summary as JSON; - is standard output.")
@click.option("--csv", "csv_file", metavar="FILE", help="Write the contact table as CSV; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw figures into a folder.")
@click.option("--what", metavar="NAME,...", callback=_pictures, help="Which figures; bemkit plot --help lists them.")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--accuracy", type=float, metavar="E", help="Refine until the estimated relative error is below E.")
@click.option("--discretisation", metavar="WORD", help="hp, quadratic, linear or constant, instead of the scene's.")
@click.option("--degree", metavar="P|hp", callback=_degree, help="Galerkin elements of that degree, or of rising ones.")
@click.option("--solver", metavar="WORD", help="Such as augmented-lagrangian, instead of the scene's.")
@click.option("--rho", type=float, metavar="R", help="Penalty of the solver in units of E'/L, instead of the scene's.")
@click.option("--cascade", is_flag=True, help="Solve on coarser meshes first and start from there.")
@click.option("--explain", is_flag=True, help="Print planned against measured time and memory, and what was left out.")
@click.option("-q", "--quiet", is_flag=True, help="Print neither the convergence table nor the summary.")
def run(
    scene: str,
    output: str | None,
    inside: int,
    json_file: str | None,
    csv_file: str | None,
    folder: str | None,
    what: tuple[str, ...] | None,
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
        callback = stack.enter_context(_progress(quiet))  # shown before anything is loaded
        from bemkit.atomic_files import reserved
        from bemkit.scene.toml import load_scene, with_overrides

        outputs = result_outputs(json_file, csv_file, folder, what=what)
        click.get_current_context().with_resource(reserved(outputs.check(result_target(output, inside))))
        chosen = with_overrides(
            load_scene(scene),
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
        output_seconds = time.perf_counter() - begin
    if not quiet and not outputs.uses_stdout:
        from bemkit.cli.console import print_summary

        print_summary(solution)
    if explain:
        from bemkit.cli.console import print_explanation

        print_explanation(solution, output_seconds, to_stderr=outputs.uses_stdout)
    if solution.is_converged:
        return 0
    return INACCURATE if solution.is_certified else NOT_CONVERGED


@commands.command()
@click.argument("result")
@click.option(
    "--csv", "table", type=click.Choice(["contact", "boundary", "history", "steps"]), help="Print a table as CSV."
)
@click.option("--json", "json_file", metavar="FILE", help="Write the summary as JSON; - is standard output.")
@click.option("--plot", "folder", metavar="DIR", help="Draw figures into a folder.")
@click.option("--what", metavar="NAME,...", callback=_pictures, help="Which figures; bemkit plot --help lists them.")
@click.option("--scene", "shows_scene", is_flag=True, help="Print the scene inside as TOML.")
@click.option("-o", "--output", metavar="FILE", help="Write the result in another format: .json, .csv, .npz or .vtu.")
@click.option("--inside", type=int, default=0, metavar="N", help="Stress inside on N points across, in a .vtu.")
def show(
    result: str,
    table: str | None,
    json_file: str | None,
    folder: str | None,
    what: tuple[str, ...] | None,
    shows_scene: bool,
    output: str | None,
    inside: int,
) -> None:
    """Show RESULT, a file written by bemkit run -o."""
    from bemkit.results.result_file import read_result
    from bemkit.scene.toml import scene_to_toml

    if sum([table is not None, json_file == STDOUT, shows_scene]) > 1:
        raise click.UsageError("--csv, --json - and --scene all print to standard output: give one of them")
    outputs = result_outputs(json_file, STDOUT if table else None, folder, table=table or "contact", what=what)
    outputs.check(result_target(output, inside))
    with _progress(not folder or outputs.uses_stdout):
        solution = read_result(result)
        if output is not None:
            from bemkit.results.export import export_result

            export_result(output, solution, inside=inside)
        outputs.write(solution)
    if shows_scene:
        print_data(scene_to_toml(solution.stated))
    elif not (table or json_file or folder or output):
        from bemkit.cli.console import print_summary

        print_summary(solution)


@commands.command()
def scenes() -> None:
    """List the scenes that are shipped with bemkit."""
    from bemkit.scene.toml import shipped_scenes

    titles = shipped_scenes()
    width = max(map(len, titles))
    for name, title in titles.items():
        print(f"{name:<{width}}  {title}")


@commands.command()
@click.argument("scene")
@click.option("--elements", type=int, metavar="N", help="Number of boundary elements, instead of the scene's.")
@click.option("--accuracy", type=float, metavar="E", help="Plan the first mesh towards a relative error below E.")
@click.option("--discretisation", metavar="WORD", help="hp, quadratic, linear or constant, instead of the scene's.")
@click.option("--degree", metavar="P|hp", callback=_degree, help="Galerkin elements of that degree, or of rising ones.")
@click.option("--json", "is_json", is_flag=True, help="Print the plan as JSON.")
def plan(
    scene: str,
    elements: int | None,
    accuracy: float | None,
    discretisation: str | None,
    degree: int | Literal["hp"] | None,
    is_json: bool,
) -> None:
    """Say what SCENE needs and what it leaves out, without solving it."""
    from bemkit.scene.toml import load_scene, with_overrides

    chosen = with_overrides(
        load_scene(scene), elements=elements, accuracy=accuracy, discretisation=discretisation, degree=degree
    )
    with _progress(is_json), concerning(scene):
        made = _planned(chosen)
    if is_json:
        import json

        print(json.dumps(made.as_dict(), indent=2))
    else:
        from bemkit.cli.console import print_plan

        print_plan(chosen.title, made)


def _planned(scene: Scene | Assembly) -> Plan:
    """Return the plan of a scene, with a symmetry that it could use."""
    from bemkit.scene.assembly import Assembly

    if isinstance(scene, Assembly):
        from bemkit.plan.assembly_plan import make_assembly_plan

        return make_assembly_plan(scene)
    from bemkit.plan import check_elements, make_plan
    from bemkit.scene.symmetry import find_symmetry

    check_elements(scene)
    proposal = find_symmetry(scene) if scene.symmetry is None else None
    return make_plan(scene, scene.build_mesh(), proposal=proposal)


def _history_file(scene: Scene | Assembly, output: str | None) -> str | None:
    """Return the result file of a load history on one mesh, which is written step by step; None of other runs."""
    is_stepwise = scene.n_steps > 1 and scene.mesh.accuracy is None
    return output if is_stepwise and output is not None and Path(output).suffix.lower() in (".h5", ".hdf5") else None


def _progress(quiet: bool) -> AbstractContextManager[Callable[[StepRecord], None] | None]:
    """Return what shows a person how far a command is; nothing where nobody looks."""
    if quiet or not sys.stderr.isatty():
        return nullcontext()
    from bemkit.cli.progress import live_progress

    return live_progress(is_live=True)


def _solve(
    scene: Scene | Assembly, *, cascade: bool, callback: Callable[[StepRecord], None] | None, history_file: str | None
) -> Solution | AssemblySolution:
    from bemkit.runs.run import run as solve_scene

    if cascade:
        from bemkit.runs.nested import run_cascade
        from bemkit.scene.toml import single_body

        return run_cascade(single_body(scene, scene.title), callback=callback)[-1]
    if history_file is not None:
        from bemkit.runs.checkpoint import run_to_file

        return run_to_file(scene, history_file, callback=callback)
    return solve_scene(scene, callback=callback)


def _start_tracing() -> None:
    """Trace memory from now on, with what every run loads on first use behind it."""
    import scipy.linalg  # noqa: F401

    import bemkit.results.error_indicators
    import bemkit.runs.run  # noqa: F401

    tracemalloc.start()


def _complain(message: str) -> None:
    print(f"bemkit: error: {printable(' '.join(message.split()))}", file=sys.stderr)
