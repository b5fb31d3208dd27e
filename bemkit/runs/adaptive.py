"""Meshes that follow the solution until the accuracy asked for is reached."""

from __future__ import annotations

import time
from collections.abc import Callable

from bemkit.errors import BemkitError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.plan import make_plan
from bemkit.results.solution import Solution
from bemkit.runs.best_mesh import best_last
from bemkit.runs.density import DensityMeshes
from bemkit.runs.history import run_on_mesh
from bemkit.runs.hp import LayeredMeshes
from bemkit.runs.mesh_sequence import Level, MeshSequence
from bemkit.scene.mesh_options import MOST_ELEMENTS
from bemkit.scene.scene import Scene
from bemkit.solvers.base import StepRecord


def run_adaptive(scene: Scene, *, callback: Callable[[StepRecord], None] | None = None) -> tuple[Solution, ...]:
    """Solve a scene on a sequence of meshes until the estimated error is below the accuracy of the scene.

    Each mesh is made from the solution before it, by density for linear and quadratic elements (`DensityMeshes`), in
    layers for higher and rising degrees (`LayeredMeshes`), and its solve starts from that solution, so that few Newton
    steps are needed.

    Parameters
    ----------
    scene : Scene
        With `MeshOptions.accuracy`.
    callback : callable, optional
        Receives a record of every step on every mesh.

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
        If the scene has no accuracy, or for the reasons of `bemkit.run`.
    """
    options, begin = scene.mesh, time.perf_counter()
    if options.accuracy is None:
        raise InputError("mesh.accuracy is missing: give one, such as MeshOptions(accuracy=1e-3)")
    meshes: MeshSequence = (LayeredMeshes if scene.discretisation.takes_layers else DensityMeshes)(options.accuracy)
    contact = [part.name for part in scene.contact_parts]
    first = options.first_partition(scene.shape.outline(), scene.selections, contact, scene.symmetry)
    level = Level(scene, first)
    most_elements = MOST_ELEMENTS if options.most_elements is None else options.most_elements
    solutions: list[Solution] = []
    obstacle = ""
    while not obstacle:
        started = time.perf_counter()
        start = solutions[-1] if solutions and contact else None
        try:
            solution = _solved(level, start, callback)
        except BemkitError as error:
            if not solutions:
                raise
            obstacle = f"{level.partition.mesh.n_elements} elements cannot be solved ({error})"
            break
        solutions.append(solution)
        now = time.perf_counter()
        if not solution.is_converged:
            obstacle = f"the solve on {solution.mesh.n_elements} elements failed"
        elif meshes.is_enough(solutions):
            break
        else:
            try:
                following = meshes.following(level, solutions)
                level = level if following is None else following
                _ = level.partition.mesh
            except BemkitError as error:
                obstacle = f"no finer mesh can be made ({error})"
                break
            if following is None:
                obstacle = "the estimated error no longer falls"
            elif _size(level) > most_elements:
                obstacle = f"more than {most_elements} elements would be needed"
            elif options.most_seconds is not None:
                expected = _expected_seconds(solution, now - started, level.scene, level.partition.mesh)
                if now - begin + expected > options.most_seconds:
                    obstacle = f"more than {options.most_seconds:g} s would be needed"
    return best_last(solutions, obstacle, options.accuracy, error=meshes.error, shown=_errors)


def _solved(level: Level, start: Solution | None, callback: Callable[[StepRecord], None] | None) -> Solution:
    """Solve a scene from the solution before, and if that leads nowhere from the beginning."""
    solution = run_on_mesh(level.scene, level.partition.mesh, start, callback)
    if start is None or solution.is_converged:
        return solution
    return run_on_mesh(level.scene, level.partition.mesh, None, callback)


def _size(level: Level) -> int:
    """Return the number of elements; of high degree, of quadratic elements with as many nodes."""
    degree = level.scene.discretisation.displacement_space(level.partition.mesh).degree
    return len(level.partition.sides) * max(degree, 2) // 2


def _expected_seconds(solution: Solution, spent: float, scene: Scene, mesh: BoundaryMesh) -> float:
    """Return how long the next mesh will take: what the last one took, in the proportion of their plans."""
    return spent * make_plan(scene, mesh).seconds / solution.plan.seconds


def _errors(solution: Solution) -> str:
    energy, tractions = solution.estimated_error, solution.estimated_traction_error
    of_energy = "unknown" if energy is None else f"{energy:.1e}"
    return of_energy if tractions is None else f"{of_energy}, of contact tractions {tractions:.1e}"
