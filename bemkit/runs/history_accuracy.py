"""Meshes for all steps of a load history: they follow a solution that has the largest errors of all steps."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from dataclasses import dataclass, field
from typing import Generic, TypeVar

import numpy as np

from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.solution import Solution
from bemkit.runs.refinement import AnyLevel, Refinement
from bemkit.runs.steps import History, joined

AnySolution = TypeVar("AnySolution", Solution, AssemblySolution)


@dataclass(frozen=True)
class HistoryRefinement(Generic[AnyLevel, AnySolution]):
    """A refinement of single loads, made one of load histories, whose memory belongs to one mesh.

    Parameters
    ----------
    single : Refinement
    solve : callable
        Level -> the history and its steps, from the first one on.
    """

    single: Refinement[AnyLevel, AnySolution]
    solve: Callable[[AnyLevel], tuple[History[AnySolution], tuple[AnySolution, ...]]]
    guides: dict[int, AnySolution] = field(default_factory=dict, init=False)
    """By the identity of the last step on a mesh, what the next mesh follows."""

    def solved(self, level: AnyLevel, start: AnySolution | None) -> AnySolution:
        """Solve all steps."""
        history, steps = self.solve(level)
        solution = joined(history, steps)
        self.guides[id(solution)] = worst_of(steps)
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

    The step with the largest energy measures all errors, so that those of an unloaded body are not measured by nothing.
    """
    unit = max(step.error_unit for step in steps)
    errors = [[body.element_errors for body in _bodies(step)] for step in steps]
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
    for body, own in zip(_bodies(worst), largest, strict=True):
        vars(body)["element_errors"] = own * share
    vars(worst)["estimated_error"] = float(np.sqrt(sum(float(own.sum()) for own in largest) / unit))
    return worst


def _bodies(solution: Solution | AssemblySolution) -> list[Solution | BodyResult]:
    return [solution] if isinstance(solution, Solution) else list(solution.bodies.values())
