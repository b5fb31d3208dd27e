"""Solve on one mesh after the other until the accuracy asked for is reached; of one body or of several."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Protocol, TypeVar

from bemkit.errors import BemkitError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.results.solution import Solution
from bemkit.results.solved_steps import with_totals
from bemkit.scene.mesh_options import MOST_ELEMENTS, MeshOptions
from bemkit.solvers.base import Status

_MOST_MISSED = 12
"""Meshes whose nodes meet no contact, each of which has nodes where the one before missed it."""


class SizedLevel(Protocol):
    """The next level, in the form that a `Refinement` keeps."""

    @property
    def n_elements(self) -> int:
        """Number of elements, of all bodies."""
        ...

    @property
    def meshes(self) -> Mapping[str, BoundaryMesh]:
        """The mesh of each body by its name, which is empty if there is only one."""
        ...


AnyLevel = TypeVar("AnyLevel", bound=SizedLevel)


class Refinement(Protocol[AnyLevel]):
    """How a level is solved, judged and refined."""

    def solved(self, level: AnyLevel, start: Solution | None) -> Solution:
        """Solve a level, from the solution of the level before where that helps."""
        ...

    def error(self, solution: Solution) -> float:
        """Return the estimated error; infinite without an estimate."""
        ...

    def shown_error(self, solution: Solution) -> str:
        """Return the estimated errors in words."""
        ...

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Return whether the last of the solutions is as accurate as it shall be."""
        ...

    def following(self, level: AnyLevel, solutions: Sequence[Solution]) -> AnyLevel | None:
        """Return the next level, its meshes made; None if that would not help."""
        ...

    def excess(self, level: AnyLevel, most_elements: int) -> str:
        """Say, for a message, which number of elements a level exceeds; empty if it does not."""
        ...

    def expected_seconds(self, level: AnyLevel, solution: Solution, spent: float) -> float:
        """Return how long a level will take, after a solution that took `spent` seconds."""
        ...


def required_accuracy(options: MeshOptions) -> float:
    """Return the accuracy of mesh options; an error without one."""
    if options.accuracy is None:
        raise InputError("mesh.accuracy is missing: give one, such as MeshOptions(accuracy=1e-3)")
    return options.accuracy


def refined(first: AnyLevel, refinement: Refinement[AnyLevel], options: MeshOptions) -> tuple[Solution, ...]:
    """Solve level after level until the accuracy of the options is reached or cannot be.

    Returns
    -------
    tuple of Solution
        One for each mesh, the best one last; see `bemkit.runs.adaptive.run_adaptive`.

    Raises
    ------
    ValueError
        If there is no accuracy, or the first level cannot be solved.
    """
    begin, accuracy = time.perf_counter(), required_accuracy(options)
    most_elements = MOST_ELEMENTS if options.most_elements is None else options.most_elements
    level, obstacle = first, ""
    solutions: list[Solution] = []
    while not obstacle:
        started = time.perf_counter()
        try:
            solution = refinement.solved(level, solutions[-1] if solutions else None)
        except BemkitError as error:
            if not solutions:
                raise
            obstacle = f"{level.n_elements} elements cannot be solved ({error})"
            break
        solutions.append(solution)
        now = time.perf_counter()
        is_missed = solution.status is Status.MISSED_CONTACT
        if sum(each.status is Status.MISSED_CONTACT for each in solutions) > _MOST_MISSED:
            obstacle = f"contact lies between the nodes of {len(solutions)} meshes"
        elif not solution.is_converged and not is_missed:
            worst, word = solution.certificate.worst, solution.status.name.lower().replace("_", " ")
            obstacle = f"the solve on {solution.n_elements} elements ended {word} (certificate {worst:.1e})"
        elif not (is_missed or solution.missed_contacts) and refinement.is_enough(solutions):
            break
        else:
            try:
                following = refinement.following(level, solutions)
            except BemkitError as error:
                obstacle = f"no finer mesh can be made ({error})"
                break
            if following is None:
                obstacle = "the estimated error no longer falls"
                break
            level = following
            if excess := refinement.excess(level, most_elements):
                obstacle = f"more than {excess} would be needed"
            elif options.most_seconds is not None:
                expected = refinement.expected_seconds(level, solution, now - started)
                if now - begin + expected > options.most_seconds:
                    obstacle = f"more than {options.most_seconds:g} s would be needed"
    return _best_last(solutions, obstacle, accuracy, refinement)


def _best_last(
    solutions: Sequence[Solution], obstacle: str, accuracy: float, refinement: Refinement[AnyLevel]
) -> tuple[Solution, ...]:
    """Put the best solution last, with the totals of all and the reason why its accuracy is not what was asked for.

    The last one is the best if it is accurate enough.
    """
    best = solutions[-1]
    if obstacle:
        # without estimates the finest mesh is the best
        converged = [solution for solution in reversed(solutions) if solution.is_converged]
        best = min(converged, key=refinement.error, default=best)
    message = f"{len(solutions)} meshes, the last with {best.n_elements} elements. {best.message}"
    status = best.status
    if obstacle:
        message = (
            f"The accuracy {accuracy:g} was not reached: {obstacle}; estimated error {refinement.shown_error(best)}; "
            f"allow more elements or time, or ask for less. {message}"
        )
        status = Status.ACCURACY_NOT_REACHED if best.is_converged else best.status
    names = [f"mesh {number} of {len(solutions)}" for number in range(1, len(solutions) + 1)]
    others = [solution for solution in solutions if solution is not best]
    total = with_totals(best, solutions, names)
    return (*others, replace(total, warnings=total.unasked_warnings, status=status, message=message))
