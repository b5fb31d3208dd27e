"""A problem with a known answer, what of it is compared, and all such problems.

Their scenes and the bounds of errors are in `cases/*.toml`. Of each case there are

* ``source``: key of ``docs/references.md``;
* ``validity``, ``resolutions``, ``n_quick``, ``title``: see `Case`; by default the title is that of the scene;
* ``scene``: a table like a scene file, or the name of a shipped scene, with elements of the ``degree``, if it is given;
* ``bounds``, ``orders``: of each row, by the names of `bemkit.studies.verification.measures`; see `Quantity`.
"""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from importlib import resources
from types import MappingProxyType
from typing import Any

from bemkit.errors import InputError
from bemkit.scene.toml import load_scene, scene_from_table
from bemkit.studies.verification.measures import ROWS, Measure, of_shipped
from bemkit.studies.verification.solves import SOLVES, Solve, at_resolution

_FILES = ("elastic", "obstacles", "pairs", "half_planes")


@dataclass(frozen=True)
class Quantity:
    """A row of the table.

    Parameters
    ----------
    name : str
    measure : callable (solution) -> float
        What came out.
    bounds : tuple of float
        Of the error at each resolution of the case: about twice what is measured.
    expected : float
        What should have come out; errors are relative to it. Zero if `measure` returns a relative error itself.
    order : float, optional
        By which power of the number of elements the error falls at least, from the coarsest to the finest resolution.
        None where it does not fall steadily: at round-off, and at places where the contact status changes.
    """

    name: str
    measure: Measure
    bounds: tuple[float, ...]
    expected: float = 0.0
    order: float | None = None

    def error(self, value: float) -> float:
        """Return the relative error of a value."""
        return abs(value - self.expected) / (abs(self.expected) or 1.0)


@dataclass(frozen=True)
class Case:
    """A problem with a known answer.

    Parameters
    ----------
    title : str
    source : str
        Key of ``docs/references.md``.
    validity : str
        Under which assumptions the answer holds, and what they cost where the scene meets them only nearly.
    solve : callable (resolution) -> Solution
    resolutions : tuple of float
        Two or three, from coarse to fine: numbers of elements, or accuracies (less than one).
    quantities : tuple of Quantity
    n_quick : int
        How many of the resolutions, the coarsest ones, a quick verification takes.

    Raises
    ------
    InputError
        If a quantity has not one bound for each resolution.
    """

    title: str
    source: str
    validity: str
    solve: Solve
    resolutions: tuple[float, ...]
    quantities: tuple[Quantity, ...]
    n_quick: int = 2

    def __post_init__(self) -> None:
        for quantity in self.quantities:
            if len(quantity.bounds) != len(self.resolutions):
                raise InputError(
                    f"{quantity.name!r} has {len(quantity.bounds)} bounds for {len(self.resolutions)} resolutions: "
                    "give one for each"
                )


def _case(name: str, table: Mapping[str, Any]) -> Case:
    """Make the case of a table in a file."""
    given, orders = table["scene"], table.get("orders", {})
    scene = load_scene(given) if isinstance(given, str) else scene_from_table(given)
    rows = ROWS[name]() if name in ROWS else of_shipped(given)
    quantities = tuple(
        Quantity(row, rows[row][0], tuple(bounds), rows[row][1], orders.get(row))
        for row, bounds in table["bounds"].items()
    )
    return Case(
        title=table.get("title", scene.title),
        source=table["source"],
        validity=table["validity"],
        solve=SOLVES[name](scene) if name in SOLVES else at_resolution(scene, table.get("degree")),
        resolutions=tuple(table["resolutions"]),
        quantities=quantities,
        n_quick=table.get("n_quick", 2),
    )


def _cases() -> dict[str, Callable[[], Case]]:
    folder = resources.files("bemkit") / "studies" / "verification" / "cases"
    tables = [tomllib.loads((folder / f"{name}.toml").read_text("utf-8")) for name in _FILES]
    return {name: partial(_case, name, case) for table in tables for name, case in table.items()}


CASES: Mapping[str, Callable[[], Case]] = MappingProxyType(_cases())
"""The problems, by name, each made when it is needed."""
