"""What ``bemkit study`` prints: a progress bar on standard error, tables on standard output."""

from __future__ import annotations

import csv
import io
import json
from collections import Counter
from collections.abc import Sequence

from rich.box import SIMPLE_HEAD
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn
from rich.table import Table
from rich.text import Text

from bemkit.results.solution import Solution
from bemkit.results.tables import finite_only
from bemkit.studies.paper_tables import RHO, PaperTable, paper_tables


def compute_with_progress(*, is_live: bool) -> tuple[PaperTable, PaperTable]:
    """Compute the paper's tables while a bar on standard error shows how far it is."""
    if not is_live:
        return paper_tables()
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("paper tables", total=2 * len(RHO) ** 2)

        def advance(number: int, rho_1: float, rho_2: float) -> None:
            text = f"Table {number}, rho_1 = {rho_1:.0e}, rho_2 = {rho_2:.0e}"
            bar.update(task, advance=1, description=text)

        return paper_tables(advance)


def print_paper_tables(tables: Sequence[PaperTable], console: Console | None = None) -> None:
    """Print ours beside the print: ``12/13 (28)`` is 12 outer steps here, 13 in the paper, 28 linear solves here."""
    console = Console(highlight=False) if console is None else console
    for table in tables:
        shown = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
        shown.add_column("rho", justify="right", no_wrap=True)
        for rho in RHO:
            shown.add_column(f"{rho:.0e}", justify="right", no_wrap=True)
        for i, rho in enumerate(RHO):
            shown.add_row(f"{rho:.0e}", *(_cell(table, i, j) for j in range(len(RHO))))
        heading = f"Table {table.number}: outer steps here/print (linear solves here); rho_1 down, rho_2 across"
        console.print(Text(heading, style="bold"))
        console.print(shown)
        console.print(f"semismooth Newton on the same problem: {table.newton_solves} linear solves for every rho\n")


def to_json(tables: Sequence[PaperTable]) -> str:
    """Return the tables as one JSON object."""
    return json.dumps({"tables": [table.as_dict() for table in tables]}, indent=2) + "\n"


def to_csv(tables: Sequence[PaperTable]) -> str:
    """Return one row for each pair of rho of both tables."""
    rows = [row for table in tables for row in table.rows()]
    stream = io.StringIO()
    writer = csv.DictWriter(stream, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return stream.getvalue()


def print_solutions(found: Sequence[Solution], n_starts: int, console: Console | None = None) -> None:
    """Print how many distinct solutions there are, and what tells them apart."""
    console = Console(highlight=False) if console is None else console
    if not found:
        console.print(f"none of {n_starts} starts leads to a solution")
        return
    title = f"{len(found)} distinct solution{'s' * (len(found) > 1)} from {n_starts} starts"
    console.print(Text(title, style="bold yellow" if len(found) > 1 else "bold"))
    table = Table(box=SIMPLE_HEAD, show_edge=False, pad_edge=False)
    for name in ("separated", "slip", "stick", "normal force", "friction force", "energy"):
        table.add_column(name, justify="right", no_wrap=True)
    for solution in found:
        counts = Counter(solution.contact.status_words())
        forces = (solution.force_normal, solution.force_tangential, solution.energy)
        table.add_row(
            *(str(counts[word]) for word in ("separated", "slip", "stick")), *(f"{value:.6g}" for value in forces)
        )
    console.print(table)


def solutions_to_json(found: Sequence[Solution], n_starts: int) -> str:
    """Return the summaries of all solutions as one JSON object."""
    summaries = [finite_only(solution.summary()) for solution in found]
    return json.dumps({"starts": n_starts, "solutions": summaries}, indent=2, allow_nan=False) + "\n"


def _cell(table: PaperTable, i: int, j: int) -> str:
    return f"{table.outer_steps[i, j]}/{table.printed[i, j]} ({table.linear_solves[i, j]})"
