"""Records of a verification: one for each quantity at each resolution, their file, and their rows."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping
from dataclasses import dataclass

from bemkit.studies.row_file import RowFile
from bemkit.studies.verification.case import Case, Quantity
from bemkit.table import Column, Table, column, columns_of, json_text, markdown_table


@dataclass(frozen=True)
class VerificationRecord:
    """One quantity at one resolution."""

    case: str = column("name of the case")
    quantity: str = column("compared quantity")
    resolution: float = column("requested number of elements, or accuracy", format="g")
    n_elements: int = column("number of elements")
    value: float = column("computed value", format=".6g")
    error: float = column("its error; infinite without a certified solution", format=".1e")
    seconds: float = column("run time of the solve, which all quantities of a case share", "s", ".2f")
    message: str = column("why there is no solution")

    @property
    def key(self) -> tuple[str, str, float]:
        """Key of a record in its verification."""
        return self.case, self.quantity, self.resolution


HEAD = ("case", "quantity", "source", "expected", "errors", "order", "bound")
ROUND_OFF = 1e-12
"""Errors below it fall no further."""
FILE = RowFile("bemkit-verification 2", VerificationRecord, ("version",))


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
        """Whether all errors are within their bounds and fall at the required order."""
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

    def as_table(self) -> Table:
        """Return a row for each quantity at each resolution, with its bound."""
        heads = (*columns_of(VerificationRecord), Column("bound", "", "largest error allowed", ".1e"))
        rows = [
            (*(getattr(record, head.name) for head in heads[:-1]), bound)
            for row in self.rows
            for record, bound in zip(row.records, row.bounds, strict=True)
        ]
        return Table(heads, tuple(rows))

    def to_markdown(self) -> str:
        """Return the table of all rows, and below it the validity of each case."""
        cells = [(*cells_of(row), "yes" if row.is_met else "**no**") for row in self.rows]
        cases = {row.name: row.case for row in self.rows}
        about = [(name, case.title, case.validity) for name, case in cases.items()]
        table = markdown_table((*HEAD, "met"), cells, [False] * (len(HEAD) + 1))
        return table + "\n" + markdown_table(("case", "problem", "holds for"), about, [False] * 3)

    def to_json(self) -> str:
        """Return everything as JSON; numbers that do not exist are null."""
        content = {"met": self.is_met, "rows": [row.as_dict() for row in self.rows]}
        return json_text(content)


def rows_of(cases: dict[str, Case], records: Mapping[Hashable, VerificationRecord]) -> tuple[VerifiedRow, ...]:
    """Return the rows of some cases, in their order, of records by their keys."""

    def of(name: str, case: Case, quantity: Quantity) -> VerifiedRow:
        keys = ((name, quantity.name, resolution) for resolution in case.resolutions)
        return VerifiedRow(name, case, quantity, tuple(records[key] for key in keys if key in records))

    return tuple(of(name, case, quantity) for name, case in cases.items() for quantity in case.quantities)


def cells_of(row: VerifiedRow) -> tuple[str, ...]:
    """Return the entries of a row as short texts; see `HEAD`."""
    expected = f"{row.quantity.expected:.6g}" if row.quantity.expected else "-"
    errors = " ".join(f"{error:.1e}" for error in row.errors)
    order = "-" if math.isnan(row.order) or row.order < 0.0 else f"{row.order:.1f}"
    return row.name, row.quantity.name, row.case.source, expected, errors, order, f"{row.bounds[-1]:.1e}"
