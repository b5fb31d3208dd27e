"""Records of a stability sweep: in HDF5 files that are complete after every record, as CSV, and as Markdown tables."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass, fields
from enum import Enum
from typing import Any

import numpy as np

from bemkit.hdf5 import FileFormat
from bemkit.results.outputs import csv_text
from bemkit.results.record_file import RecordFile
from bemkit.studies.stability.axes import Axis


class Verdict(Enum):
    """What a record shows."""

    RIGHT = "right"
    """Called converged; the independent check and the similar twin agree, and so does the reference where it must."""
    COARSE = "coarse"
    """The same, but the mesh is so coarse that tractions and displacements hardly belong together."""
    AMBIGUOUS = "ambiguous"
    """The case and its twin each pass the independent check, and differ: nothing decides between several solutions."""
    NAMED = "named"
    """No answer, but a named status or error, and the same for the twin."""
    WRONG = "wrong"
    """Called converged against the evidence, refused although solvable, or an answer that the twin does not share."""


@dataclass(frozen=True)
class StabilityRecord:
    """One line of the tables.

    Parameters
    ----------
    axis : str
    value : float
    verdict, status : str
        Values of `Verdict`; name of the solver's status in small letters, or `bemkit.studies.engine.REFUSED`.
    linear_solves : int
    certificate : float
        Worst entry, as the driver says.
    check : float
        Worst entry of the independent check, see `IndependentCheck`.
    reciprocity : float
        Of the independent check: elasticity itself, up to the discretisation error.
    condition : float
        2-norm condition number of the contact stiffness with unit diagonal, free rigid motions left out.
    drift : float
        Largest difference to the reference, scaled back, relative to its largest displacement and traction.
    twin : float
        The same between the case and its similar twin: nothing but amplified round-off.
    seconds : float [s]
    message : str
        The remark of the solver or the text of the error; what speaks against the record if it is wrong.
    """

    axis: str
    value: float
    verdict: str
    status: str
    linear_solves: int
    certificate: float
    check: float
    reciprocity: float
    condition: float
    drift: float
    twin: float
    seconds: float
    message: str

    @property
    def key(self) -> tuple[str, float]:
        """What tells records of one sweep apart."""
        return self.axis, self.value


FORMAT = FileFormat("bemkit-stability", 1, "bemkit stability file", "bemkit stability -o")
FILE = RecordFile(FORMAT, StabilityRecord, ("scene",))
CSV_START = "axis,value,verdict,status,"
MARKDOWN_START = "### "


def to_csv(records: Sequence[StabilityRecord]) -> str:
    """Return the records as comma-separated values with a header line."""
    return csv_text([field.name for field in fields(StabilityRecord)], map(astuple, records))


def to_markdown(axes: Sequence[Axis[Any]], records: Sequence[StabilityRecord]) -> str:
    """Return one Markdown table for each axis; run times are left out, so that equal results make equal text."""
    head = ("verdict", "status", "solves", "certificate", "check", "Betti", "condition", "drift", "twin")
    lines = []
    for axis in axes:
        lines += [f"{MARKDOWN_START}{axis.name}", "", f"Promise: {axis.promise}.", ""]
        lines += [f"| {axis.label} | {' | '.join(head)} |", "|---:|---|---|" + "---:|" * (len(head) - 2)]
        lines += [f"| {' | '.join(cells(record))} |" for record in records if record.axis == axis.name]
        lines.append("")
    return "\n".join(lines)


def cells(record: StabilityRecord) -> list[str]:
    """Return the entries of a record as short texts: value, verdict, status, linear solves, then the numbers."""
    numbers = (record.certificate, record.check, record.reciprocity, record.condition, record.drift, record.twin)
    solves = str(record.linear_solves) if record.linear_solves else ""
    return [
        f"{record.value:.8g}",
        record.verdict,
        record.status.replace("_", " "),
        solves,
        *("" if np.isnan(number) else f"{number:.0e}" for number in numbers),
    ]
