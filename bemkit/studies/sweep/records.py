"""Rows of a sweep, and their file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType

from bemkit.results.solution import Solution
from bemkit.scene.unit_names import QUANTITIES, UnitNames, unit_of
from bemkit.studies.engine import Attempt
from bemkit.studies.row_file import RowFile
from bemkit.table import Column, column, columns_of


@dataclass(frozen=True)
class SweepRow:
    """One scene of a sweep: the varied numbers, in the order of the keys, and the results, nan unless certified."""

    values: tuple[float, ...]
    status: str = column("status of the solver in small letters, or refused where the scene is not well posed")
    certified: int = column("1 if the result is certified")
    force_normal: float = column("sum over all contacts", "N/m", ".6g")
    force_tangential: float = column("sum over all contacts", "N/m", ".6g")
    energy: float = column("elastic energy", "J/m", ".6g")
    contact_length: float = column("of all contacts", "m", ".6g")
    peak_pressure: float = column("largest contact pressure", "Pa", ".6g")
    largest_slip: float = column("largest slip", "m", ".6g")
    estimated_error: float = column("in the energy norm; nan without an estimate", "", ".6g")
    n_elements: int = column("number of elements")
    n_contact: int = column("number of contact nodes")
    linear_solves: int = column("number of linear solves")
    seconds: float = column("run time of the row; the first row of a body includes its assembly", "s", ".6g")
    transitions: str = column("points where the status changes: status, arc length [m] and (x, y) [m] of each")
    message: str = column("why there is no result, or why an accuracy was not reached")

    def __post_init__(self) -> None:
        object.__setattr__(self, "values", tuple(self.values))

    @property
    def key(self) -> tuple[float, ...]:
        """Key of a row in its sweep."""
        return self.values

    @property
    def is_certified(self) -> bool:
        """Whether there is a certified result, even if it misses the accuracy."""
        return bool(self.certified)


_MEASURED = (
    *("force_normal", "force_tangential", "energy", "contact_length", "peak_pressure"),
    *("largest_slip", "estimated_error"),
)
NUMBERS = (*_MEASURED, "n_elements", "n_contact", "linear_solves", "seconds")
"""The numerical results of a row, in the order in which they are shown."""
COLUMNS: Mapping[str, Column] = MappingProxyType({head.name: head for head in columns_of(SweepRow)})
"""All results of a row by name."""


def unit_of_column(name: str, units: UnitNames | None) -> str:
    """Return the name of the unit of a column; empty if the scene has no name for it."""
    unit = COLUMNS[name].unit if name in COLUMNS else ""
    return unit if unit == "s" else unit_of(QUANTITIES.get(unit, ""), units)


def row_of(values: tuple[float, ...], found: Attempt) -> SweepRow:
    """Return the row of a scene that was solved, or was not."""
    solution = found.solution
    certified = solution if solution is not None and solution.is_certified else None
    return SweepRow(
        values=values,
        status=found.status,
        certified=int(certified is not None),
        n_elements=0 if solution is None else solution.n_elements,
        n_contact=0 if solution is None else solution.contact.n_contact,
        linear_solves=0 if solution is None else solution.linear_solves,
        seconds=found.seconds,
        transitions="" if certified is None else _places(certified),
        message="" if found.is_converged else found.message,
        **(dict.fromkeys(_MEASURED, math.nan) if certified is None else _numbers(certified)),
    )


def _numbers(solution: Solution) -> dict[str, float]:
    contacts, error = solution.contacts, solution.estimated_error
    return {
        "force_normal": solution.force_normal,
        "force_tangential": solution.force_tangential,
        "energy": solution.energy,
        "contact_length": sum(contact.contact_length for contact in contacts),
        "peak_pressure": max((contact.peak_pressure for contact in contacts), default=0.0),
        "largest_slip": max((contact.largest_slip for contact in contacts), default=0.0),
        "estimated_error": math.nan if error is None else error,
    }


def _places(solution: Solution) -> str:
    return "; ".join(
        f"{place.part}: {place.from_status}-{place.to_status} at {place.s:.9g} ({place.x:.9g}, {place.y:.9g})"
        for place in solution.transitions
    )


FILE = RowFile("bemkit-sweep 2", SweepRow, ("scene", "keys", "starts"))
