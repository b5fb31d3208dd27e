"""Meshes for all steps of a load history: they follow a solution that has the largest errors of all steps."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.refinement import AnyLevel, Refinement
from bemkit.runs.steps import History, joined

AnySolution = TypeVar("AnySolution", Solution, AssemblySolution)

_SAME = 1e-9
"""Relative difference of the lengths of equal elements, in the coordinates of the shape and in those of its place."""


@dataclass
class HistoryRefinement(Generic[AnyLevel, AnySolution]):
    """A refinement of single loads, made one of load histories.

    Parameters
    ----------
    single : Refinement
    solve : callable
        Level, what is done on its mesh, who hears of finished steps -> the history, and the steps solved now.
    done : Solution or AssemblySolution, optional
        Some steps on one of the meshes, from an earlier run; meshes before that one are solved again, unheard.
    finished : callable, optional
        Receives the result of all steps so far on a mesh after each of them but the last.
    """

    single: Refinement[AnyLevel, AnySolution]
    solve: Callable[
        [AnyLevel, AnySolution | None, Callable[[AnySolution], None] | None],
        tuple[History[AnySolution], tuple[AnySolution, ...]],
    ]
    done: AnySolution | None = None
    finished: Callable[[AnySolution], None] | None = None
    guides: dict[int, AnySolution] = field(default_factory=dict, init=False)
    """By the identity of the last step on a mesh, what the next mesh follows."""

    def solved(self, level: AnyLevel, start: AnySolution | None) -> AnySolution:
        """Solve all steps that are not done."""
        done, finished = None, self.finished
        if self.done is not None and _has_meshes(self.done, level.meshes):
            done, self.done = self.done, None
        elif self.done is not None and level.n_elements < self.done.n_elements:
            finished = None
        else:
            self.done = None
        history, steps = self.solve(level, done, finished)
        solution = joined(history, steps)
        self.guides[id(solution)] = worst_of(_ends(solution) or steps)
        return solution

    def error(self, solution: AnySolution) -> float:
        """Return the largest error of a step."""
        return self.single.error(self.guides[id(solution)])

    def shown_error(self, solution: AnySolution) -> str:
        """Return it in words."""
        return f"{self.error(solution):.1e} in one of the steps"

    def is_enough(self, solutions: Sequence[AnySolution]) -> bool:
        """Tell whether all steps are accurate enough."""
        return self.single.is_enough([self.guides[id(solution)] for solution in solutions])

    def following(self, level: AnyLevel, solutions: Sequence[AnySolution]) -> AnyLevel | None:
        """Return a mesh for all steps."""
        return self.single.following(level, [self.guides[id(solution)] for solution in solutions])

    def excess(self, level: AnyLevel, most_elements: int) -> str:
        """Compare the number of elements, as for a single load."""
        return self.single.excess(level, most_elements)

    def expected_seconds(self, level: AnyLevel, solution: AnySolution, spent: float) -> float:
        """Return how long a mesh will take, as for a single load."""
        return self.single.expected_seconds(level, solution, spent)


def worst_of(steps: Sequence[AnySolution]) -> AnySolution:
    """Return the step with the largest estimated error, with the largest error of all steps on each element.

    The step with the largest energy measures all errors, so that those of an unloaded body are not measured by nothing;
    on half-planes that with the largest tractions measures those of tractions.
    """
    unit = max(step.error_unit for step in steps)
    errors = [[body.element_errors for body in step.solved_bodies] for step in steps]
    known = [[own for own in of_step if own is not None] for of_step in errors]
    if not unit > 0.0 or any(len(own) < len(all_own) for own, all_own in zip(known, errors, strict=True)):
        return steps[-1]
    totals = [sum(float(own.sum()) for own in of_step) for of_step in known]
    worst = copy(steps[int(np.argmax(totals))])
    largest = [np.max(of_body, axis=0) for of_body in zip(*known, strict=True)]
    share = worst.error_unit / unit
    if isinstance(worst, AssemblySolution):
        bodies = {name: copy(body) for name, body in worst.bodies.items()}
        object.__setattr__(worst, "bodies", bodies)
    for body, own in zip(worst.solved_bodies, largest, strict=True):
        vars(body)["element_errors"] = own * share
    vars(worst)["estimated_error"] = float(np.sqrt(sum(float(own.sum()) for own in largest) / unit))
    of_tractions = [body.mean_traction_errors for step in steps for body in step.solved_bodies]
    known_tractions = [own for own in of_tractions if own is not None]
    if isinstance(worst, Solution) and known_tractions:
        vars(worst)["mean_traction_errors"] = np.max(known_tractions, axis=0)
        vars(worst)["mean_traction_size"] = max(
            body.mean_traction_size for step in steps for body in step.solved_bodies
        )
        for name in ("estimated_traction_error", "local_traction_errors", "estimated_local_traction_error"):
            vars(worst).pop(name, None)
    return worst


def _ends(solution: AnySolution) -> list[AnySolution]:
    """Return the ends of all finished steps."""
    return [] if solution.loading is None else [step.end for step in solution.loading.steps]  # type: ignore[misc]


def _has_meshes(solution: Solution | AssemblySolution, meshes: Mapping[str, BoundaryMesh]) -> bool:
    """Tell whether a solution is one on these meshes, wherever its bodies lie."""
    own = {"": solution.mesh} if isinstance(solution, Solution) else {k: v.mesh for k, v in solution.bodies.items()}
    pairs = [(own[name].lengths, mesh.lengths) for name, mesh in meshes.items()]
    return all(one.shape == two.shape and np.allclose(one, two, rtol=_SAME, atol=0.0) for one, two in pairs)
