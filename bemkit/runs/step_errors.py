"""Estimated errors of all load steps on one mesh, for the next mesh."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.results.solution import Solution
from bemkit.results.surface_errors import SurfaceErrors


@dataclass(frozen=True, eq=False)
class StepErrors:
    """The largest errors of all steps on each element.

    All are relative to the largest energy among the steps, since that of an unloaded body is zero.

    Parameters
    ----------
    steps : sequence of Solution
        On one mesh of each body.
    """

    steps: Sequence[Solution]

    @classmethod
    def of(cls, solution: Solution) -> StepErrors:
        """Return the errors of all finished steps of a solution; a single load is one step."""
        ends: list[Any] = [] if solution.loading is None else [step.end for step in solution.loading.steps]
        return cls(ends or [solution])

    @cached_property
    def unit(self) -> float:
        """Scale of the squared energy-norm error [J/m]."""
        return max(step.error_unit for step in self.steps)

    @cached_property
    def bodies(self) -> list[FloatArray] | None:
        """(n_elements,) arrays [J/m]: squared errors in the energy norm of each body; None without an estimate."""
        errors = [[body.element_errors for body in step.bodies.values()] for step in self.steps]
        known = [[body_errors for body_errors in of_step if body_errors is not None] for of_step in errors]
        if any(len(body_errors) < len(each) for body_errors, each in zip(known, errors, strict=True)):
            return None
        return [np.max(of_body, axis=0) for of_body in zip(*known, strict=True)]

    def required(self) -> list[FloatArray]:
        """Return the errors of each body.

        Raises
        ------
        InputError
            Without an estimate.
        """
        if self.bodies is None:
            raise InputError("collocation has no error estimate: choose a Galerkin discretisation")
        return self.bodies

    @property
    def energy(self) -> float:
        """Relative error in the energy norm; zero for bodies at rest or in rigid motion, infinite without an estimate.

        Infinite, too, without an energy to which it is relative.
        """
        if self.bodies is None:
            return float("inf")
        squared = sum(float(body_errors.sum()) for body_errors in self.bodies)
        if max(squared, self.unit) <= max(step.energy_of_round_off for step in self.steps):
            return 0.0
        return float(np.sqrt(squared / self.unit)) if self.unit > 0.0 else float("inf")

    @cached_property
    def worst(self) -> Solution:
        """The step with the largest error, at whose places of change a mesh is cut; without an estimate the last."""
        if len(self.steps) == 1 or self.bodies is None:
            return self.steps[-1]
        totals = [
            sum(float(body.element_errors.sum()) for body in step.bodies.values() if body.element_errors is not None)
            for step in self.steps
        ]
        return self.steps[int(np.argmax(totals))]

    @cached_property
    def surface(self) -> SurfaceErrors | None:
        """Errors of the tractions of a half-plane that is the only body; None of other bodies."""
        if len(self.worst.bodies) > 1:
            return None
        errors = [step.body.surface_errors for step in self.steps]
        known = [each for each in errors if each is not None]
        surface_errors = self.worst.body.surface_errors
        return None if surface_errors is None else surface_errors.at_worst(known)


def in_which_step(solution: Solution) -> str:
    """Return the name of the step after an error in a message; empty for a single load."""
    return "" if solution.stated.n_steps == 1 else " in one of the steps"
