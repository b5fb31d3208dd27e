"""Meshes of linear and quadratic elements whose density follows the estimated errors."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.partition import LEAST_DENSITY, SPREAD, better_partition
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.results.surface_errors import SurfaceErrors
from bemkit.results.zone_ends import ZoneEnd
from bemkit.runs.mesh_sequence import Level, zone_cuts
from bemkit.runs.step_errors import StepErrors

LARGEST_GROWTH = 2.5
"""Factor between the numbers of elements of two meshes, so that the transitions can follow."""
SMALLEST_GROWTH = 1.1
"""Least factor between the numbers of elements of two meshes."""
TRANSITION = 3.0
"""Length of the element with a transition, in units of the accuracy times the length of the zone."""
MOST_FOR_TRANSITIONS = 2
"""Largest number of meshes made only to shorten the elements with transitions."""
SAFETY = 0.8
"""The next mesh is planned for this share of the accuracy."""
LEAST_LOCAL = 1e-3
"""Smallest tolerance for single elements of a half-plane: constant tractions take thousands of elements for less."""
LOCAL_SAFETY = 0.6
"""The same for errors of single elements, since some lengths turn out longer."""
HALF_PLANE_SPREAD = 0.15
"""`SPREAD` of half-planes, whose errors are known element by element."""
LENGTH_GROWTH = 0.2
"""Largest growth of elements with the distance: jumps of lengths cause errors of tractions."""
MEAN_RATE = 2
"""Power of element lengths in the mean error of the tractions at the centres of elements on a half-plane."""


@dataclass(frozen=True)
class DensityMeshes:
    """Each mesh is made anew from the solution before it.

    Its pieces end where the contact status changes, so that these points are nodes and the mesh is graded towards them;
    elements are shared by the estimated errors, and half of them lie on the contact boundary in any case. The few
    meshes grow by factors of two and more, so that the last one costs more than all others together.

    Parameters
    ----------
    accuracy : float
        Largest error in the energy norm, relative to the solution; of half-planes also that of the tractions at the
        centres of elements, in the mean and, down to `LEAST_LOCAL`, element by element.
    """

    accuracy: float

    def error(self, solution: Solution) -> float:
        """Return the estimated error in the energy norm, of a half-plane those of its tractions if they are larger."""
        errors = StepErrors.of(solution)
        if errors.surface is None:
            return errors.energy
        local = (errors.surface.largest or 0.0) * self.accuracy / self._local_accuracy
        return max(errors.energy, errors.surface.in_the_mean or 0.0, local)

    @property
    def _local_accuracy(self) -> float:
        return max(self.accuracy, LEAST_LOCAL)

    def is_enough(self, solutions: Sequence[Solution]) -> bool:
        """Return whether the estimated error is small enough, and the elements in which the status changes short.

        Meshes that miss contact have no error.
        """
        worst = StepErrors.of(solutions[-1]).worst
        ends = worst.places.zone_ends(worst.missed_contacts)
        return is_enough([self.error(each) for each in solutions if not each.unfound_contacts], ends, self.accuracy)

    def following(self, level: Level, solutions: Sequence[Solution]) -> Level:
        """Return meshes whose density follows the estimated errors; copies share one, as fine as the worst needs."""
        errors = StepErrors.of(solutions[-1])
        densities = self._densities(level, errors)
        totals = [float(densities[key].sum()) for key in level.keys.values()]
        total = sum(totals)  # zero where bodies only move as wholes, and miss their contact
        shares = [float(density.sum()) / total if total > 0.0 else 1.0 / len(totals) for density in densities]
        spread = (SPREAD if errors.surface is None else HALF_PLANE_SPREAD) if any(level.touching) else 0.0
        is_accurate = self.error(solutions[-1]) <= self.accuracy
        n_elements = next_size(errors.worst.n_elements, total / (1.0 - spread), is_accurate=is_accurate)
        partitions = [
            better_partition(
                member.partition,
                density,
                int(np.ceil(n_elements * ((1.0 - spread) * share + spread / len(totals)))),
                cuts=zone_cuts(member.partition, member.ends),
                spread_over=touching,
                spread=spread,
                idle=None if errors.surface is None else _idle_elements(member.bodies[0]),
            )
            for member, density, share, touching in zip(
                level.members(errors.worst), densities, shares, level.touching, strict=True
            )
        ]
        return replace(level, partitions=tuple(partitions))

    def _densities(self, level: Level, errors: StepErrors) -> list[FloatArray]:
        """Return for each partition how many elements (n_elements,) should replace each one."""
        bodies = tuple(errors.worst.bodies.values())
        rate = error_rate(min(body.scene.discretisation.displacement_space(body.mesh).degree for body in bodies))
        worst = level.at_worst(errors.required())
        of_bodies = np.concatenate([worst[key] for key in level.keys.values()])
        needed = needed_elements(of_bodies, rate, (SAFETY * self.accuracy) ** 2 * errors.unit)
        if errors.surface is not None:
            allowed = SAFETY * self.accuracy * errors.surface.total
            needed = np.maximum(needed, needed_elements(errors.surface.errors, MEAN_RATE, allowed))
            needed = np.maximum(needed, _needed_locally(errors.surface, LOCAL_SAFETY * self._local_accuracy))
            needed = _gradual(needed, bodies[0].mesh)
        ends = np.cumsum([len(worst[key]) for key in level.keys.values()])[:-1]
        return level.at_worst(np.split(needed, ends))


def is_enough(errors: Sequence[float], ends: Iterable[ZoneEnd], accuracy: float) -> bool:
    """Return whether the last estimated error is small enough, and the elements in which the status changes short.

    Tractions there behave like square roots; an element of length h leaves a relative error of about h / (3 l) in a
    contact zone of length l. The energy hardly notices.
    """
    if not errors or errors[-1] > accuracy:
        return False
    if sum(error <= accuracy for error in errors) > MOST_FOR_TRANSITIONS:
        return True
    longest = TRANSITION * accuracy
    return all(end.mesh.lengths[end.element] <= longest * end.zone_length for end in ends)


def error_rate(degree: int) -> int:
    """Return the power of element lengths in the squared energy error of displacements of a degree p: 2 p + 1.

    On a half-plane displacements are means, of degree 0, and tractions constant, which leaves the error of degree 1.
    """
    return 2 * max(degree, 1) + 1


def needed_elements(errors: FloatArray, rate: int, allowed: float) -> FloatArray:
    """Return how many elements should replace each one, so that the fewest leave a sum of errors that is allowed.

    An error on an element cut into m falls like m**-rate; the smallest sum over a given number of elements has m
    proportional to the error to the power of 1 / (rate + 1).
    """
    density = np.asarray(errors ** (1.0 / (rate + 1)))
    return density * (float(density.sum()) / allowed) ** (1.0 / rate) if allowed > 0.0 else density


def _needed_locally(surface: SurfaceErrors, allowed: float) -> FloatArray:
    """Return how many elements should replace each one of a half-plane, so that its own error is allowed.

    The worst elements may stay as they are where they are no more than an allowed share of all.
    """
    errors, lengths = surface.local, surface.lengths
    order = np.argsort(-errors)
    is_short = np.cumsum(lengths[order]) <= allowed * float(lengths[errors > 0.0].sum())
    errors = errors.copy()
    errors[order[is_short]] = 0.0
    return np.asarray((errors / allowed) ** (1.0 / MEAN_RATE))


def _gradual(density: FloatArray, mesh: BoundaryMesh) -> FloatArray:
    """Raise densities on a half-plane until wanted lengths grow by no more than `LENGTH_GROWTH` of the distance."""
    lengths, place = mesh.lengths, mesh.centres[:, 0]
    distance = np.maximum(np.abs(place[:, None] - place) - 0.5 * lengths, 0.0)
    wanted = np.min(lengths / np.maximum(density, LEAST_DENSITY) + LENGTH_GROWTH * distance, axis=1)
    return np.asarray(lengths / wanted)


def _idle_elements(half_plane: SolvedBody) -> BoolArray:
    """Return which elements (n_elements,) of a half-plane carry no tractions."""
    return np.asarray(~half_plane.boundary.traction.any(axis=1))


def next_size(n_elements: int, needed: float, *, is_accurate: bool) -> float:
    """Return the number of elements of the next mesh: those needed, or a step towards them.

    Parameters
    ----------
    n_elements : int
        Of the last mesh.
    needed : float
    is_accurate : bool
        Whether the last mesh is fine enough but where the status changes.
    """
    smallest = 1.0 if is_accurate else SMALLEST_GROWTH
    return float(np.clip(needed, smallest * n_elements, LARGEST_GROWTH * n_elements))
