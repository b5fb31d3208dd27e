"""Table that ``bemkit verify`` prints."""

from __future__ import annotations

from itertools import groupby

from rich.console import Console
from rich.text import Text

from bemkit.cli.outputs import stdout_console
from bemkit.studies.verification.records import HEAD, Verification, cells_of

_LINE = "  {:<27}{:>11}  {:<23} {:>5} {:>7}"


def print_verification(verification: Verification, console: Console | None = None) -> None:
    """Print the rows below the names of their cases, missed ones in red, and the number of both."""
    console = stdout_console(console)
    console.print(Text(_LINE.format(*HEAD[1:2], *HEAD[3:]).rstrip(), style="bold"))
    for name, rows in groupby(verification.rows, key=lambda row: row.name):
        for number, row in enumerate(rows):
            if number == 0:
                console.print(Text(f"{name}: {row.case.title} [{row.case.source}]", style="cyan"))
            _, quantity, _, *numbers = cells_of(row)
            console.print(Text(_LINE.format(quantity, *numbers), style="" if row.is_met else "bold red"))
    for row in verification.missed:
        reason = next((record.message for record in row.records if record.message), "")
        console.print(Text(f"missed: {row.name}, {row.quantity.name}{': ' if reason else ''}{reason}", style="red"))
    n_missed = len(verification.missed)
    console.print(Text(f"{len(verification.rows) - n_missed} of {len(verification.rows)} rows met", style="bold"))
