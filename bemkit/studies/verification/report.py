"""What ``bemkit verify`` prints, and the same as Markdown."""

from __future__ import annotations

import math
from itertools import groupby

from rich.console import Console
from rich.text import Text

from bemkit.results.outputs import stdout_console
from bemkit.studies.verification.records import Verification, VerifiedRow

HEAD = ("case", "quantity", "source", "expected", "errors", "order", "bound")
_LINE = "  {:<27}{:>11}  {:<23} {:>5} {:>7}"
MARKDOWN_START = "| case | quantity |"


def print_verification(verification: Verification, console: Console | None = None) -> None:
    """Print the rows below the names of their cases, those that are missed in red, and how many there are."""
    console = stdout_console(console)
    console.print(Text(_LINE.format(*HEAD[1:2], *HEAD[3:]).rstrip(), style="bold"))
    for name, rows in groupby(verification.rows, key=lambda row: row.name):
        for number, row in enumerate(rows):
            if number == 0:
                console.print(Text(f"{name}: {row.case.title} [{row.case.source}]", style="cyan"))
            _, quantity, _, *numbers = _cells(row)
            console.print(Text(_LINE.format(quantity, *numbers), style="" if row.is_met else "bold red"))
    for row in verification.missed:
        reason = next((record.message for record in row.records if record.message), "")
        console.print(Text(f"missed: {row.name}, {row.quantity.name}{': ' if reason else ''}{reason}", style="red"))
    n_missed = len(verification.missed)
    console.print(Text(f"{len(verification.rows) - n_missed} of {len(verification.rows)} rows met", style="bold"))


def to_markdown(verification: Verification) -> str:
    """Return the table, and below it the validity of each case."""
    lines = [f"| {' | '.join((*HEAD, 'met'))} |", f"|{'---|' * (len(HEAD) + 1)}"]
    lines += [f"| {' | '.join((*_cells(row), 'yes' if row.is_met else '**no**'))} |" for row in verification.rows]
    cases = {row.name: row.case for row in verification.rows}
    lines += ["", "| case | problem | holds for |", "|---|---|---|"]
    lines += [f"| {name} | {case.title} | {case.validity} |" for name, case in cases.items()]
    return "\n".join(lines) + "\n"


def _cells(row: VerifiedRow) -> tuple[str, ...]:
    expected = f"{row.quantity.expected:.6g}" if row.quantity.expected else "-"
    errors = " ".join(f"{error:.1e}" for error in row.errors)
    order = "-" if math.isnan(row.order) else f"{row.order:.1f}"
    return row.name, row.quantity.name, row.case.source, expected, errors, order, f"{row.bounds[-1]:.1e}"
