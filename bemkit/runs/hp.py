"""Meshes of few elements of high degree, in geometric layers towards what is singular: hp-adaptivity.

The literature on hp boundary elements for contact with friction, [BanzStephan2015], marks elements for bisection or a
higher degree one by one; here the degree is one for all elements, and rises from mesh to mesh, while elements that do
not profit from it are divided. A few meshes lead from a first look to six and more digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.local_values import element_degrees
from bemkit.geometry.meshing.layers import (
    FACTOR,
    has_same_pieces,
    is_at_end,
    layered_partition,
    origins,
    refined_partition,
    shortest_length,
)
from bemkit.geometry.meshing.partition import Partition
from bemkit.results.coefficient_decay import CoefficientErrors
from bemkit.results.solution import Solution
from bemkit.runs.density import DensityMeshes
from bemkit.runs.element_degrees import below_layers, few_kinds, sufficient_degrees
from bemkit.runs.mesh_sequence import Level, zone_cuts, zone_ends

SAFETY = 0.4
"""The next mesh is planned for this part of the error asked for."""
FEWEST_LEVELS = 4
"""Meshes in layers before the error may be found to fall no longer: the first ones are coarse on purpose."""
GAIN = 6.0
"""Factor by which a degree and the layers that come with it reduce the error."""
LARGEST_RISE, LAST_RISE = 2, 3
"""Degrees from mesh to mesh: the places where the status changes must keep up; and where that is the last mesh."""
FINE = 5e-3
"""Accuracy below which the first mesh in layers is of degree 4, otherwise of 3: places where the status changes are
then told well enough for two digits more at once."""
FLICKER = 1e-8
"""Share of a side on which all places of change are one: clearances, which grow like d**1.5, are round-off there, and
statuses change from node to node."""
MOST_LOOKS = 3
"""Meshes to resolve zones for which a single node stands; what is left then is a node that a support holds."""


@dataclass(frozen=True)
class LayeredMeshes:
    """Each mesh divides what the degree alone would leave too inaccurate.

    The first one after the first look is made anew, of few elements; its pieces end where the contact status changes,
    and move with these places from mesh to mesh.

    Parameters
    ----------
    accuracy : float
        Largest error relative to the solution, both in the energy norm and of contact tractions in L2.
    """

    accuracy: float

    def error(self, solution: Solution) -> float:
        """Return the larger one of the estimated errors of energy and of contact tractions."""
        errors = solution.estimated_error, solution.estimated_traction_error
        if errors[0] is None:
            return float("inf")
        return max(error for error in errors if error is not None)

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Tell whether the error is small enough; not after the first look, whose zones end inside of elements."""
        is_first = len(solutions) == 1 and bool(solutions[0].transitions)
        return not is_first and self.error(solutions[-1]) <= self.accuracy

    def _is_stuck(self, solutions: Sequence[Solution]) -> bool:
        """Tell whether the last two meshes have not halved the error of the best before them, all in layers."""
        errors = [self.error(solution) for solution in solutions if solution.coefficient_errors is not None]
        return len(errors) > FEWEST_LEVELS and min(errors[-2:]) > 0.5 * min(errors[:-2])

    def _check_lengths(self, solution: Solution) -> None:
        """Raise an error that names the place if the largest error is that of an element as short as can be."""
        errors, mesh = solution.coefficient_errors, solution.mesh
        if errors is None:
            return
        worst = int(np.argmax(self._share(solution, errors)))
        if mesh.lengths[worst] < 2.0 / FACTOR * shortest_length(mesh):
            x, y = mesh.centres[worst]
            raise GeometryError(
                f"the largest error stands at ({x:.6g}, {y:.6g}), where an element of the length "
                f"{mesh.lengths[worst]:.1e} is about as short as coordinates hold"
            )

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level | None:
        """Return a mesh of the next degree, with more layers where that is not enough."""
        solution, partition = solutions[-1], level.partition
        if level.number > 0 and solution.estimated_error is None:
            return None
        if self._is_stuck(solutions):
            self._check_lengths(solution)
            return None
        ends = zone_ends(solution)
        if level.number == 0 and len(solutions) < MOST_LOOKS and len(ends) < len(solution.transitions):
            return DensityMeshes(self.accuracy).following(level, solutions)
        cuts = {side: _settled(places) for side, places in zone_cuts(partition, ends).items()}
        fresh = layered_partition(partition.base, cuts)
        if level.number == 0:
            return Level(level.asked, fresh, 2 if self.accuracy < FINE else 1)
        has_moved = has_same_pieces(partition, fresh)
        needed = self._needed_rise(solution, ~is_at_end(partition)) if has_moved else 0
        is_last = has_moved and needed <= LAST_RISE
        following = Level(level.asked, fresh, level.number + (needed if is_last else min(needed, LARGEST_RISE)))
        old_degrees = element_degrees(level.scene.discretisation.displacement_space(solution.mesh))
        degree = following.scene.discretisation.displacement_space(solution.mesh).degree
        goal = SAFETY * self.accuracy
        if not is_last:
            goal = max(goal, self.error(solution) / GAIN**LARGEST_RISE)
        # layers shorter than what flickers would hold nothing but round-off
        resolution = max(self.accuracy, FLICKER)
        refined = refined_partition(partition, self._excess(solution, degree - old_degrees, goal), cuts, resolution)
        degrees: tuple[int, ...] = ()
        if has_moved and level.asked.discretisation.needs_accuracy:
            degrees = self._degrees(solution, partition, refined, old_degrees, degree)
        return replace(following, partition=refined, degrees=degrees)

    def _degrees(
        self, solution: Solution, old: Partition, new: Partition, old_degrees: IntArray, largest: int
    ) -> tuple[int, ...]:
        """Return the degrees of new elements that come from those of a solution."""
        errors = solution.coefficient_errors
        if errors is None:
            return ()
        elements, layers = origins(old, new)
        is_cut = np.bincount(elements, minlength=old_degrees.size)[elements] > 1

        def excess(degrees: IntArray) -> FloatArray:
            return self._share(solution, errors.at_higher_degrees(degrees - old_degrees))

        # never below the old degree: coefficients that have reached round-off do not tell how fast they fell before
        kept = np.maximum(sufficient_degrees(excess, old_degrees.size, largest), old_degrees)[elements]
        return tuple(few_kinds(below_layers(np.where(is_cut, largest, kept), layers)).tolist())

    def _share(self, solution: Solution, errors: CoefficientErrors) -> FloatArray:
        """Return by which factor (n_elements,) errors are above equal shares of half of what is allowed."""
        elements, size = solution.contact_elements, solution.contact_traction_size
        allowed = 0.5 * (SAFETY * self.accuracy) ** 2 / errors.energy.size
        excess = np.sqrt(errors.energy / (allowed * solution.error_unit))
        if size > 0.0:
            excess[elements] = np.maximum(excess[elements], np.sqrt(errors.traction[elements] / (allowed * size**2)))
        return excess

    def _needed_rise(self, solution: Solution, inner: BoolArray) -> int:
        """Return how many degrees the errors of the inner elements need, one for those at the ends, none for places."""
        allowed = SAFETY * self.accuracy
        needed = np.log(max(self._element_error(solution, inner), allowed) / allowed) / np.log(GAIN)
        is_inexact = self._element_error(solution, np.ones_like(inner)) > allowed
        return max(int(np.ceil(needed)), int(is_inexact))

    def _element_error(self, solution: Solution, chosen: BoolArray) -> float:
        """Return the larger one of the relative errors of some elements, in energy and in contact tractions."""
        errors, size, contact = solution.coefficient_errors, solution.contact_traction_size, solution.contact_elements
        if errors is None:
            return float("inf")
        energy = float(errors.energy[chosen].sum()) / solution.error_unit
        tractions = float(errors.traction[contact[chosen[contact]]].sum()) / size**2 if size > 0.0 else 0.0
        return float(np.sqrt(max(energy, tractions)))

    def _excess(self, solution: Solution, rise: IntArray, goal: float) -> FloatArray:
        """Return by which factor (n_elements,) errors at higher degrees would be above their shares of a goal."""
        errors = solution.coefficient_errors
        if errors is None:
            raise InputError(
                f"{solution.scene.discretisation.method} has no error estimate: take another discretisation"
            )
        errors = errors.at_higher_degrees(rise)
        excess = _excess_of(errors.energy, solution.error_unit * goal**2)
        elements, size = solution.contact_elements, solution.contact_traction_size
        if size > 0.0:
            of_tractions = _excess_of(errors.traction[elements], (size * goal) ** 2)
            excess[elements] = np.maximum(excess[elements], of_tractions)
        return excess


def _settled(places: Sequence[float]) -> list[float]:
    """Return the medians of places of change that `FLICKER` does not tell apart."""
    ascending = np.sort(places)
    groups = np.split(ascending, 1 + np.flatnonzero(np.diff(ascending) > FLICKER))
    return [float(np.median(group)) for group in groups]


def _excess_of(squared: FloatArray, allowed: float) -> FloatArray:
    """Return the square roots of errors over the bound to which the large ones must come down for a sum allowed."""
    ascending = np.sort(squared)
    n_larger = np.arange(squared.size, 0, -1)
    bounds = (allowed - np.cumsum(ascending) + ascending) / n_larger  # if this and all larger ones come down
    is_bound = bounds < ascending
    return np.sqrt(squared / bounds[np.argmax(is_bound)]) if is_bound.any() else np.zeros(squared.size)
