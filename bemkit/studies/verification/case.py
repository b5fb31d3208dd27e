"""A problem with a known solution: its scene, how it is solved, and which quantities are compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeAlias

from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.scene import Scene
from bemkit.scene.toml import with_overrides

Measure: TypeAlias = Callable[[Solution], float]
Solve: TypeAlias = Callable[[Scene, float], Solution]


def at_resolution(scene: Scene, resolution: float) -> Solution:
    """Solve a scene with a number of elements, or to an accuracy, which is less than one."""
    if resolution < 1.0:
        return run(with_overrides(scene, accuracy=resolution))
    return run(with_overrides(scene, elements=int(resolution)))


@dataclass(frozen=True)
class Quantity:
    """A row of the table.

    Parameters
    ----------
    name : str
    measure : callable (solution) -> float
    bounds : tuple of float
        Of the error at each resolution of the case: about twice what was measured when the case was written.
    expected : float
        The exact value; errors are relative to it. Zero if `measure` returns a relative error itself.
    order : float, optional
        Least power of the number of elements by which the error falls from the coarsest to the finest resolution.
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
    """A problem with a known solution; see `bemkit.studies.verification.cases`.

    Parameters
    ----------
    scene : Scene
    source : str
        Key of ``docs/references.md``.
    validity : str
        Assumptions of the known solution, and their cost where the scene meets them only nearly.
    resolutions : tuple of float
        Two or three, from coarse to fine: numbers of elements, or accuracies (less than one).
    quantities : tuple of Quantity
    solve : callable (scene, resolution) -> Solution
    n_quick : int
        Number of resolutions, the coarsest ones, in a quick verification.

    Raises
    ------
    InputError
        If a quantity has not one bound for each resolution.
    """

    scene: Scene
    source: str
    validity: str
    resolutions: tuple[float, ...]
    quantities: tuple[Quantity, ...]
    solve: Solve = at_resolution
    n_quick: int = 2

    def __post_init__(self) -> None:
        for quantity in self.quantities:
            if len(quantity.bounds) != len(self.resolutions):
                raise InputError(
                    f"{quantity.name!r} has {len(quantity.bounds)} bounds for {len(self.resolutions)} resolutions: "
                    "give one for each"
                )

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self.scene.title
