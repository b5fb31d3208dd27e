"""Meshes of one or several bodies that follow the solution until the accuracy is reached."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np

from bemkit.errors import BemkitError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.plan.plan import make_plan
from bemkit.results.solution import Solution
from bemkit.results.solved_steps import with_totals
from bemkit.runs.density import DensityMeshes
from bemkit.runs.hp import LayeredMeshes
from bemkit.runs.mesh_sequence import Level, MeshSequence
from bemkit.runs.step_errors import in_which_step
from bemkit.runs.steps import RunOptions, guess_from, run_on_mesh
from bemkit.scene.discretisation import MOST_ELEMENTS, MeshOptions
from bemkit.scene.scene import Scene
from bemkit.solvers.base import Status

_MOST_MISSED = 12
"""Largest number of meshes that miss contact; each has nodes where the one before missed it."""
_SAME = 1e-9
"""Relative difference of the lengths of equal elements, in the coordinates of the shape and in those of its place."""


def run_adaptive(scene: Scene, options: RunOptions | None = None) -> tuple[Any, ...]:
    """Solve a scene on a sequence of meshes until the estimated error is below its accuracy.

    A load history is solved as a whole on each mesh, which follows the largest errors of all its steps, relative to the
    largest energy among them.

    All bodies are divided anew after each solve, by density for linear and quadratic elements (`DensityMeshes`), in
    layers for higher and rising degrees (`LayeredMeshes`); both sides of a contact get nodes where its status changes.
    Copies keep one mesh in common, as fine as the worst of them needs. A solve starts from the solution before it, so
    that few Newton steps are needed.

    Parameters
    ----------
    scene : Scene
        With `MeshOptions.accuracy`.
    options : RunOptions, optional
        The guess is for the first mesh. Of an earlier run some steps on one of the meshes may be done; meshes before
        that one are solved again, unheard.

    Returns
    -------
    tuple of Solution
        One for each mesh; the best one comes last. Its timings, linear solves, steps and history are those of all
        meshes together. If the accuracy is out of reach within the elements or the time allowed, or because the solve
        on a finer mesh fails, its status is ACCURACY_NOT_REACHED, its message gives the reason, and
        `Solution.estimated_error` says what was reached. If no mesh at all could be solved, its status is that of the
        last one.

    Raises
    ------
    ValueError
        If the scene has no accuracy, degrees shall rise in a load history, or for the reasons of `bemkit.run`.
    """
    level: Level = Level.first(cast(Any, scene))
    return _refined(level, _Refinement(_rule(level), options or RunOptions()), scene.mesh)


def _rule(level: Level) -> MeshSequence:
    """Return how better meshes are made: in layers for elements of high degree, if there is a single load."""
    mesh, n_steps = level.asked.mesh, level.asked.n_steps
    accuracy = _required_accuracy(mesh)
    if n_steps > 1 and mesh.rising_degrees:
        raise InputError(
            f"discretisation is 'hp', and there are {n_steps} load steps: degrees rise only for single loads: "
            "choose 'quadratic', or another fixed degree"
        )
    return LayeredMeshes(accuracy) if level.is_layered else DensityMeshes(accuracy)


def _has_meshes(solution: Solution, meshes: Mapping[str, BoundaryMesh]) -> bool:
    """Return whether a solution is one on these meshes, wherever its bodies lie."""
    pairs = [(solution.bodies[name].mesh.lengths, mesh.lengths) for name, mesh in meshes.items()]
    return all(one.shape == two.shape and np.allclose(one, two, rtol=_SAME, atol=0.0) for one, two in pairs)


@dataclass(frozen=True)
class _Refinement:
    """How the meshes of a level are solved, judged and refined."""

    meshes: MeshSequence
    options: RunOptions

    def solved(self, level: Level, start: Any) -> Any:
        """Solve a single load from the solution before, and if that fails, from the beginning."""
        scene, options = level.scene, self._options_on(level)
        if start is not None:
            if start.contact.n_contact and scene.n_steps == 1:
                warm = replace(self.options, guess=guess_from(scene, start), done=None, finished=None)
                solution = run_on_mesh(scene, level.meshes, warm)
                if solution.is_converged:
                    return solution
            options = replace(options, guess=None)
        return run_on_mesh(scene, level.meshes, options)

    def _options_on(self, level: Level) -> RunOptions:
        """Return the options on the meshes of a level; earlier steps are on those of one level only."""
        options = self.options
        if options.done is None or _has_meshes(options.done, level.meshes):
            return options
        is_before = level.n_elements < options.done.n_elements
        return replace(options, done=None, finished=None if is_before else options.finished)

    def error(self, solution: Any) -> float:
        """Return the estimated error; infinite without an estimate."""
        return float(self.meshes.error(solution))

    def shown_error(self, solution: Any) -> str:
        """Return the estimated errors in words."""
        if where := in_which_step(solution):
            return f"{self.error(solution):.1e}{where}"
        energy, tractions = solution.estimated_error, solution.estimated_traction_error
        of_energy = "unknown" if energy is None else f"{energy:.1e}"
        return of_energy if tractions is None else f"{of_energy}, of contact tractions {tractions:.1e}"

    def following(self, level: Level, solutions: Sequence[Any]) -> Level | None:
        """Return the next level, its meshes made; None if that would not help."""
        following = self.meshes.following(level, solutions)
        if following is not None:
            _ = following.meshes  # errors in them are raised now
        return following

    def excess(self, level: Level, most_elements: int) -> str:
        """Name the limit of elements that a level exceeds; empty if it does not.

        That of a body, on average; of high degree, of quadratic ones with as many nodes. Copies count as one.
        """
        degree = level.scene.discretisation.displacement_space(level.partitions[0].mesh).degree
        n_elements = sum(len(partition.sides) for partition in level.partitions) // len(level.partitions)
        of_each = " a body" if len(level.keys) > 1 else ""
        return f"{most_elements} elements{of_each}" if n_elements * max(degree, 2) // 2 > most_elements else ""

    def expected_seconds(self, level: Level, solution: Any, spent: float) -> float:
        """Return the expected time of the next meshes: the time of the last ones, in proportion to their plans."""
        return spent * make_plan(level.scene, level.meshes).seconds / float(solution.plan.seconds)


@dataclass(frozen=True)
class _Obstacle:
    """Why no finer mesh is solved, and what helps."""

    reason: str
    remedy: str = "give a number of elements"

    @classmethod
    def of_limit(cls, limit: str) -> _Obstacle:
        """Return the obstacle that a finer mesh exceeds a limit."""
        return cls(f"more than {limit} would be needed", "allow more elements or time")


def _required_accuracy(options: MeshOptions) -> float:
    """Return the accuracy of mesh options; an error without one."""
    if options.accuracy is None:
        raise InputError("mesh.accuracy is missing: give one, such as MeshOptions(accuracy=1e-3)")
    return options.accuracy


def _refined(first: Level, refinement: _Refinement, options: MeshOptions) -> tuple[Solution, ...]:
    """Solve level after level until the accuracy of the options is reached or cannot be; see `run_adaptive`."""
    begin, accuracy = time.perf_counter(), _required_accuracy(options)
    most_elements = MOST_ELEMENTS if options.most_elements is None else options.most_elements
    level, solutions = first, list[Solution]()
    obstacle: _Obstacle | None = None
    while obstacle is None:
        started = time.perf_counter()
        try:
            solution = refinement.solved(level, solutions[-1] if solutions else None)
        except BemkitError as error:
            if not solutions:
                raise
            obstacle = _Obstacle(f"{level.n_elements} elements cannot be solved ({error})")
            break
        solutions.append(solution)
        level = level.with_sides_of(solution)
        now = time.perf_counter()
        is_missed = solution.status is Status.MISSED_CONTACT
        if sum(each.status is Status.MISSED_CONTACT for each in solutions) > _MOST_MISSED:
            obstacle = _Obstacle(f"contact lies between the nodes of {len(solutions)} meshes")
        elif not solution.is_converged and not is_missed:
            worst, word = solution.certificate.worst, solution.status.name.lower().replace("_", " ")
            reason = f"the solve on {solution.n_elements} elements ended {word} (certificate {worst:.1e})"
            obstacle = _Obstacle(reason)
        elif not (is_missed or solution.missed_contacts) and refinement.meshes.is_enough(solutions):
            break
        else:
            try:
                following = refinement.following(level, solutions)
            except BemkitError as error:
                obstacle = _Obstacle(f"no finer mesh can be made ({error})")
                break
            if following is None:
                obstacle = _Obstacle("the estimated error no longer falls", "round corners with singular tractions")
                break
            level = following
            if excess := refinement.excess(level, most_elements):
                obstacle = _Obstacle.of_limit(excess)
            elif options.most_seconds is not None:
                expected = refinement.expected_seconds(level, solution, now - started)
                if now - begin + expected > options.most_seconds:
                    obstacle = _Obstacle.of_limit(f"{options.most_seconds:g} s")
    return _best_last(solutions, obstacle, accuracy, refinement)


def _best_last(
    solutions: Sequence[Solution], obstacle: _Obstacle | None, accuracy: float, refinement: _Refinement
) -> tuple[Solution, ...]:
    """Put the best solution last, with the totals of all and the reason why it misses the accuracy.

    The last one is the best if it is accurate enough.
    """
    best = solutions[-1]
    if obstacle is not None:
        # without estimates the finest mesh is the best
        converged = [solution for solution in reversed(solutions) if solution.is_converged]
        best = min(converged, key=refinement.error, default=best)
    made = "One mesh" if len(solutions) == 1 else f"{len(solutions)} meshes, the last"
    message = f"{made} with {best.n_elements} elements. {best.message}"
    status = best.status
    if obstacle is not None:
        message = (
            f"The accuracy {accuracy:g} was not reached: {obstacle.reason}; estimated error "
            f"{refinement.shown_error(best)}; {obstacle.remedy}, or ask for less. {message}"
        )
        status = Status.ACCURACY_NOT_REACHED if best.is_converged else best.status
    names = [f"mesh {number} of {len(solutions)}" for number in range(1, len(solutions) + 1)]
    others = [solution for solution in solutions if solution is not best]
    total = with_totals(best, solutions, names)
    return (*others, replace(total, status=status, message=message))
