"""What ``bemkit stability`` prints and draws."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.text import Text

from bemkit.results.drawing import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Figure, new_figure, show_grid
from bemkit.results.outputs import plain_table, stdout_console
from bemkit.studies.stability.axes import Axis
from bemkit.studies.stability.records import StabilityRecord, Verdict, cells

_STYLES = {"right": "green", "coarse": "yellow", "ambiguous": "yellow", "named": "cyan", "wrong": "bold red"}

_SERIES = (
    ("certificate", "certificate of the driver", BLUE, "o"),
    ("check", "independent check", GREEN, "s"),
    ("twin", "difference to the similar twin", ORANGE, "^"),
    ("drift", "drift from the reference", GREY, "x"),
)
_FLOOR = 1e-18


def print_axis(axis: Axis[Any], records: Sequence[StabilityRecord]) -> None:
    """Print the table of one axis, and the reasons of records that are not right."""
    console = stdout_console()
    heads = ("value", "verdict", "solves", "cert.", "check", "Betti", "cond.", "drift", "twin", "s")
    table = plain_table(right=heads)
    table.columns[1].justify = "left"
    for record in records:
        value, verdict, status, *rest = cells(record)
        words = verdict if verdict == "right" else f"{verdict}: {status}"
        table.add_row(value, Text(words, style=_STYLES[verdict]), *rest, f"{record.seconds:.2f}")
    console.print(Text(f"{axis.name}: {axis.label}", style="bold"))
    console.print(Text(f"promise: {axis.promise}", style="dim"))
    console.print(table)
    for record in records:
        if record.message:
            console.print(Text(f"  {record.value:.9g}: {record.message}"))
    console.print()


def print_left_out(reasons: Mapping[str, str]) -> None:
    """Print which axes say nothing of a scene, and why."""
    console = stdout_console()
    for name, reason in reasons.items():
        console.print(Text(f"{name}: left out: {reason}", style="dim"))


def print_verdicts(records: Sequence[StabilityRecord]) -> None:
    """Print how many records got which verdict."""
    console = stdout_console()
    counts = Counter(record.verdict for record in records)
    words = [f"{counts[verdict.value]} {verdict.value}" for verdict in Verdict if counts[verdict.value]]
    console.print(Text(f"{len(records)} rows: {', '.join(words)}", style="bold"))


def draw_axes(axes: Sequence[Axis[Any]], records: Sequence[StabilityRecord]) -> dict[str, Figure]:
    """Draw one figure for each axis, by file names."""
    return {figure_name(axis): draw_axis(axis, [one for one in records if one.axis == axis.name]) for axis in axes}


def figure_name(axis: Axis[Any]) -> str:
    """Return the name of the file, without ``.png``."""
    return f"stability-{axis.name}"


def draw_axis(axis: Axis[Any], records: Sequence[StabilityRecord]) -> Figure:
    """Draw one axis."""
    figure = new_figure(6.4, 4.0)
    plot = figure.add_subplot()
    is_logarithmic = axis.is_logarithmic and any(record.value > 0.0 for record in records)
    if is_logarithmic:
        records = [record for record in records if record.value > 0.0]
    values = np.array([record.value for record in records])
    for name, label, colour, marker in _SERIES:
        numbers = np.maximum([getattr(record, name) for record in records], _FLOOR)
        shown = np.isfinite(numbers)
        plot.plot(
            values[shown], numbers[shown], marker, color=colour, label=label, markersize=5, linestyle="-", linewidth=0.8
        )
    for verdict, colour in ((Verdict.NAMED, SKY), (Verdict.WRONG, VERMILION)):
        marked = [record.value for record in records if record.verdict == verdict.value]
        for k, value in enumerate(marked):
            plot.axvline(value, color=colour, linewidth=4, alpha=0.35, label=verdict.value if k == 0 else None)
    if is_logarithmic:
        plot.set_xscale("log")
    plot.set_yscale("log")
    plot.set_xlabel(axis.label)
    plot.set_ylabel("dimensionless")
    plot.set_title(axis.name, loc="left")
    show_grid(plot)
    plot.legend(fontsize="small", frameon=False)
    return figure
