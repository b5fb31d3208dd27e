"""What ``bemkit stability`` prints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.table import Table
from rich.text import Text

from bemkit.studies.stability.cases import Axis
from bemkit.studies.stability.files import cells
from bemkit.studies.stability.sweep import Row, Verdict

_STYLES = {"right": "green", "coarse": "yellow", "ambiguous": "yellow", "named": "cyan", "wrong": "bold red"}


def print_axis(axis: Axis, rows: Sequence[Row], console: Console | None = None) -> None:
    """Print the table of one axis, and the reasons of rows that are not right."""
    console = Console(highlight=False) if console is None else console
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False, padding=(0, 1, 0, 0))
    for name in ("value", "verdict", "solves", "cert.", "check", "Betti", "cond.", "drift", "twin", "s"):
        table.add_column(name, justify="left" if name == "verdict" else "right", no_wrap=True)
    for row in rows:
        value, verdict, status, *rest = cells(row)
        words = verdict if verdict == "right" else f"{verdict}: {status}"
        table.add_row(value, Text(words, style=_STYLES[verdict]), *rest, f"{row.seconds:.2f}")
    console.print(Text(f"{axis.name}: {axis.label}", style="bold"))
    console.print(Text(f"promise: {axis.promise}", style="dim"))
    console.print(table)
    for row in rows:
        if row.message:
            console.print(Text(f"  {row.value:.9g}: {row.message}"))
    console.print()


def print_verdicts(rows: Sequence[Row], console: Console | None = None) -> None:
    """Print how many rows got which verdict."""
    console = Console(highlight=False) if console is None else console
    counts = Counter(row.verdict for row in rows)
    words = [f"{counts[verdict.value]} {verdict.value}" for verdict in Verdict if counts[verdict.value]]
    console.print(Text(f"{len(rows)} rows: {', '.join(words)}", style="bold"))
