"""Quantities of solutions that several cases compare with known ones."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.reference import PartialSlip
from bemkit.results.solution import Solution

Exact: TypeAlias = Callable[[FloatArray], FloatArray]
"""A known field as a function of x, or of the radius."""


def contact_length(solution: Solution) -> float:
    """Return the length in contact of the first contact [m]."""
    return float(solution.contacts[0].contact_length)


def half_length(solution: Solution) -> float:
    """Return half the length in contact of the first contact [m]."""
    return 0.5 * contact_length(solution)


def peak_pressure(solution: Solution) -> float:
    """Return the largest pressure in the first contact [Pa]."""
    return float(solution.contacts[0].peak_pressure)


def status_ends(solution: Solution, status: str = "separated") -> list[float]:
    """Return the positions [m] along x where a status begins or ends, from left to right."""
    return sorted(place.x for place in solution.transitions if status in (place.from_status, place.to_status))


def half_stuck(solution: Solution) -> float:
    """Return half the length of the stick zone [m]."""
    ends = status_ends(solution, "stick")
    return 0.5 * (ends[-1] - ends[0])


def uniform_error(values: FloatArray, expected: float) -> float:
    """Return the largest relative error of values that should all be the same."""
    return float(np.abs(values / expected - 1.0).max())


def largest_error(values: FloatArray, expected: FloatArray) -> float:
    """Return the largest error relative to the largest known value."""
    return float(np.abs(values - expected).max() / np.abs(expected).max())


def radial_error(solution: Solution, exact: Exact) -> float:
    """Return the largest error of the radial displacement of the boundary."""
    points = solution.boundary.points
    radius = np.hypot(*points.T)
    return largest_error(np.sum(solution.boundary.displacement * points, axis=1) / radius, exact(radius))


def pressure_error(solution: Solution, exact: Exact) -> float:
    """Return the error of the pressure at the contact nodes in the L2 norm."""
    return _mean_error(solution, -solution.contact.sigma_n, exact(solution.contact.x))


def shear_error(solution: Solution, exact: PartialSlip) -> float:
    """Return the error of the size of the shear traction at the contact nodes in the L2 norm."""
    return _mean_error(solution, np.abs(solution.contact.sigma_t), exact.traction(solution.contact.x))


def _mean_error(solution: Solution, values: FloatArray, expected: FloatArray) -> float:
    weight = solution.contact.weight
    return float(np.sqrt(weight @ (values - expected) ** 2 / (weight @ expected**2)))


def lost_in_last_cycle(solution: Solution) -> float:
    """Return the dissipation [J/m] of the last cycle: of all steps but the first and the first fifth of the others."""
    loading = solution.loading
    if loading is None:
        raise InputError("the solution has no load history: give steps")
    return loading.total(1 + (loading.n_steps - 1) // 5).dissipation
