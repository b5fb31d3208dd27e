"""What was measured: a record for each quantity at each resolution, their file, and the rows that they make."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from bemkit.hdf5 import FileFormat
from bemkit.results.outputs import json_text
from bemkit.results.record_file import RecordFile
from bemkit.studies.verification.case import Case, Quantity


@dataclass(frozen=True)
class VerificationRecord:
    """One quantity at one resolution.

    Parameters
    ----------
    case, quantity : str
    resolution : float
        Number of elements, or accuracy, that was asked for.
    n_elements : int
    value, error : float
        Infinite error if there is no certified solution.
    seconds : float [s]
        Of the solve, which all quantities of a case share.
    message : str
        Why there is no solution.
    """

    case: str
    quantity: str
    resolution: float
    n_elements: int
    value: float
    error: float
    seconds: float
    message: str

    @property
    def key(self) -> tuple[str, str, float]:
        """What tells the records of one verification apart."""
        return self.case, self.quantity, self.resolution


ROUND_OFF = 1e-12
"""Errors below it fall no further."""
FORMAT = FileFormat("bemkit-verification", 1, "bemkit verification file", "bemkit verify -o")
FILE = RecordFile(FORMAT, VerificationRecord, ("version",))


@dataclass(frozen=True)
class VerifiedRow:
    """A quantity of a case at all resolutions.

    Parameters
    ----------
    name : str
        Of the case.
    case : Case
    quantity : Quantity
    records : tuple of VerificationRecord
        From the coarsest resolution to the finest.
    """

    name: str
    case: Case
    quantity: Quantity
    records: tuple[VerificationRecord, ...]

    @property
    def errors(self) -> tuple[float, ...]:
        """Error at each resolution."""
        return tuple(record.error for record in self.records)

    @property
    def bounds(self) -> tuple[float, ...]:
        """Bound at each resolution."""
        by_resolution = dict(zip(self.case.resolutions, self.quantity.bounds, strict=True))
        return tuple(by_resolution[record.resolution] for record in self.records)

    @property
    def order(self) -> float:
        """The power of the number of elements by which the error fell; nan of one mesh and where round-off is left."""
        if not self.records:
            return math.nan
        first, last = self.records[0], self.records[-1]
        if not (
            ROUND_OFF < last.error < math.inf
            and ROUND_OFF < first.error < math.inf
            and first.n_elements < last.n_elements
        ):
            return math.nan
        return math.log(first.error / last.error) / math.log(last.n_elements / first.n_elements)

    @property
    def is_met(self) -> bool:
        """Whether all errors are within their bounds, and fall as fast as they must."""
        if not self.records or not all(error <= bound for error, bound in zip(self.errors, self.bounds, strict=True)):
            return False
        return self.quantity.order is None or math.isnan(self.order) or self.order >= self.quantity.order

    def as_dict(self) -> dict[str, object]:
        """Return the row under the names of the JSON output; ``None`` for numbers that do not exist."""
        return {
            "case": self.name,
            "title": self.case.title,
            "quantity": self.quantity.name,
            "source": self.case.source,
            "validity": self.case.validity,
            "expected": self.quantity.expected,
            "resolutions": [record.resolution for record in self.records],
            "n_elements": [record.n_elements for record in self.records],
            "values": [record.value for record in self.records],
            "errors": list(self.errors),
            "bounds": list(self.bounds),
            "order": self.order,
            "least_order": self.quantity.order,
            "met": self.is_met,
            "message": next((record.message for record in self.records if record.message), ""),
        }


@dataclass(frozen=True)
class Verification:
    """The outcome: `is_met` if all of it is."""

    rows: tuple[VerifiedRow, ...]

    @property
    def missed(self) -> tuple[VerifiedRow, ...]:
        """The rows that are not met."""
        return tuple(row for row in self.rows if not row.is_met)

    @property
    def is_met(self) -> bool:
        """Whether all rows are met."""
        return not self.missed

    def to_json(self) -> str:
        """Return everything as JSON; numbers that do not exist are null."""
        content = {"met": self.is_met, "rows": [row.as_dict() for row in self.rows]}
        return json_text(content)


def rows_of(cases: dict[str, Case], records: Sequence[VerificationRecord]) -> tuple[VerifiedRow, ...]:
    """Return the rows of some cases, in their order."""
    by_key = {record.key: record for record in records}

    def of(name: str, case: Case, quantity: Quantity) -> VerifiedRow:
        keys = ((name, quantity.name, resolution) for resolution in case.resolutions)
        return VerifiedRow(name, case, quantity, tuple(by_key[key] for key in keys if key in by_key))

    return tuple(of(name, case, quantity) for name, case in cases.items() for quantity in case.quantities)
