"""The table that ``bemkit sweep`` prints."""

from __future__ import annotations

import sys
from collections.abc import Sequence

import numpy as np
from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.errors import counted
from bemkit.studies.sweep.table import Sweep

_SHOWN = ("force_normal", "force_tangential", "energy", "contact_length", "peak_pressure")
_WIDE = ("largest_slip", "estimated_error", "n_elements", "linear_solves", "seconds")
WIDE = 110
"""Least width of a terminal for all results; files always have them."""
MOST_PRINTED = 60
SHORT = {
    "force_normal": "normal force",
    "force_tangential": "friction",
    "contact_length": "length",
    "peak_pressure": "pressure",
    "largest_slip": "slip",
    "estimated_error": "error",
    "n_elements": "elements",
    "linear_solves": "solves",
}


def print_sweep(sweep: Sweep) -> None:
    """Print the solved rows as a table, and below it the failed ones, each with its reason."""
    # into a file or a pipe there is room
    console = stdout_console(width=None if sys.stdout.isatty() else 200)
    names = [*_SHOWN, *(_WIDE if console.width >= WIDE else ())]
    console.print(Text(sweep.scene.title, style="bold"))
    table = plain_table(right=[*_short_keys(sweep.keys), *(SHORT.get(name, name) for name in names)], gap=2)
    for row in sweep.solved[:MOST_PRINTED]:
        table.add_row(*(_short(sweep.entry(row, name)) for name in (*sweep.keys, *names)))
    console.print(table)
    if len(sweep.solved) > MOST_PRINTED:
        more = len(sweep.solved) - MOST_PRINTED
        console.print(Text(f"{counted(more, 'row')} more: write them to a file (-o, --csv, --json)", style="dim"))
    for row in sweep.failed:
        values = ", ".join(f"{key} = {value:g}" for key, value in zip(sweep.keys, row.values, strict=True))
        console.print(Text(f"{values}: {row.status.replace('_', ' ')}: {row.message}", style="red"))
    inaccurate = [row for row in sweep.solved if row.message]
    if inaccurate:
        console.print(
            Text(f"{counted(len(inaccurate), 'row')} less accurate than asked: see the messages", style="yellow")
        )


def _short_keys(keys: Sequence[str]) -> list[str]:
    """Return the last names of the keys, where these are distinct."""
    last = [key.rsplit(".", 1)[-1] for key in keys]
    return [short if last.count(short) == 1 else key for short, key in zip(last, keys, strict=True)]


def _short(value: float) -> str:
    return "-" if not np.isfinite(value) else f"{value:.6g}"
