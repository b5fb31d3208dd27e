"""A problem with a known answer, and what of it is compared."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from bemkit.errors import InputError
from bemkit.reference import Reference, answer_of, errors_of
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.scene.assembly import Assembly
from bemkit.scene.scene import Scene
from bemkit.scene.toml import with_overrides


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
    measure: Callable[[Any], float]
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
    solve : callable (resolution) -> Solution or AssemblySolution
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
    solve: Callable[[float], Solution | AssemblySolution]
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


def at_resolution(scene: Scene | Assembly) -> Callable[[float], Solution | AssemblySolution]:
    """Return what solves a scene with a number of elements, or to an accuracy."""

    def solve(resolution: float) -> Solution | AssemblySolution:
        if resolution < 1.0:
            return run(with_overrides(scene, accuracy=resolution))
        return run(with_overrides(scene, elements=int(resolution)))

    return solve


def field_errors(reference: Reference, **bounds: tuple[float, ...]) -> tuple[Quantity, ...]:
    """Return rows that compare with a reference, by the names of `bemkit.reference.MEASURES`, with their bounds."""

    def of(name: str) -> Callable[[Solution], float]:
        return lambda solution: errors_of(answer_of(solution, reference.places), reference)[name]

    words = {"sigma_n": "normal traction, L2", "sigma_t": "shear traction, L2", "displacement": "displacement, L2"}
    return tuple(Quantity(words.get(name, name), of(name), each) for name, each in bounds.items())
