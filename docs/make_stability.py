"""Fill ``docs/stability.md`` and ``docs/tables``: ``python docs/make_stability.py`` runs all sweeps (some minutes)."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Sequence
from dataclasses import fields
from pathlib import Path

from markers import between

import bemkit as bk
from bemkit.scene.toml import with_overrides
from bemkit.studies.stability.axes import AXES
from bemkit.studies.stability.records import StabilityRecord, Verdict
from bemkit.studies.stability.sweep import sweep

DOCS = Path(__file__).parent
PAGE = DOCS / "stability.md"
RUNS = (("paper-1", "linear"), ("paper-2", "constant"), ("paper-1", "constant"), ("paper-2", "linear"))
COLUMNS = [field.name for field in fields(StabilityRecord) if field.name not in {"seconds", "message"}]  # reproducible


def main() -> None:
    """Run the sweeps, write their rows as CSV files and the two tables of the page."""
    records: dict[tuple[str, str], list[StabilityRecord]] = {}
    for name, discretisation in RUNS:
        scene = with_overrides(bk.load_scene(name), discretisation=discretisation)
        records[name, discretisation] = list(sweep(scene, AXES))
        write_rows(DOCS / "tables" / f"stability-{name}-{discretisation}.csv", records[name, discretisation])
    text = between(PAGE.read_text("utf-8"), "summary", summary(records))
    PAGE.write_text(between(text, "axes", table_of_axes(records["paper-1", "linear"])), "utf-8")


def write_rows(path: Path, records: Sequence[StabilityRecord]) -> None:
    """Write the rows of one sweep, numbers to two digits."""
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(COLUMNS)
        for record in records:
            values = [getattr(record, column) for column in COLUMNS]
            writer.writerow([f"{value:.2g}" if isinstance(value, float) else value for value in values])


def summary(records: dict[tuple[str, str], list[StabilityRecord]]) -> str:
    """Return the number of rows with each verdict, one line for a sweep."""
    lines = ["| scene | elements | rows | " + " | ".join(v.value for v in Verdict) + " |", "|---|---|" + "---:|" * 6]
    for (name, discretisation), rows in records.items():
        counts = Counter(row.verdict for row in rows)
        numbers = " | ".join(str(counts[verdict.value]) for verdict in Verdict)
        lines.append(f"| `{name}` | {discretisation} | {len(rows)} | {numbers} |")
    return "\n".join(lines)


def table_of_axes(records: Sequence[StabilityRecord]) -> str:
    """Return what each axis varies, from where to where, its promise and its verdicts."""
    lines = ["| axis | quantity | range | promise | right | named |", "|---|---|---|---|---:|---:|"]
    for axis in AXES:
        rows = [record for record in records if record.axis == axis.name]
        values = sorted(row.value for row in rows)
        counts = Counter(row.verdict for row in rows)
        label = axis.label.replace("|", r"\|")
        span = f"{values[0]:g} ... {values[-1]:g}"
        lines.append(f"| `{axis.name}` | {label} | {span} | {axis.promise} | {counts['right']} | {counts['named']} |")
    return "\n".join(lines)


if __name__ == "__main__":
    main()
