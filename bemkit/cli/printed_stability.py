"""Tables that ``bemkit stability`` prints."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence

from rich.text import Text

from bemkit.cli.outputs import plain_table, stdout_console
from bemkit.errors import counted
from bemkit.studies.stability.axes import Axis
from bemkit.studies.stability.records import StabilityRecord, Verdict, cells

_STYLES = {"right": "green", "coarse": "yellow", "ambiguous": "yellow", "named": "cyan", "wrong": "bold red"}


def print_axis(axis: Axis, records: Sequence[StabilityRecord]) -> None:
    """Print the table of one axis, and the reasons of records that are not right."""
    console = stdout_console()
    heads = ("value", "verdict", "solves", "cert.", "check", "Betti", "cond.", "dev.", "copy", "s")
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
    """Print the axes that do not apply to a scene, and the reasons."""
    console = stdout_console()
    for name, reason in reasons.items():
        console.print(Text(f"{name}: skipped: {reason}", style="dim"))


def print_verdicts(records: Sequence[StabilityRecord]) -> None:
    """Print the number of records of each verdict."""
    console = stdout_console()
    counts = Counter(record.verdict for record in records)
    words = [f"{counts[verdict.value]} {verdict.value}" for verdict in Verdict if counts[verdict.value]]
    console.print(Text(f"{counted(len(records), 'row')}: {', '.join(words)}", style="bold"))
