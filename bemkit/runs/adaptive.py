"""Meshes that follow the solution until the accuracy asked for is reached.

Each mesh is made anew from the solution before it: its pieces end where the contact status changes, so that these
points are nodes and the mesh is graded towards them; elements are shared by the estimated errors, and half of them lie
on the contact boundary in any case. Solves start from the solution before, so that few Newton steps are needed. The
few meshes grow by factors of two and more, so that the last one costs more than all others together.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import BemkitError, InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.order import along_boundary
from bemkit.geometry.meshing.partition import SPREAD, Partition, better_partition
from bemkit.plan import make_plan
from bemkit.results.solution import Solution, with_totals
from bemkit.runs.history import run_on_mesh
from bemkit.scene.mesh_options import MOST_ELEMENTS
from bemkit.scene.scene import Scene
from bemkit.solvers.base import Status, StepRecord

LARGEST_GROWTH = 2.5
"""Factor between the numbers of elements of two meshes: the places where the status changes must keep up."""
SMALLEST_GROWTH = 1.1
"""A mesh that is hardly larger would hardly be better."""
TRANSITION = 3.0
"""Length of the element in which the status changes, in units of the accuracy times the length of the part."""
MOST_FOR_TRANSITIONS = 2
"""Meshes whose estimated error is small enough, made only because of the elements in which the status changes."""
SAFETY = 0.8
"""The next mesh is planned for this part of the error asked for."""


def run_adaptive(scene: Scene, *, callback: Callable[[StepRecord], None] | None = None) -> tuple[Solution, ...]:
    """Solve a scene on meshes of growing size until the estimated error is below the accuracy of the scene.

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
    options = scene.mesh
    if options.accuracy is None:
        raise InputError("mesh.accuracy is missing: give one, such as MeshOptions(accuracy=1e-3)")
    begin = time.perf_counter()
    contact = [part.name for part in scene.contact_parts]
    partition = options.first_partition(scene.shape.outline(), scene.selections, contact, scene.symmetry)
    solutions: list[Solution] = []
    most_elements = MOST_ELEMENTS if options.most_elements is None else options.most_elements
    while True:
        started = time.perf_counter()
        start = solutions[-1] if solutions and contact else None
        try:
            solution = run_on_mesh(scene, partition.mesh, start, callback)
        except BemkitError as error:
            if not solutions:
                raise
            return _ending(solutions, f"{partition.mesh.n_elements} elements cannot be solved ({error})")
        solutions.append(solution)
        now = time.perf_counter()
        if not solution.is_converged:
            return _ending(solutions, f"the solve on {solution.mesh.n_elements} elements failed")
        n_accurate = sum(_error(each) <= options.accuracy for each in solutions)
        if n_accurate > MOST_FOR_TRANSITIONS or (n_accurate and _resolves_transitions(solution, options.accuracy)):
            return _ending(solutions)
        partition = better_partition(
            partition,
            _target_density(solution),
            _next_size(solution, options.accuracy),
            cuts=_cuts(partition, solution),
            spread_over=contact,
        )
        n_elements = len(partition.sides)
        if n_elements > most_elements:
            return _ending(solutions, f"more than {most_elements} elements would be needed")
        if options.most_seconds is not None:
            expected = _expected_seconds(solution, now - started, partition.mesh)
            if now - begin + expected > options.most_seconds:
                return _ending(solutions, f"more than {options.most_seconds:g} s would be needed")


def _expected_seconds(solution: Solution, spent: float, mesh: BoundaryMesh) -> float:
    """Return how long the next mesh will take: what the last one took, in the proportion of their plans."""
    return spent * make_plan(solution.scene, mesh).seconds / solution.plan.seconds


def _error(solution: Solution) -> float:
    return float("inf") if solution.estimated_error is None else solution.estimated_error


def _rate(solution: Solution) -> int:
    """Return the power of element lengths in the squared energy error: 2 p + 1 for displacements of degree p."""
    return 2 * solution.scene.discretisation.displacement_space(solution.mesh).degree + 1


