"""Comparing rows whose numbers may be nan."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple

import numpy as np

from bemkit.studies.sweep.records import SweepRow


def equal_rows(rows: Sequence[SweepRow], others: Sequence[SweepRow]) -> bool:
    """Whether rows are equal in everything, run times included."""
    pairs = zip(map(astuple, rows), map(astuple, others), strict=True)
    return all(
        one == two or (one != one and two != two)  # nan
        for row, other in pairs
        for one, two in zip(row, other, strict=True)
    )


def equal_results(rows: Sequence[SweepRow], others: Sequence[SweepRow]) -> bool:
    """Whether rows have equal values, words and numbers to ten digits; how long they took does not matter."""
    names = ("force_normal", "force_tangential", "energy", "contact_length", "peak_pressure", "largest_slip")
    numbers = [np.array([[getattr(row, name) for name in names] for row in each]) for each in (rows, others)]
    words = [[(row.values, row.status, row.message) for row in each] for each in (rows, others)]
    return words[0] == words[1] and np.allclose(*numbers, rtol=1e-10, atol=1e-15, equal_nan=True)
