"""The words and numbers of ``bemkit study errors``, turned into runs."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, TypeVar, cast

from bemkit.formulas import closest
from bemkit.reference.compare import over_resolved
from bemkit.reference.shipped import find_reference
from bemkit.reference.values import MEASURES, Reference
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.scene.toml import load_scene, scene_to_toml, with_overrides
from bemkit.solvers.base import ContactSolver
from bemkit.studies.accuracy.cost import SUGGESTED, over_resolution_cost
from bemkit.studies.accuracy.runs import AdaptiveMeshes, MeshSequence, Run, StudyError, all_runs, graded, uniform

Number = TypeVar("Number", int, float)

DEFAULT_MEASURES = "energy,sigma_n,displacement,transitions"


@dataclass(frozen=True)
class Lists:
    """What is combined, as words and numbers with commas between them.

    Parameters
    ----------
    elements, accuracies, discretisation, meshes, solver : str
    """

    elements: str
    accuracies: str
    discretisation: str
    meshes: str
    solver: str


@dataclass(frozen=True)
class Wishes:
    """A study that can begin.

    Parameters
    ----------
    scene : Scene
    runs : tuple of Run
    labels : mapping of str to str
        What must be the same when rows of an earlier study are taken over.
    over_resolve : int or None
        Elements of the over-resolved solution, if that is the reference.
    repeat : int or None
        Timed repetitions, None if no times are measured.
    """

    scene: Scene
    runs: tuple[Run, ...]
    labels: dict[str, str]
    over_resolve: int | None
    repeat: int | None

    def reference(self) -> Reference:
        """Return the reference, which is over-resolved only if that is wished.

        Raises
        ------
        StudyError
            If nothing else is known; the message says what an over-resolved solution costs.
        """
        if self.over_resolve is not None:
            return over_resolved(self.scene, self.over_resolve)
        found = find_reference(self.scene)
        if found is None:
            cost = over_resolution_cost(self.scene)
            raise StudyError(
                "no closed form or reference solution belongs to this scene: add --over-resolve "
                f"{SUGGESTED} to measure against a fine solution ({cost})"
            )
        return found


def read_wishes(
    source: str, lists: Lists, *, exponent: float, most_elements: int, over_resolve: int | None, repeat: int | None
) -> Wishes:
    """Turn words and numbers into runs.

    Parameters
    ----------
    source : str
        Scene file or name of a shipped scene.
    lists : Lists
    exponent : float
        Of graded meshes.
    most_elements : int
        Limit of adaptive meshes.
    over_resolve : int, optional
    repeat : int, optional
        None if no times are measured.

    Returns
    -------
    Wishes

    Raises
    ------
    StudyError, SceneError, ValueError
        If a word is unknown, a number out of range, or a list empty.
    """
    scene = load_scene(source)
    elements = tuple(sorted(_numbers(lists.elements, "elements", int, "40,80")))
    accuracies = tuple(sorted(_numbers(lists.accuracies, "accuracies", float, "1e-2,1e-3"), reverse=True))
    sequences: dict[str, MeshSequence] = {
        "uniform": uniform(elements),
        "graded": graded(elements, exponent),
        "adaptive": AdaptiveMeshes(accuracies, most_elements),
    }
    words = _words(lists.discretisation, "discretisation")
    runs = all_runs(
        scene,
        [with_overrides(scene, discretisation=word).discretisation for word in words],
        [sequences[word] for word in _known(_words(lists.meshes, "meshes"), sequences, "meshes")],
        [_solver(scene, word) for word in _words(lists.solver, "solver")],
    )
    labels = {
        "scene": scene_to_toml(scene),
        "reference": "known" if over_resolve is None else f"over-resolved by {over_resolve} elements",
        "grading": f"exponent {exponent:g}",
        "budget": f"{most_elements} elements",
        "repetitions": "none" if repeat is None else str(repeat),
    }
    return Wishes(scene, runs, labels, over_resolve, repeat)


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
    try:
        return tuple(kind(word) for word in _words(text, option))
    except ValueError as error:
        if isinstance(error, StudyError):
            raise
        raise StudyError(f"{option} is {text!r}: give numbers with commas between them, such as {example}") from error