def _target_density(solution: Solution) -> FloatArray:
    """Return how many elements should replace each one.

    The squared error of an element cut into m falls like m**-rate; for the smallest sum over a given number of elements
    m is proportional to the squared error to the power of 1 / (rate + 1).
    """
    errors = solution.element_errors
    if errors is None:
        raise InputError("collocation has no error estimate: choose a Galerkin discretisation")
    return np.asarray(errors ** (1.0 / (_rate(solution) + 1)))


def _next_size(solution: Solution, accuracy: float) -> int:
    """Return the number of elements that the accuracy needs, or a step towards it."""
    rate, density = _rate(solution), _target_density(solution)
    allowed = (SAFETY * accuracy) ** 2 * 2.0 * solution.energy
    spread = SPREAD if solution.scene.contact_parts else 0.0
    needed = (density.sum() / allowed) ** (1.0 / rate) * density.sum() / (1.0 - spread) if allowed > 0.0 else 0.0
    n_elements = solution.mesh.n_elements
    smallest = SMALLEST_GROWTH if _error(solution) > accuracy else 1.0
    return int(np.clip(needed, smallest * n_elements, LARGEST_GROWTH * n_elements))


def _resolves_transitions(solution: Solution, accuracy: float) -> bool:
    """Tell whether the elements in which the status changes are as short as the accuracy asks for.

    Tractions there behave like square roots; an element of length h leaves a relative error of about h / (3 l) in a
    contact part of length l. The energy hardly notices.
    """
    mesh = solution.mesh
    return all(
        mesh.lengths[element] <= TRANSITION * accuracy * mesh.lengths[mesh.part(part)].sum()
        for part, element, _ in _zone_ends(solution)
    )


def _zone_ends(solution: Solution) -> list[tuple[str, int, float]]:
    """Return where zones of one status end: the part, the element and the fraction of its length.

    A zone that a single node stands for is not resolved yet, or it is a node that a support holds: its ends are left
    alone.
    """
    table, mesh = solution.contact, solution.mesh
    found = []
    for part in table.parts:
        nodes = table.s[table.rows(part)]
        places = np.array([transition.s for transition in solution.transitions if transition.part == part])
        zone_sizes = np.histogram(nodes, np.concatenate([[-np.inf], places, [np.inf]]))[0]
        elements = along_boundary(mesh, mesh.part(part))
        ends = np.cumsum(mesh.lengths[elements])
        for place in places[(zone_sizes[:-1] > 1) & (zone_sizes[1:] > 1)].tolist():
            k = min(int(np.searchsorted(ends, place)), elements.size - 1)
            found.append((part, int(elements[k]), 1.0 - float((ends[k] - place) / mesh.lengths[elements[k]])))
    return found


def _cuts(partition: Partition, solution: Solution) -> dict[int, list[float]]:
    """Return where zones of one status end, as parameters by the number of the side."""
    cuts: dict[int, list[float]] = {}
    for _, element, fraction in _zone_ends(solution):
        start, end = partition.spans[element].tolist()
        cuts.setdefault(int(partition.sides[element]), []).append(start + fraction * (end - start))
    return cuts


def _ending(solutions: list[Solution], obstacle: str = "") -> tuple[Solution, ...]:
    """Put the best solution last, with the totals of all and the reason why its accuracy is not what was asked for."""
    best = min((solution for solution in solutions if solution.is_converged), key=_error, default=solutions[-1])
    message, status = (
        f"{len(solutions)} meshes, the last with {best.mesh.n_elements} elements. {best.message}",
        best.status,
    )
    if obstacle:
        accuracy = best.scene.mesh.accuracy
        message = (
            f"The accuracy {accuracy:g} was not reached: {obstacle}; estimated error {_error(best):.1e}; allow more "
            f"elements or time, or ask for less. {message}"
        )
        status = Status.ACCURACY_NOT_REACHED if best.is_converged else best.status
    names = [f"mesh {number} of {len(solutions)}" for number in range(1, len(solutions) + 1)]
    others = [solution for solution in solutions if solution is not best]
    return (*others, replace(with_totals(best, solutions, names), status=status, message=message))
