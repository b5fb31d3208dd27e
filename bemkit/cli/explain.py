"""What a run was planned to take and what it took, for people: ``bemkit run --explain``."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Iterator
from dataclasses import replace

from rich.box import SIMPLE_HEAD
from rich.console import Console, Group
from rich.table import Table
from rich.text import Text

from bemkit.cli.console import format_seconds, format_size
from bemkit.operators.counts import Work
from bemkit.plan import Stage, this_machine
from bemkit.results.solution import Solution


def with_memory(solution: Solution, solve_again: Callable[[], Solution]) -> Solution:
    """Return a solution with the memory of another run, which is traced: that makes small scenes twice as slow.

    Parameters
    ----------
    solution : Solution
        Whose run also loaded what is loaded on first use, and is no memory of a stage.
    solve_again : callable
        Returns the same solution.

    Returns
    -------
    Solution
    """
    tracemalloc.start()
    try:
        return replace(solution, memory=solve_again().memory)
    finally:
        tracemalloc.stop()


def print_explanation(solution: Solution, output_seconds: float, *, to_stderr: bool = False) -> None:
    """Print planned against measured time and memory, the counts, and what was left out.

    Parameters
    ----------
    solution : Solution
        From `with_memory`.
    output_seconds : float [s]
        What writing its outputs took.
    to_stderr : bool
        Whether standard output is taken by data.
    """
    console = Console(stderr=to_stderr, highlight=False)
    console.print(Group(_stages(solution, output_seconds), _counts(solution.plan.work, solution.work)))
    console.print(_left_out(solution))


def _stages(solution: Solution, output_seconds: float) -> Table:
    table = _table("stage", "time planned", "time", "memory planned", "memory")
    planned, peaks = solution.plan.seconds(this_machine()), solution.plan.peaks
    measured = {**solution.timings, Stage.OUTPUTS.value: output_seconds}
    for stage in Stage:
        name = stage.value
        sizes = [format_size(size) if size else "" for size in (peaks.get(stage, 0), solution.memory.get(name, 0))]
        table.add_row(name, format_seconds(planned[stage]), format_seconds(measured[name]), *sizes)
    totals = [format_seconds(sum(planned.values())), format_seconds(sum(measured[stage.value] for stage in Stage))]
    memory = [format_size(solution.plan.memory), format_size(max(solution.memory.values(), default=0))]
    table.add_section()
    table.add_row("all", *totals, *memory)
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
