"""The words and numbers of ``bemkit study errors``, turned into runs and a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

from bemkit.formulas import closest
from bemkit.plan.plan import make_plan
from bemkit.reference.compare import MEASURES, Reference, over_resolved
from bemkit.reference.shipped import find_reference
from bemkit.scene.discretisation import Discretisation, Galerkin, MeshOptions
from bemkit.scene.registry import RISING
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.scene.toml import scene_to_toml
from bemkit.solvers.base import ContactSolver
from bemkit.studies.accuracy.runs import MeshSequence, Run, adaptive, all_runs, graded, uniform
from bemkit.studies.engine import StudyError

Number = TypeVar("Number", int, float)

DEFAULT_ELEMENTS = "constant,linear,quadratic"
SUGGESTED = 600
"""Number of elements of an over-resolved solution: its error is small compared with those of the default meshes."""
_MESHES_TOGETHER = 1.3
"""Time of all adaptive meshes, relative to the last one, which has at most 2.5 times as many elements as the one
before."""


@dataclass(frozen=True)
class StudyOptions:
    """Options of an error study; lists are names and numbers with commas between them.

    The exponent is that of graded meshes, the most elements are those of adaptive ones. The reference is a fine
    solution if its number of elements is given; no run times are measured without a number of repetitions.
    """

    sizes: str
    accuracies: str
    discretisations: str | None
    degrees: str | None
    meshes: str
    solvers: str
    exponent: float
    most_elements: int
    over_resolve: int | None
    repeat: int | None

    def runs(self, scene: Scene) -> tuple[Run, ...]:
        """Return all combinations for a scene.

        Raises
        ------
        StudyError, SceneError, InputError
            If a word is unknown, a number out of range, or a list empty.
        """
        elements = tuple(sorted(_numbers(self.sizes, "sizes", int, "40,80")))
        accuracies = tuple(sorted(_numbers(self.accuracies, "accuracies", float, "1e-2,1e-3"), reverse=True))
        sequences: dict[str, MeshSequence] = {
            "uniform": uniform(elements),
            "graded": graded(elements, self.exponent),
            "adaptive": adaptive(accuracies, self.most_elements),
        }
        solvers = _words(self.solvers, "solvers")
        return all_runs(
            scene,
            self._element_types(),
            [sequences[word] for word in _known(self.meshes, "meshes", sequences)],
            # the scene's own solver, with its options, if it has that word
            [scene.solver if type(each) is type(scene.solver) else each for each in map(_solver, solvers)],
        )

    def _element_types(self) -> list[Discretisation | str]:
        if self.degrees is None:
            words = _words(self.discretisations or DEFAULT_ELEMENTS, "discretisations")
            return [word if word == RISING else structure(word, cast(Any, Discretisation)) for word in words]
        if self.discretisations is not None:
            raise StudyError(f"degrees is {self.degrees!r} and discretisations is {self.discretisations!r}: give one")
        words = _words(self.degrees, "degrees")
        return [word if word == RISING else Galerkin(_numbers(word, "degrees", int, "1,2,4,8,hp")[0]) for word in words]

    def labels(self, scene: Scene) -> dict[str, str]:
        """Return the options that must be the same to reuse records of an earlier study."""
        fine = self.over_resolve
        return {
            "scene": scene_to_toml(scene),
            "reference": "known" if fine is None else f"over-resolved by {fine} elements",
            "grading": f"exponent {self.exponent:g}",
            "budget": f"{self.most_elements} elements",
            "repetitions": "none" if self.repeat is None else str(self.repeat),
        }

    def reference(self, scene: Scene) -> Reference:
        """Return the reference for the errors; over-resolved only on request.

        Raises
        ------
        StudyError
            If the scene has no reference; the message gives the cost of an over-resolved solution.
        """
        if self.over_resolve is not None:
            return over_resolved(scene, self.over_resolve)
        found = find_reference(scene)
        if found is not None:
            return found
        options = MeshOptions(elements=SUGGESTED, density=scene.mesh.density)
        fine = replace(scene, discretisation=Galerkin(2), mesh=options)
        plan = make_plan(fine, fine.build_mesh())
        cost = f"about {_MESHES_TOGETHER * plan.seconds:.1g} s and {plan.memory / 1e9:.1g} GB"
        raise StudyError(
            "no closed form or reference solution belongs to this scene: add --over-resolve "
            f"{SUGGESTED} to measure against a fine solution ({SUGGESTED} elements, {cost})"
        )


def read_measures(text: str) -> tuple[str, ...]:
    """Return the names of errors, which must be known."""
    return _known(text, "errors", MEASURES)


def _solver(word: str) -> ContactSolver:
    solver: ContactSolver = structure(word, cast(Any, ContactSolver))
    return solver


def _words(text: str, option: str) -> tuple[str, ...]:
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise StudyError(f"{option} is {text!r}: give at least one, with commas between several")
    return words


def _known(text: str, option: str, known: Iterable[str]) -> tuple[str, ...]:
    words, names = _words(text, option), list(known)
    for word in words:
        if word not in names:
            raise StudyError(f"{option}: unknown {word!r}: the known ones are {', '.join(names)}{closest(word, names)}")
    return words


def _numbers(text: str, option: str, kind: Callable[[str], Number], example: str) -> tuple[Number, ...]:
    words = _words(text, option)
    try:
        return tuple(kind(word) for word in words)
    except ValueError as error:
        raise StudyError(f"{option} is {text!r}: give numbers with commas between them, such as {example}") from error
