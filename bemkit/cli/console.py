"""Terminal output: summary, plan, convergence table, time and memory of a run."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.errors import ResultWarning
from bemkit.operators.counts import OperationCounts
from bemkit.plan.plan import Plan
from bemkit.results.solution import Solution
from bemkit.results.summary_rows import summary_rows
from bemkit.solvers.base import StepRecord


def print_summary(solution: Solution, console: Console | None = None) -> None:
    """Print a solution as a compact table, to standard output by default."""
    console = stdout_console(console)
    table = Table(box=None, show_header=False, padding=(0, 2, 0, 0), title_justify="left")
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in summary_rows(solution):
        table.add_row(name, _status(solution, value) if name == "status" else Text(value))
    console.print(Text(solution.title, style="bold"))
    console.print(table)
    _print_warnings(solution.warnings, console)


def _status(solution: Solution, text: str) -> Text:
    colour = "green" if solution.is_converged else "yellow" if solution.is_certified else "red"
    words = len(solution.status_words)
    return Text.assemble((text[:words], f"bold {colour}"), text[words:])


def print_plan(title: str, plan: Plan) -> None:
    """Print what a scene needs and what it skips, with the time and memory of each."""
    console = stdout_console()
    table = plain_table(("", "item", "why"), gap=2)
    for item in plan.items:
        style = "" if item.is_needed else "dim"
        mark = Text("needed", style="green") if item.is_needed else Text("skipped", style="dim")
        table.add_row(mark, Text(item.name, style=style), Text(item.reason, style=style))
    console.print(Text(title, style="bold"))
    console.print(table)
    memory = format_size(plan.memory)
    console.print(f"about {format_seconds(plan.seconds)}, and {memory} of memory at the largest moment")
    _print_warnings(plan.warnings, console)


def _print_warnings(warnings: Sequence[ResultWarning], console: Console) -> None:
    for warning in warnings:
        console.print(Text(f"warning: {warning}", style="yellow"))


class ConvergenceTable:
    """A callback of `bemkit.run` that prints one line per step of the solver, to standard error by default."""

    def __init__(self, console: Console | None = None) -> None:
        self._console = Console(stderr=True, highlight=False) if console is None else console
        self._has_header = False

    def __call__(self, record: StepRecord) -> None:
        """Print a line."""
        if not self._has_header:
            header = "step  solves  separated   stick    slip  changed     worst"
            self._console.print(Text(header, style="bold"))
            self._has_header = True
        line = (
            f"{record.step:4d}  {record.linear_solves:6d}  {record.n_separated:9d}  {record.n_stick:6d}  "
            f"{record.n_slip:6d}  {record.n_changed:7d}  {record.certificate.worst:8.1e}"
        )
        self._console.print(Text(f"{line}  {record.message}".rstrip()))


def print_explanation(solution: Solution, output_seconds: float, *, to_stderr: bool = False) -> None:
    """Print planned and measured time and memory, the counts, and what was skipped.

    Memory was traced in the run, which makes small scenes about twice as slow. Standard output may be taken by data.
    """
    console = Console(stderr=to_stderr, highlight=False)
    console.print(Group(_stages(solution, output_seconds), _counts(solution.plan.work, solution.work)))
    console.print(_left_out(solution))


def _stages(solution: Solution, output_seconds: float) -> Table:
    table = plain_table(("stage",), ("time", "memory"), gap=2)
    for name, seconds in solution.timings.items():
        if name != "total" and seconds > 0.0:  # a stage that this run did not need is not listed
            size = solution.memory.get(name, 0)
            table.add_row(name, format_seconds(seconds), format_size(size) if size else "")
    table.add_row("outputs", format_seconds(output_seconds), "")
    table.add_section()
    memory = format_size(max(solution.memory.values(), default=0))
    table.add_row("all", format_seconds(solution.timings["total"] + output_seconds), memory)
    table.add_row("planned", format_seconds(solution.plan.seconds), format_size(solution.plan.memory))
    return table


def _counts(planned: OperationCounts, counted: OperationCounts) -> Table:
    table = plain_table(("what was computed",), gap=2)
    for name in ("planned", "counted"):
        table.add_column(name, justify="right", overflow="fold")
    for (name, one), (_, other) in zip(_lines(planned), _lines(counted), strict=True):
        table.add_row(name, one, Text(other, style="" if one == other else "bold red"))
    return table


def _lines(work: OperationCounts) -> Iterator[tuple[str, str]]:
    yield "element pairs integrated", f"{work.element_pairs:,}"
    for name, entries in (("V", work.single_layer), ("K", work.double_layer), ("W", work.hypersingular)):
        yield f"entries of {name} computed", f"{entries.computed:,}"
        yield f"entries of {name} stored", f"{entries.stored:,}"
    factorisations = ", ".join(f"{one.kind.value} {one.order}" for one in work.factorisations)
    yield "factorisations and their orders", factorisations or "none"
    yield "right-hand sides", f"{work.right_hand_sides:,}"
    yield "unknowns of the contact system", f"{work.contact_unknowns:,}"


def _left_out(solution: Solution) -> Table:
    table = plain_table(("skipped", "why"), gap=2)
    for item in solution.plan.items:
        if not item.is_needed:
            table.add_row(item.name, item.reason)
    return table


def format_size(n_bytes: int) -> str:
    """Return a memory size in words such as ``3.3 MB``."""
    size = float(n_bytes)
    for unit in ("B", "kB", "MB", "GB"):
        if size < 1000.0:
            return f"{size:.3g} {unit}"
        size /= 1000.0
    return f"{size:.3g} TB"


def format_seconds(seconds: float) -> str:
    """Return a time in words such as ``3.3 ms``."""
    return f"{seconds:.3g} s" if seconds >= 1.0 else f"{1e3 * seconds:.3g} ms"
