"""Meshes of linear and quadratic elements whose density follows the estimated errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry.meshing.partition import SPREAD, better_partition
from bemkit.results.solution import Solution
from bemkit.runs.mesh_sequence import Level, zone_cuts, zone_ends

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
        n_accurate = sum(self.error(each) <= self.accuracy for each in solutions)
        return n_accurate > MOST_FOR_TRANSITIONS or (n_accurate > 0 and self._resolves_transitions(solutions[-1]))

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level:
        """Return a mesh whose density follows the estimated errors."""
        solution = solutions[-1]
        partition = better_partition(
            level.partition,
            _target_density(solution),
            self._next_size(solution),
            cuts=zone_cuts(level.partition, solution),
            spread_over=[part.name for part in solution.scene.contact_parts],
        )
        return replace(level, partition=partition)

    def _next_size(self, solution: Solution) -> int:
        """Return the number of elements that the accuracy needs, or a step towards it."""
        rate, density = _rate(solution), _target_density(solution)
        allowed = (SAFETY * self.accuracy) ** 2 * solution.error_unit
        spread = SPREAD if solution.scene.contact_parts else 0.0
        needed = (density.sum() / allowed) ** (1.0 / rate) * density.sum() / (1.0 - spread) if allowed > 0.0 else 0.0
        n_elements = solution.mesh.n_elements
        smallest = SMALLEST_GROWTH if self.error(solution) > self.accuracy else 1.0
        return int(np.clip(needed, smallest * n_elements, LARGEST_GROWTH * n_elements))

    def _resolves_transitions(self, solution: Solution) -> bool:
        """Tell whether the elements in which the status changes are as short as the accuracy asks for.

        Tractions there behave like square roots; an element of length h leaves a relative error of about h / (3 l) in a
        contact part of length l. The energy hardly notices.
        """
        mesh = solution.mesh
        return all(
            mesh.lengths[element] <= TRANSITION * self.accuracy * mesh.lengths[mesh.part(part)].sum()
            for part, element, _ in zone_ends(solution)
        )


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
