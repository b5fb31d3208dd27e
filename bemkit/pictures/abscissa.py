"""Abscissa of pictures along a contact: x from left to right along horizontal lines, else the arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.pictures.shown import Result
from bemkit.results.contact_table import ContactTable
from bemkit.scene.unit_names import UnitNames, with_unit

Number = TypeVar("Number", float, FloatArray)
_STRAIGHT = 1e-9
"""Distance of nodes from a horizontal line, by the length of the contact, that is round-off."""


@dataclass(frozen=True)
class Abscissa:
    """A coordinate along a contact.

    Parameters
    ----------
    name : str
        With its symbol.
    start : float [m]
        Value at the start of the part.
    sign : float
        -1 where the boundary runs to the left, so that slip and friction along it are negative along x; else 1.
    """

    name: str
    start: float = 0.0
    sign: float = 1.0

    @classmethod
    def along(cls, solution: Result, part: str) -> Abscissa:
        """Return that of a contact part, or of a contact of several bodies."""
        table, rows = solution.contact, solution.contact.rows(part)
        sign = _direction(table, part)
        if sign == 0.0:
            return cls(f"arc length $s$ along '{part}'")
        first = int(np.flatnonzero(rows)[0])
        return cls(f"$x$ along '{part}'", float(table.x[first] - sign * table.s[first]), sign)

    def at(self, s: Number) -> Number:
        """Return the coordinate [m] of arc lengths [m]."""
        return self.start + self.sign * s

    def label(self, units: UnitNames | None) -> str:
        """Return the name with its unit."""
        return with_unit(self.name, "length", units)


def common_direction(table: ContactTable) -> float:
    """Return 1 or -1 if all contacts run to the right or to the left along horizontal lines, 0 otherwise."""
    directions = {_direction(table, part) for part in table.parts}
    return directions.pop() if len(directions) == 1 else 0.0


def _direction(table: ContactTable, part: str) -> float:
    """Return 1 if a part runs to the right along a horizontal line, -1 to the left, 0 otherwise."""
    rows = table.rows(part)
    x, y, s = table.x[rows], table.y[rows], table.s[rows]
    if x.size < 2:
        return 0.0
    tolerance = _STRAIGHT * max(float(np.ptp(s)), float(np.abs(x).max()), float(np.abs(y).max()))
    sign = float(np.sign((x[-1] - x[0]) * (s[-1] - s[0])))
    is_straight = np.ptp(y) <= tolerance and np.abs(x - x[0] - sign * (s - s[0])).max() <= tolerance
    return sign if is_straight else 0.0
