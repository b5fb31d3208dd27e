"""Fill ``docs/stability.md`` and ``docs/tables``: ``python docs/make_stability.py`` runs all sweeps (some minutes)."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from markers import between

import bemkit as bk
from bemkit.scene.toml import with_overrides
from bemkit.studies.stability.axes import axes_of
from bemkit.studies.stability.records import StabilityRecord, Verdict
from bemkit.studies.stability.sweep import sweep
from bemkit.table import Table, columns_of, markdown_table

DOCS = Path(__file__).parent
PAGE = DOCS / "stability.md"
RUNS = (("paper-1", "linear"), ("paper-2", "constant"), ("paper-1", "constant"), ("paper-2", "linear"))
COLUMNS = tuple(head for head in columns_of(StabilityRecord) if head.name not in {"seconds", "message"})  # reproducible


def main() -> None:
    """Run the sweeps, write their rows as CSV files and the two tables of the page."""
    records: dict[tuple[str, str], list[StabilityRecord]] = {}
    for name, discretisation in RUNS:
        scene = with_overrides(bk.load_scene(name), discretisation=discretisation)
        records[name, discretisation] = list(sweep(scene, axes_of(scene)))
        write_rows(DOCS / "tables" / f"stability-{name}-{discretisation}.csv", records[name, discretisation])
    text = between(PAGE.read_text("utf-8"), "summary", summary(records))
    PAGE.write_text(between(text, "axes", table_of_axes(records["paper-1", "linear"])), "utf-8")


def write_rows(path: Path, records: Sequence[StabilityRecord]) -> None:
    """Write the rows of one sweep as people read them."""
    rows = (tuple(head.cell(getattr(record, head.name)) for head in COLUMNS) for record in records)
    path.write_text(Table(COLUMNS, tuple(rows)).to_csv(), "utf-8")


def summary(records: dict[tuple[str, str], list[StabilityRecord]]) -> str:
    """Return the number of rows with each verdict, one line for a sweep."""
    verdicts = [verdict.value for verdict in Verdict]
    lines = []
    for (name, discretisation), rows in records.items():
        counts = Counter(row.verdict for row in rows)
        numbers = [str(counts[verdict]) for verdict in verdicts]
        lines.append([f"`{name}`", discretisation, str(len(rows)), *numbers])
    heads = ["scene", "elements", "rows", *verdicts]
    return markdown_table(heads, lines, [False, False, *(True,) * (len(heads) - 2)]).rstrip()


def table_of_axes(records: Sequence[StabilityRecord]) -> str:
    """Return what each axis varies, from where to where, its promise and its verdicts."""
    lines = []
    for axis in axes_of(bk.load_scene("paper-1")):
        rows = [record for record in records if record.axis == axis.name]
        values = sorted(row.value for row in rows)
        counts = Counter(row.verdict for row in rows)
        span = f"{values[0]:g} ... {values[-1]:g}"
        lines.append([f"`{axis.name}`", axis.label, span, axis.promise, str(counts["right"]), str(counts["named"])])
    heads = ["axis", "quantity", "range", "promise", "right", "named"]
    return markdown_table(heads, lines, [False] * 4 + [True] * 2).rstrip()


if __name__ == "__main__":
    main()
