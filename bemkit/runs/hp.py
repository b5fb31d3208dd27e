"""Meshes of few elements of high degree, in geometric layers towards what is singular: hp-adaptivity.

The literature on hp boundary elements for contact with friction, [BanzStephan2015], marks elements for bisection or a
higher degree one by one; here the degree is one for all elements, and rises from mesh to mesh, while elements that do
not profit from it are divided. A few meshes lead from a first look to six and more digits.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError, InputError, format_point
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
from bemkit.results.transitions import FLICKER, resolved_transitions, slip_reversals, unrolled
from bemkit.runs.density import DensityMeshes
from bemkit.runs.element_degrees import below_layers, few_kinds, sufficient_degrees
from bemkit.runs.mesh_sequence import Level, Member, zone_cuts
from bemkit.scene.discretisation import Discretisation
from bemkit.solvers.base import Status

SAFETY = 0.36
"""The next mesh is planned for this share of the accuracy."""
FEWEST_LEVELS = 4
"""Least number of meshes in layers before the error counts as stuck: the first ones are coarse on purpose."""
GAIN = 6.0
"""Factor by which one more degree, with its layers, reduces the error."""
LARGEST_RISE, LAST_RISE = 2, 3
"""Largest rise of the degree from mesh to mesh, so that the transitions can follow; and for the last mesh."""
LOOK_DEGREE = 2
"""Degree of the first mesh, which only locates the transitions."""
FIRST_DEGREE = 4
"""Degree of the first mesh in layers: it finds the places where the status changes, and its own error, well enough for
two digits more at once. Degree 3 takes hardly less time."""
COARSE = 2e-3
"""Accuracy that the first mesh in layers may reach with degree 4; for less, if it may be the last, it has a degree
more, and a layer more where loads jump."""
NEXT_ERROR = 0.032
"""Part of the error of contact tractions that the next mesh keeps, at any degree: points where the status changes
have moved away from their nodes (0.01 to 0.1 on the scenes with a reference)."""
LAST_TIPS = 10.0
"""Length of the elements beside places that have moved, relative to a piece and in units of the accuracy, from which
the last mesh asks for no shorter ones. Shorter ones only locate the points of the next mesh."""
UNMOVED = 0.01
"""Motion of the ends of zones, in units of the accuracy, that changes no error: it is off by about that motion."""
SPREADING = 0.6
"""Least factor per degree of an error of contact tractions that comes from a singular corner nearby. For a power of the
distance in layers it is 0.36."""
MOST_CUTS = 8
"""Largest number of transitions at which the mesh of all copies of a body is cut: each cut costs all of them layers."""
MOST_LOOKS = 3
"""Largest number of meshes to resolve zones of a single node; a zone that remains is a node held by a support."""


@dataclass(frozen=True)
class LayeredMeshes:
    """Each mesh divides the elements that a higher degree would not make accurate enough.

    The first one after the first look is made anew, of few elements; its pieces end where the contact status changes,
    and move with these places from mesh to mesh.

    Parameters
    ----------
    accuracy : float
        Largest error relative to the solution, both in the energy norm and of contact tractions in L2.
    """

    accuracy: float

    def error(self, solution: Solution) -> float:
        """Return the larger estimated error, of energy or of contact tractions; infinite if one is missing."""
        energy, tractions = solution.estimated_error, solution.estimated_traction_error
        if tractions is None and solution.contact_traction_size == 0.0:
            tractions = 0.0
        return np.inf if energy is None or tractions is None else max(energy, tractions)

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Return whether the error is small enough; never on the first mesh, whose zones end inside elements."""
        is_first = len(solutions) == 1 and bool(solutions[0].transitions)
        return not is_first and self.error(solutions[-1]) <= self.accuracy

    def _is_stuck(self, solutions: Sequence[Solution]) -> bool:
        """Return whether the last two meshes have not halved the error of the best before them, all in layers.

        After a mesh that misses contact the next one, in layers, is the first to look at its zones.
        """
        errors = [
            self.error(solution)
            for solution in solutions
            if all(body.coefficient_errors is not None for body in solution.bodies.values())
        ]
        n_missed = sum(solution.status is Status.MISSED_CONTACT for solution in solutions)
        return len(errors) > FEWEST_LEVELS + n_missed and min(errors[-2:]) > 0.5 * min(errors[:-2])

    def _check_lengths(self, members: Sequence[Member], errors: _Errors) -> None:
        """Raise an error that names the place if the largest error is that of an element as short as can be."""
        shares = errors.split(self._share(errors, errors.elements))
        member, share = max(zip(members, shares, strict=True), key=lambda pair: float(pair[1].max()))
        mesh, worst = member.bodies[0].mesh, int(np.argmax(share))
        if mesh.lengths[worst] < 2.0 / FACTOR * shortest_length(mesh):
            place = format_point(mesh.centres[worst], mesh.diameter, digits=6)
            raise GeometryError(
                f"the largest error is at {place}, where an element of the length "
                f"{mesh.lengths[worst]:.1e} is about as short as coordinates hold"
            )

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level | None:
        """Return a finer first look, the first meshes in layers, or after these meshes of the next degree."""
        solution, members = solutions[-1], level.members(solutions[-1])
        if level.degree == LOOK_DEGREE:
            return self._finer_look(level, members, solutions) or self._first_layers(level, members, solution)
        if solution.estimated_error is None:
            return None
        errors = _Errors.of(level, solution)
        if self._is_stuck(solutions):
            if errors is not None:
                self._check_lengths(members, errors)
            return None
        if errors is None:
            method = solution.body.scene.discretisation.method
            raise InputError(f"{method} has no error estimate: take another discretisation")
        return self._next_degree(level, members, solution, errors)

    def _finer_look(self, level: Level, members: Sequence[Member], solutions: Sequence[Solution]) -> Level | None:
        """Return denser meshes if zones have single nodes; None if none does, or another look does not help."""
        table, transitions = unrolled(solutions[-1].contact, solutions[-1].transitions)
        n_unresolved = len(transitions) - len(resolved_transitions(table, transitions))
        # both ends of a stick zone of one node between opposite slips are resolved by layers
        is_coarse = n_unresolved > sum(2 * reversal.n_sticking for reversal in slip_reversals(table))
        has_copies = any(len(member.bodies) > 1 for member in members)
        if not is_coarse or has_copies or len(solutions) >= MOST_LOOKS:
            return None
        return DensityMeshes(self.accuracy).following(level, solutions)

    def _first_layers(self, level: Level, members: Sequence[Member], solution: Solution) -> Level:
        """Return the first meshes in layers; one degree and one layer more if they may be the last ones."""
        more = int(self._may_stop_at_once(solution))
        return replace(level, partitions=_in_layers(members, n_at_jumps=1 + more), degree=FIRST_DEGREE + more)

    def _next_degree(
        self, level: Level, members: Sequence[Member], solution: Solution, errors: _Errors
    ) -> Level | None:
        """Return meshes of a higher degree, with elements divided where that is not enough; None if nothing changes."""
        fresh = _in_layers(members)
        # the same pieces: the places where the status changes have only moved
        is_settled = all(has_same_pieces(old, new) for old, new in zip(level.partitions, fresh, strict=True))
        rise = self._rise(level, solution, errors, is_settled=is_settled)
        higher = [
            _degrees_of(member, level.with_degree(member.bodies[0].scene.discretisation, level.degree + rise.degrees))
            for member in members
        ]
        excesses = errors.split(errors.excess(np.concatenate(higher), rise.goal))
        # layers shorter than what flickers would hold nothing but round-off
        resolution = max(LAST_TIPS * self.accuracy if rise.is_last else self.accuracy, FLICKER)
        refined = tuple(
            refined_partition(member.partition, excess, partition, resolution)
            for member, excess, partition in zip(members, excesses, fresh, strict=True)
        )
        degrees: tuple[int, ...] = ()
        if is_settled and level.asked.mesh.rising_degrees and len(level.keys) == 1:
            degrees = self._degrees(errors, level.partition, refined[0], int(higher[0].max()))
        following = replace(level, partitions=refined, degree=level.degree + rise.degrees, degrees=degrees)
        if not _is_alike(level, following, max(UNMOVED * self.accuracy, FLICKER)):
            return following
        # the error is that beside a singular corner, which the errors of elements do not show
        return replace(following, degree=level.degree + 1, degrees=()) if level.asked.mesh.rising_degrees else None

    def _rise(self, level: Level, solution: Solution, errors: _Errors, *, is_settled: bool) -> _Rise:
        """Return by how many degrees the next mesh rises, and the error to which its elements are divided."""
        is_inner = np.concatenate([~is_at_end(partition) for partition in level.partitions])
        needed = self._needed_rise(errors, is_inner) if is_settled else 0
        moves_on = level.degree == FIRST_DEGREE and self._moves_on(solution)
        is_last = is_settled and needed <= LAST_RISE and not moves_on
        rise = needed if is_last else min(needed, LARGEST_RISE)
        if moves_on:  # the mesh after the next one may be the last: as coarse as that one allows
            rise = min(rise, max(needed - LAST_RISE, 1))
        goal = self.accuracy / NEXT_ERROR if moves_on else SAFETY * self.accuracy
        if not is_last:
            goal = max(goal, self.error(solution) / GAIN**LARGEST_RISE)
        return _Rise(rise, goal, is_last)

    def _may_stop_at_once(self, solution: Solution) -> bool:
        """Whether a first mesh in layers that is better than others may be the last."""
        has_error = solution.estimated_traction_error is not None
        return has_error and self.accuracy < COARSE and not self._moves_on(solution)

    def _moves_on(self, solution: Solution) -> bool:
        """Whether the part of its error that remains on the next mesh, because transitions still move, is too large."""
        error = solution.estimated_traction_error
        return error is not None and NEXT_ERROR * error > self.accuracy

    def _degrees(self, errors: _Errors, old: Partition, new: Partition, largest: int) -> tuple[int, ...]:
        """Return the degrees of new elements that come from those of a solution."""
        elements, layers = origins(old, new)
        is_cut = np.bincount(elements, minlength=errors.degrees.size)[elements] > 1

        def excess(degrees: IntArray) -> FloatArray:
            return self._share(errors, errors.elements.at_higher_degrees(degrees - errors.degrees))

        # never below the old degree: coefficients that have reached round-off do not show how fast they fell before
        kept = np.maximum(sufficient_degrees(excess, errors.degrees.size, largest), errors.degrees)[elements]
        return tuple(few_kinds(below_layers(np.where(is_cut, largest, kept), layers)).tolist())

    def _share(self, errors: _Errors, of_elements: CoefficientErrors) -> FloatArray:
        """Return by which factor (n_elements,) errors are above equal shares of half of what is allowed."""
        allowed = 0.5 * (SAFETY * self.accuracy) ** 2 / errors.degrees.size
        excess = np.sqrt(of_elements.energy / (allowed * errors.error_unit))
        if errors.size > 0.0:
            tractions = np.where(errors.is_contact, of_elements.traction, 0.0)
            excess = np.maximum(excess, np.sqrt(tractions / (allowed * errors.size**2)))
        return np.asarray(excess)

    def _needed_rise(self, errors: _Errors, inner: BoolArray) -> int:
        """Return how many degrees the errors of the inner elements need, one for those at the ends, none for places."""
        allowed = SAFETY * self.accuracy
        needed = np.log(max(errors.relative(inner), allowed) / allowed) / np.log(GAIN)
        is_inexact = errors.relative(np.ones_like(inner)) > allowed
        return max(int(np.ceil(needed)), int(is_inexact))


