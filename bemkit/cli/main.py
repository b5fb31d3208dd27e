"""The command line: the program ``bemkit`` and its commands.

Exit codes: 0 solved, 1 solved but not converged, 2 bad input (one line on standard error), 3 accuracy not reached, 130
interrupted, 143 terminated by the system.
"""

from __future__ import annotations

import signal
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from importlib import import_module
from typing import NoReturn

import click

from bemkit.cli.process import (
    BAD_INPUT,
    INTERRUPTED,
    PIPE_CLOSED,
    TERMINATED,
    PipeClosedError,
    complain,
    exit_code_of_error,
    guarded_streams,
)
from bemkit.errors import BemkitError, one_line
from bemkit.interrupts import interruptible
from bemkit.version import __version__

_COMMANDS = {
    "cite": ("listings", "Print the references of the methods of a scene or a result."),
    "collapse": ("collapse", "Find collapse factors and thrust of walls and arches of rigid blocks."),
    "critical-friction": (
        "critical_friction",
        "Find the friction coefficient above which sliding states may not be unique.",
    ),
    "new": ("new", "Write a commented scene to start from."),
    "outline": ("outline", "Show the sides of a part from a file; write a scene to start from."),
    "plan": ("plan", "List the steps of a solve with time and memory, and skipped steps with the reason."),
    "plot": ("plot", "Draw a result or a scene."),
    "report": ("report", "Write an HTML page on a result or a scene."),
    "run": ("run", "Solve scenes."),
    "scenes": ("listings", "List the scenes that come with bemkit."),
    "schema": ("listings", "Print the JSON schema of scene files, for editors."),
    "show": ("show", "Show a result file."),
    "stability": ("stability", "Solve extreme variants of a scene and check the results."),
    "study": ("study", "Measure error against run time, count solutions, or halve load increments."),
    "sweep": ("sweep", "Solve a scene for several values of its numbers."),
    "verify": ("verify", "Compare results with closed forms and other known solutions."),
}
"""Module of each command, imported on use, and its line in the list of commands."""


def main(arguments: list[str] | None = None) -> None:
    """Run the command line and end the process with its exit code.

    Parameters
    ----------
    arguments : list of str, optional
        By default those of the process.
    """
    with guarded_streams(), _terminable():
        code = _run_to_end(arguments)
    sys.exit(code)


def _run_to_end(arguments: list[str] | None) -> int:
    """Run the command line and return its exit code; the one place where errors end."""
    try:
        with interruptible():
            code = commands.main(args=arguments, prog_name="bemkit", standalone_mode=False)
        sys.stdout.flush()
    except click.exceptions.NoArgsIsHelpError as error:
        print(error.format_message())
        code = BAD_INPUT
    except click.ClickException as error:
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context is not None else ""
        complain(error.format_message() + hint)
        code = BAD_INPUT
    except PipeClosedError:  # the reader, such as head, has seen enough
        code = PIPE_CLOSED
    except BemkitError as error:
        complain(one_line(error))
        code = exit_code_of_error(error)
    except (click.Abort, KeyboardInterrupt) as error:
        is_ctrl_c = (error.__cause__ or error) is not _TERMINATION
        complain("interrupted" if is_ctrl_c else "terminated")
        code = INTERRUPTED if is_ctrl_c else TERMINATED
    except MemoryError:
        complain("not enough memory: use fewer elements (--elements N)")
        code = BAD_INPUT
    return code if isinstance(code, int) else 0


_TERMINATION = KeyboardInterrupt("SIGTERM")
"""The system asks the process to end: finished work is kept, as after Ctrl-C."""


@contextmanager
def _terminable() -> Iterator[None]:
    """End like Ctrl-C when the system asks for it, as batch queues do: locks and temporary files are removed."""

    def end(*_: object) -> NoReturn:
        raise _TERMINATION

    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGTERM) is not signal.SIG_DFL:  # the program around has its own way
        yield
        return
    signal.signal(signal.SIGTERM, end)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, signal.SIG_DFL)


class _Commands(click.Group):
    """Loads a command only when it is asked for."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of all commands."""
        return list(_COMMANDS)

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name."""
        if cmd_name not in _COMMANDS:
            from bemkit.formulas import closest

            ctx.fail(f"no command {cmd_name!r}{closest(cmd_name, _COMMANDS)}")
        module = import_module(f"bemkit.cli.{_COMMANDS[cmd_name][0]}")
        command: click.Command = getattr(module, cmd_name.replace("-", "_"))
        return command

    def format_commands(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """List the commands without loading them."""
        with formatter.section("Commands"):
            formatter.write_dl([(name, text) for name, (_, text) in _COMMANDS.items()])


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(__version__, prog_name="bemkit")
def commands() -> None:
    """Frictional contact of elastic bodies by boundary elements."""
