"""Rows of a stability sweep: their file, their table and their Markdown."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum

from bemkit.studies.row_file import RowFile
from bemkit.studies.stability.axes import Axis
from bemkit.table import Table, column, markdown_table


class Verdict(Enum):
    """Verdict on a record."""

    RIGHT = "right"
    """Converged; the independent check and the scaled copy agree, and the reference where it applies."""
    COARSE = "coarse"
    """The same, on a mesh too coarse for tractions and displacements to agree."""
    AMBIGUOUS = "ambiguous"
    """The case and its scaled copy differ, and both pass the independent check: the problem has several solutions."""
    NAMED = "named"
    """No solution: a named status or error, the same for the scaled copy."""
    WRONG = "wrong"
    """Converged to a solution that a check contradicts, refused although solvable, or different from the scaled
    copy."""


@dataclass(frozen=True)
class StabilityRecord:
    """One row of a stability sweep."""

    axis: str = column("what is varied")
    value: float = column("its value", format=".8g")
    verdict: str = column("value of `Verdict`")
    status: str = column("status of the solver in small letters, or refused")
    linear_solves: int = column("number of linear solves")
    certificate: float = column("largest entry of the solver's certificate", format=".0e")
    check: float = column("largest entry of the independent check", format=".0e")
    reciprocity: float = column("error of Betti's theorem, up to the discretisation error", format=".0e")
    condition: float = column("condition of the contact stiffness with unit diagonal", format=".0e")
    deviation: float = column("largest difference from the reference, scaled back", format=".0e")
    scaled_copy: float = column("largest difference from the scaled copy", format=".0e")
    seconds: float = column("run time", "s", ".2f")
    message: str = column("of the solver or the error, or why the row is wrong")

    @property
    def key(self) -> tuple[str, float]:
        """Key of a record in its sweep."""
        return self.axis, self.value


FILE = RowFile("bemkit-stability 3", StabilityRecord, ("scene",))
_HEADS = ("verdict", "status", "solves", "certificate", "check", "Betti", "condition", "deviation", "copy")


def table_of(records: Sequence[StabilityRecord]) -> Table:
    """Return the records as a table."""
    return Table.from_records(StabilityRecord, records)


def to_markdown(axes: Sequence[Axis], records: Sequence[StabilityRecord]) -> str:
    """Return one Markdown table for each axis, without run times, so that equal results make equal text."""
    texts = []
    for axis in axes:
        rows = [cells(record) for record in records if record.axis == axis.name]
        table = markdown_table((axis.label, *_HEADS), rows, [True, False, False, *(True,) * (len(_HEADS) - 2)])
        texts.append(f"### {axis.name}\n\nPromise: {axis.promise}.\n\n{table}")
    return "\n".join(texts)


def cells(record: StabilityRecord) -> list[str]:
    """Return the entries of a record as short texts: value, verdict, status, linear solves, then the numbers."""
    row = dict(zip(StabilityRecord.__dataclass_fields__, table_of([record]).cells()[0], strict=True))
    solves = row["linear_solves"] if record.linear_solves else ""
    numbers = (row[name] for name in ("certificate", "check", "reciprocity", "condition", "deviation", "scaled_copy"))
    return [row["value"], record.verdict, record.status.replace("_", " "), solves, *numbers]
