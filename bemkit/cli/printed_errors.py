"""Tables that ``bemkit study errors`` prints: one for each series of meshes, then the orders of all."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.console import Console
from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.reference.compare import MEASURES, Reference
from bemkit.studies.accuracy.records import ErrorRecord, by_series, fitted_rate, orders, pareto_front

WIDE = 100
"""Least width of a terminal for stages, memory and estimates; files always have them."""
SHORT = {name: name for name in MEASURES} | {
    "displacement": "displ.",
    "force_normal": "force_n",
    "force_tangential": "force_t",
    "transitions": "transit.",
}


def print_reference(title: str, reference: Reference) -> None:
    """Print the reference of the errors and its own uncertainty."""
    console = _console(None)
    console.print(Text(title, style="bold"))
    console.print(Text(f"reference: {reference.source}"))
    own = [f"{MEASURES[name]} {value:.0e}" for name, value in reference.own_errors.items() if np.isfinite(value)]
    if own:
        console.print(Text(f"its own errors, at most: {', '.join(own)}", style="dim"))
    console.print()


def print_study(records: Sequence[ErrorRecord], measures: Sequence[str], console: Console | None = None) -> None:
    """Print all series, their fitted orders, and the fastest run for each error."""
    console = _console(console)
    fronts = {measure: pareto_front(records, measure) for measure in measures}
    marked: dict[str, set[object]] = {measure: {record.key for record in front} for measure, front in fronts.items()}
    for series in by_series(records):
        _print_series(series, measures, marked, console)
    _print_orders(records, measures, console)
    if any(fronts.values()):
        console.print(Text("* no other run of this study is both faster and more accurate", style="dim"))
    elif records:
        console.print(Text("run times and memory were not measured: the runs were spread over processes", style="dim"))


def _print_series(
    records: Sequence[ErrorRecord], measures: Sequence[str], marked: dict[str, set[object]], console: Console
) -> None:
    """Print the records of one series; each error is followed by its order against the mesh before."""
    first = records[0]
    words = (f"{first.discretisation} elements", first.map, f"{first.meshes} meshes", first.solver)
    console.print(Text(", ".join(words), style="bold"))
    is_wide = console.width >= WIDE
    table = plain_table(right=[*_costs(first, is_wide=is_wide)])
    for measure in measures:
        table.add_column(f"{SHORT[measure]:>6}", no_wrap=True)
    steps = {measure: orders(records, measure) for measure in measures}
    for k, record in enumerate(records):
        errors = [_error(record, measure, steps[measure][k], record.key in marked[measure]) for measure in measures]
        table.add_row(*_costs(record, is_wide=is_wide).values(), *errors)
    console.print(table)
    for record in records:
        if not record.is_certified:
            status = record.status.replace("_", " ")
            console.print(Text(f"  {_aim(record.size)}: {status}: {record.message}", style="red"))
        elif record.message:
            # the first sentence; the rest is in the files
            console.print(Text(f"  {record.message.split('. ')[0]}", style="yellow"))
    console.print()


def _print_orders(records: Sequence[ErrorRecord], measures: Sequence[str], console: Console) -> None:
    console.print(Text("observed rates in the number n of unknowns, fitted to the last meshes", style="bold"))
    table = plain_table(("elements", "method", "meshes", "solver"), [SHORT[measure] for measure in measures])
    for column in table.columns[:3]:
        column.no_wrap = True
    for series in by_series(records):
        first = series[0]
        cells = [str(fitted_rate(series, measure)) for measure in measures]
        table.add_row(first.discretisation, first.map, first.meshes, first.solver, *cells)
    console.print(table)


def _costs(record: ErrorRecord, *, is_wide: bool) -> dict[str, str]:
    """Return the columns before the errors, by their heads."""
    costs = {"aim": _aim(record.size)} if record.meshes == "adaptive" else {}
    costs |= {"N": str(record.elements or "-"), "it": str(record.linear_solves)}
    if is_wide:
        stages = {"assem.": record.seconds_assemble, "cond.": record.seconds_condense, "solve": record.seconds_solve}
        costs |= {head: _number(seconds, ".3f") for head, seconds in stages.items()}
    costs["total s"] = _number(record.seconds, ".3f")
    if is_wide:
        costs |= {"MB": _number(record.peak_memory / 1e6, ".3g"), "estim.": _short(record.estimated_error)}
    return costs


def _error(record: ErrorRecord, measure: str, order: float, is_best: bool) -> Text:
    value = getattr(record, measure)
    text = "absent" if np.isposinf(value) else _short(value)
    step = f"{order:4.1f}" if np.isfinite(order) else "    "
    return Text(f"{text:>6} {step}{'*' if is_best else ' '}", style="bold green" if is_best else "")


def _short(value: float) -> str:
    """Return two digits, as 1.2e-4."""
    return "-" if not np.isfinite(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+00", "e0")


def _aim(size: float) -> str:
    return f"{size:g}" if size >= 1.0 else f"{size:.0e}".replace("e-0", "e-")


def _number(value: float, form: str) -> str:
    return "-" if not np.isfinite(value) else f"{value:{form}}"


def _console(console: Console | None) -> Console:
    # into a file or a pipe there is room
    return stdout_console(console, width=None if sys.stdout.isatty() else 120)
