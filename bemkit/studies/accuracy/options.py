"""The words and numbers of ``bemkit study errors``, turned into runs and a reference."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from typing import Any, TypeVar, cast

from bemkit.formulas import closest
from bemkit.plan import make_plan
from bemkit.reference.compare import over_resolved
from bemkit.reference.shipped import find_reference
from bemkit.reference.values import MEASURES, Reference
from bemkit.scene.discretisation import QuadraticGalerkin
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.scene.toml import scene_to_toml, with_overrides
from bemkit.solvers.base import ContactSolver
from bemkit.studies.accuracy.runs import AdaptiveMeshes, MeshSequence, Run, all_runs, graded, uniform
from bemkit.studies.engine import StudyError

Number = TypeVar("Number", int, float)

DEFAULT_MEASURES = "energy,sigma_n,displacement,transitions"
SUGGESTED = 600
"""Elements of an over-resolved solution whose error is small against that of the default meshes."""
_MESHES_TOGETHER = 1.3
"""Time of all adaptive meshes over that of the last one, which is at most 2.5 times as large as the one before."""


@dataclass(frozen=True)
class StudyOptions:
    """What is asked of an error study; lists are words and numbers with commas between them.

    Parameters
    ----------
    elements, accuracies, discretisation, meshes, solver : str
        What is combined.
    exponent : float
        Of graded meshes.
    most_elements : int
        Limit of adaptive meshes.
    over_resolve : int or None
        Elements of the over-resolved solution, if that is to be the reference.
    repeat : int or None
        Timed repetitions, None if no times are measured.
    """

    elements: str
    accuracies: str
    discretisation: str
    meshes: str
    solver: str
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
        elements = tuple(sorted(_numbers(self.elements, "elements", int, "40,80")))
        accuracies = tuple(sorted(_numbers(self.accuracies, "accuracies", float, "1e-2,1e-3"), reverse=True))
        sequences: dict[str, MeshSequence] = {
            "uniform": uniform(elements),
            "graded": graded(elements, self.exponent),
            "adaptive": AdaptiveMeshes(accuracies, self.most_elements),
        }
        words = _words(self.discretisation, "discretisation")
        return all_runs(
            scene,
            [with_overrides(scene, discretisation=word).discretisation for word in words],
            [sequences[word] for word in _known(_words(self.meshes, "meshes"), sequences, "meshes")],
            [_solver(scene, word) for word in _words(self.solver, "solver")],
        )

    def labels(self, scene: Scene) -> dict[str, str]:
        """Return what must be the same when records of an earlier study are taken over."""
        fine = self.over_resolve
        return {
            "scene": scene_to_toml(scene),
            "reference": "known" if fine is None else f"over-resolved by {fine} elements",
            "grading": f"exponent {self.exponent:g}",
            "budget": f"{self.most_elements} elements",
            "repetitions": "none" if self.repeat is None else str(self.repeat),
        }

    def reference(self, scene: Scene) -> Reference:
        """Return what errors are measured against; it is over-resolved only if that was asked for.

        Raises
        ------
        StudyError
            If nothing else is known; the message says what an over-resolved solution costs.
        """
        if self.over_resolve is not None:
            return over_resolved(scene, self.over_resolve)
        found = find_reference(scene)
        if found is None:
            raise StudyError(
                "no closed form or reference solution belongs to this scene: add --over-resolve "
                f"{SUGGESTED} to measure against a fine solution ({over_resolution_cost(scene)})"
            )
        return found


def over_resolution_cost(scene: Scene, n_elements: int = SUGGESTED) -> str:
    """Say what `bemkit.reference.over_resolved` takes, from the plan of its last mesh."""
    options = MeshOptions(elements=n_elements, density=scene.mesh.density)
    fine = replace(scene, discretisation=QuadraticGalerkin(), mesh=options)
    plan = make_plan(fine, fine.build_mesh())
    seconds = _MESHES_TOGETHER * plan.seconds
    return f"{n_elements} elements, about {seconds:.1g} s and {plan.memory / 1e9:.1g} GB"


def read_measures(text: str) -> tuple[str, ...]:
    """Return the names of errors, which must be known."""
    return _known(_words(text, "errors"), MEASURES, "errors")


def _solver(scene: Scene, word: str) -> ContactSolver:
    """Return the driver of a word: the scene's own, with its options, if it has that word."""
    chosen: ContactSolver = structure(word, cast(Any, ContactSolver))
    return scene.solver if type(chosen) is type(scene.solver) else chosen


def _words(text: str, option: str) -> tuple[str, ...]:
    words = tuple(word.strip() for word in text.split(",") if word.strip())
    if not words:
        raise StudyError(f"{option} is {text!r}: give at least one, with commas between several")
    return words


def _known(words: tuple[str, ...], known: Iterable[str], option: str) -> tuple[str, ...]:
    names = list(known)
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
