"""Rows of error studies in files: HDF5 that is complete after every row, and CSV with orders and Pareto marks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import fields

from bemkit.reference.values import MEASURES
from bemkit.results.record_file import RowFile, csv_text
from bemkit.studies.accuracy.rows import Row, by_series, orders, pareto_front

FILE = RowFile(
    "bemkit-study", 1, "bemkit study errors", Row, ("scene", "reference", "grading", "budget", "repetitions")
)
CSV_START = "discretisation,map,meshes,solver,size,"


def to_csv(rows: Sequence[Row]) -> str:
    """Return the rows as comma-separated values.

    Besides the fields of `Row` there are, for each error, ``order_...`` against the mesh before and ``pareto_...``,
    which is 1 if no other row is both faster and more accurate.
    """
    names = [field.name for field in fields(Row)]
    fronts = {measure: {row.key for row in pareto_front(rows, measure)} for measure in MEASURES}
    lines = []
    for series in by_series(rows):
        steps = {measure: orders(series, measure) for measure in MEASURES}
        for k, row in enumerate(series):
            values = [getattr(row, name) for name in names]
            values += [steps[measure][k] for measure in MEASURES]
            lines.append([*values, *(int(row.key in fronts[measure]) for measure in MEASURES)])
    head = [*names, *(f"order_{measure}" for measure in MEASURES), *(f"pareto_{measure}" for measure in MEASURES)]
    return csv_text(head, lines)