class _Rise(NamedTuple):
    """By how many degrees the next mesh rises, the error allowed on it, and whether it should be the last one."""

    degrees: int
    goal: float
    is_last: bool


@dataclass(frozen=True, eq=False)
class _Errors:
    """Estimated errors on the elements of all partitions, one after the other, and the sizes that they are relative to.

    Parameters
    ----------
    elements : CoefficientErrors
        Of copies the largest, as often as there are copies.
    is_contact : (n_elements,) bool array
    degrees : (n_elements,) int array
    ends : (n_partitions - 1,) int array
        Where the partitions end.
    error_unit : float [J/m]
    size : float [Pa m^(1/2)]
        Of the contact tractions.
    """

    elements: CoefficientErrors
    is_contact: BoolArray
    degrees: IntArray
    ends: IntArray
    error_unit: float
    size: float

    @classmethod
    def of(cls, level: Level, solution: Solution) -> _Errors | None:
        """Return the errors of a solution; None if degrees are too low for an estimate."""
        members = level.members(solution)
        known = [[body.coefficient_errors for body in member.bodies] for member in members]
        if any(copy_errors is None for of_copies in known for copy_errors in of_copies):
            return None
        of_members = [
            CoefficientErrors.at_worst([copy_errors for copy_errors in of_copies if copy_errors is not None])
            for of_copies in known
        ]
        is_contact = [np.isin(np.arange(len(each.partition.sides)), each.contact_elements) for each in members]
        moved = [_moved_to_corners(solution, *each) for each in zip(members, of_members, is_contact, strict=True)]
        return cls(
            elements=CoefficientErrors.joined(moved),
            is_contact=np.concatenate(is_contact),
            degrees=np.concatenate([_degrees_of(each, each.bodies[0].scene.discretisation) for each in members]),
            ends=np.cumsum([mask.size for mask in is_contact])[:-1],
            error_unit=solution.error_unit,
            size=solution.contact_traction_size,
        )

    def split(self, values: FloatArray) -> list[FloatArray]:
        """Return the values on each partition."""
        return np.split(values, self.ends)

    def relative(self, chosen: BoolArray) -> float:
        """Return the larger one of the relative errors of some elements, in energy and in contact tractions."""
        energy = float(self.elements.energy[chosen].sum()) / self.error_unit
        contact_errors = self.elements.traction[chosen & self.is_contact]
        tractions = float(contact_errors.sum()) / self.size**2 if self.size > 0.0 else 0.0
        return float(np.sqrt(max(energy, tractions)))

    def excess(self, degrees: IntArray, goal: float) -> FloatArray:
        """Return by which factor (n_elements,) errors at higher degrees would be above their shares of a goal."""
        errors = self.elements.at_higher_degrees(degrees - self.degrees)
        excess = _excess_of(errors.energy, self.error_unit * goal**2)
        if self.size > 0.0:
            of_tractions = _excess_of(errors.traction[self.is_contact], (self.size * goal) ** 2)
            excess[self.is_contact] = np.maximum(excess[self.is_contact], of_tractions)
        return excess


