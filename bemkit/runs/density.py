"""Meshes of linear and quadratic elements whose density follows the estimated errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.meshing.partition import SPREAD, better_partition
from bemkit.results.assembly_solution import AssemblySolution
from bemkit.results.solution import Solution
from bemkit.runs.mesh_sequence import Level, ZoneEnd, zone_cuts, zone_ends

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


@dataclass(frozen=True)
class DensityMeshes:
    """Each mesh is made anew from the solution before it.

    Its pieces end where the contact status changes, so that these points are nodes and the mesh is graded towards them;
    elements are shared by the estimated errors, and half of them lie on the contact boundary in any case. The few
    meshes grow by factors of two and more, so that the last one costs more than all others together.

    Parameters
    ----------
    accuracy : float
        Largest error in the energy norm, relative to the solution.
    """

    accuracy: float

    def error(self, solution: Solution) -> float:
        """Return the estimated error in the energy norm."""
        return float("inf") if solution.estimated_error is None else solution.estimated_error

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Tell whether the estimated error is small enough, and the elements in which the status changes short."""
        return is_enough([self.error(each) for each in solutions], zone_ends(solutions[-1]), self.accuracy)

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level:
        """Return a mesh whose density follows the estimated errors."""
        solution = solutions[-1]
        if solution.element_errors is None:
            raise InputError("collocation has no error estimate: choose a Galerkin discretisation")
        rate = error_rate(solution.scene.discretisation.displacement_space(solution.mesh).degree)
        density = target_density(solution.element_errors, rate)
        parts = [part.name for part in solution.scene.contact_parts]
        spread = SPREAD if parts else 0.0
        n_elements = int(next_size(solution, float(density.sum()), rate, self.accuracy, spread=spread))
        cuts = zone_cuts(level.partition, zone_ends(solution))
        partition = better_partition(level.partition, density, n_elements, cuts=cuts, spread_over=parts)
        return replace(level, partition=partition)


def is_enough(errors: Sequence[float], ends: Iterable[ZoneEnd], accuracy: float) -> bool:
    """Tell whether the estimated errors have become small enough, and the elements in which the status changes short.

    Tractions there behave like square roots; an element of length h leaves a relative error of about h / (3 l) in a
    contact part of length l. The energy hardly notices.
    """
    n_accurate = sum(error <= accuracy for error in errors)
    if n_accurate == 0 or n_accurate > MOST_FOR_TRANSITIONS:
        return n_accurate > 0
    longest = TRANSITION * accuracy
    return all(
        end.mesh.lengths[end.element] <= longest * end.mesh.lengths[end.mesh.part(end.part)].sum() for end in ends
    )


def error_rate(degree: int) -> int:
    """Return the power of element lengths in the squared energy error of displacements of a degree p: 2 p + 1.

    On a half-plane displacements are means, of degree 0, and tractions constant, which leaves the error of degree 1.
    """
    return 2 * max(degree, 1) + 1


def target_density(element_errors: FloatArray, rate: int) -> FloatArray:
    """Return how many elements should replace each one.

    The squared error of an element cut into m falls like m**-rate; for the smallest sum over a given number of elements
    m is proportional to the squared error to the power of 1 / (rate + 1).
    """
    return np.asarray(element_errors ** (1.0 / (rate + 1)))


def next_size(
    solution: Solution | AssemblySolution, total_density: float, rate: int, accuracy: float, *, spread: float
) -> float:
    """Return the number of elements that the accuracy needs, or a step towards it.

    Parameters
    ----------
    solution : Solution or AssemblySolution
        Of the last mesh.
    total_density : float
        The sum of `target_density`.
    rate : int
    accuracy : float
    spread : float
        Share of the elements that lie evenly on contact parts.
    """
    allowed = (SAFETY * accuracy) ** 2 * solution.error_unit
    needed = (total_density / allowed) ** (1.0 / rate) * total_density / (1.0 - spread) if allowed > 0.0 else 0.0
    error = solution.estimated_error
    smallest = SMALLEST_GROWTH if error is None or error > accuracy else 1.0
    return float(np.clip(needed, smallest * solution.n_elements, LARGEST_GROWTH * solution.n_elements))
