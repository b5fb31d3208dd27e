"""Abscissa of pictures along a contact: x from left to right along horizontal lines, else the arc length."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.pictures.drawing import Axes
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import UnitNames, with_unit

Number = TypeVar("Number", float, FloatArray)


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
    def along(cls, solution: Solution, part: str) -> Abscissa:
        """Return that of a contact part, or of a contact of several bodies."""
        table, rows = solution.contact, solution.contact.rows(part)
        sign = table.direction(part)
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

    def write_below(self, axes: Axes, units: UnitNames | None) -> None:
        """Write the label below axes; a dollar sign in the name of a part begins no formula."""
        label = self.label(units)
        axes.set_xlabel(label, parse_math=label.count("$") == 2)