def _moved_to_corners(
    solution: Solution, member: Member, errors: CoefficientErrors, is_contact: BoolArray
) -> CoefficientErrors:
    """Return errors in which an element at a singular corner has that of the contact tractions on the next one.

    If the latter hardly falls with the degree, it comes from the corner: layers there help, and nothing else does. The
    element at the corner then counts as one in contact. Between elastic bodies it may come from the partner's mesh.
    """
    moves = [
        (tip, following)
        for body in member.bodies
        for corner in solution.places.corners[body.name]
        for tip, following in corner.beside(body.mesh)
        if not corner.partner and is_contact[following] and errors.traction_decay[following] > SPREADING
    ]
    if not moves:
        return errors
    tips, others = np.array(moves).T
    traction, decay = errors.traction.copy(), errors.traction_decay.copy()
    traction[tips], traction[others], decay[tips] = traction[others], 0.0, 1.0
    is_contact[tips] = True
    return replace(errors, traction=traction, traction_decay=decay)


def _is_alike(level: Level, other: Level, resolution: float) -> bool:
    """Whether two levels have the same degrees, and elements whose ends differ by no more than a resolution."""
    if (level.degree, level.degrees) != (other.degree, other.degrees):
        return False
    spans = ((old.spans, new.spans) for old, new in zip(level.partitions, other.partitions, strict=True))
    return all(old.shape == new.shape and bool(np.all(np.abs(old - new) <= resolution)) for old, new in spans)


def _degrees_of(member: Member, discretisation: Discretisation) -> IntArray:
    """Return the degree (n_elements,) of each element."""
    return element_degrees(discretisation.displacement_space(member.bodies[0].mesh))


def _in_layers(members: Sequence[Member], n_at_jumps: int = 1) -> tuple[Partition, ...]:
    """Return partitions made anew, of few elements in layers towards the places where the status changes."""
    return tuple(
        layered_partition(member.partition.base, _settled_cuts(member), n_at_jumps=n_at_jumps) for member in members
    )


def _settled_cuts(member: Member) -> dict[int, list[float]]:
    """Return where a partition is cut, as parameters by the number of the side.

    Where sides of other bodies end, and where zones of one status do, of copies only if these places are few. So where
    the direction of slip changes: in layers towards that place the next mesh resolves the stick zone there.
    """
    of_zones = (*member.ends, *member.reversals)
    has_many = len(member.bodies) > 1 and len(of_zones) > MOST_CUTS
    ends = member.facing_ends if has_many else (*of_zones, *member.facing_ends)
    return {side: _settled(places) for side, places in zone_cuts(member.partition, ends).items()}


def _settled(places: Sequence[float]) -> list[float]:
    """Return the medians of transition points closer than `FLICKER`."""
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
