"""Copies of a body: one shape and one set of conditions in many places."""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import Protocol

from bemkit.errors import InputError
from bemkit.geometry.curves import as_point
from bemkit.geometry.placement import Placement

MOST_COPIES = 100_000


class Copies(Protocol):
    """A rule for the places of copies; a frozen dataclass."""

    def placements(self) -> dict[str, Placement]:
        """Return the placement of each copy, by the suffix of its name."""
        ...


@dataclass(frozen=True)
class GridCopies:
    """Copies in columns and rows; the first one is the body itself.

    Parameters
    ----------
    columns, rows : int
    step : (float, float) [m]
        From one column to the next, and from one row to the next.

    Raises
    ------
    InputError
        If there are no copies or more than 100 000, or a step is not finite.
    """

    columns: int = 1
    rows: int = 1
    step: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _check_count("columns", self.columns)
        _check_count("rows", self.rows)
        _check_count("columns times rows", self.columns * self.rows)
        object.__setattr__(self, "step", as_point(self.step, "GridCopies: step"))

    def placements(self) -> dict[str, Placement]:
        """Return the places as ``column-row``, both from 1."""
        x, y = self.step
        return {f"{i + 1}-{k + 1}": Placement((i * x, k * y)) for k in range(self.rows) for i in range(self.columns)}


@dataclass(frozen=True)
class CircleCopies:
    """Copies turned about a centre, each by one angle further; the first one is the body itself.

    Parameters
    ----------
    count : int
    angle : float [degree]
        From one copy to the next, anticlockwise.
    centre : (float, float) [m]

    Raises
    ------
    InputError
        If there are no copies or more than 100 000.
    """

    count: int
    angle: float
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        _check_count("count", self.count)
        object.__setattr__(self, "centre", as_point(self.centre, "CircleCopies: centre"))

    def placements(self) -> dict[str, Placement]:
        """Return the places by their number, from 1."""
        x, y = self.centre
        to_centre = Placement((-x, -y))
        return {
            str(k + 1): Placement((x, y)).after(Placement(turn=k * self.angle).after(to_centre))
            for k in range(self.count)
        }


@dataclass(frozen=True)
class ListedCopies:
    """Copies at given positions.

    Parameters
    ----------
    places : tuple of Placement
        Each moves the body from its placement.

    Raises
    ------
    InputError
        If there are none.
    """

    places: tuple[Placement, ...]

    def __post_init__(self) -> None:
        _check_count("the number of places", len(self.places))

    def placements(self) -> dict[str, Placement]:
        """Return the places by their number, from 1."""
        return {str(number): place for number, place in enumerate(self.places, start=1)}


def _check_count(name: str, count: int) -> None:
    if not isinstance(count, Integral) or not 1 <= count <= MOST_COPIES:
        raise InputError(f"{name} is {count}: give a whole number from 1 to {MOST_COPIES}")
