"""What a run was planned to take and what it took, for people: ``bemkit run --explain``."""

from __future__ import annotations

from collections.abc import Iterator

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from bemkit.cli.console import format_seconds, format_size
from bemkit.operators.counts import Work
from bemkit.results.solution import Solution


def print_explanation(solution: Solution, output_seconds: float, *, to_stderr: bool = False) -> None:
    """Print planned against measured time and memory, the counts, and what was left out.

    Parameters
    ----------
    solution : Solution
        Of a run whose memory was traced, which makes small scenes about twice as slow.
    output_seconds : float [s]
        What writing its outputs took.
    to_stderr : bool
        Whether standard output is taken by data.
    """
    console = Console(stderr=to_stderr, highlight=False)
    console.print(Group(_stages(solution, output_seconds), _counts(solution.plan.work, solution.work)))
    console.print(_left_out(solution))


def _stages(solution: Solution, output_seconds: float) -> Table:
    table = _table("stage", "time", "memory")
    for name, seconds in solution.timings.items():
        if name != "total":
            size = solution.memory.get(name, 0)
            table.add_row(name, format_seconds(seconds), format_size(size) if size else "")
    table.add_row("outputs", format_seconds(output_seconds), "")
    table.add_section()
    memory = format_size(max(solution.memory.values(), default=0))
    table.add_row("all", format_seconds(solution.timings["total"] + output_seconds), memory)
    table.add_row("planned", format_seconds(solution.plan.seconds), format_size(solution.plan.memory))
    return table


def _counts(planned: Work, counted: Work) -> Table:
    table = _table("what was computed", "planned", "counted")
    for (name, one), (_, other) in zip(_lines(planned), _lines(counted), strict=True):
        table.add_row(name, one, Text(other, style="" if one == other else "bold red"))
    return table


def _lines(work: Work) -> Iterator[tuple[str, str]]:
    yield "element pairs integrated", f"{work.element_pairs:,}"
    for name, entries in (("V", work.single_layer), ("K", work.double_layer), ("W", work.hypersingular)):
        yield f"entries of {name} computed", f"{entries.computed:,}"
        yield f"entries of {name} stored", f"{entries.stored:,}"
    factorisations = ", ".join(f"{one.kind.value} {one.order}" for one in work.factorisations)
    yield "factorisations and their orders", factorisations or "none"
    yield "right-hand sides", f"{work.right_hand_sides:,}"
    yield "unknowns of the contact system", f"{work.contact_unknowns:,}"


def _left_out(solution: Solution) -> Table:
    table = _table("left out", "why")
    table.columns[1].justify = "left"
    for item in solution.plan.items:
        if not item.is_needed:
            table.add_row(item.name, item.reason)
    return table


def _table(first: str, *others: str) -> Table:
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    table.add_column(first, overflow="fold")
    for name in others:
        table.add_column(name, justify="right", overflow="fold")
    return table
