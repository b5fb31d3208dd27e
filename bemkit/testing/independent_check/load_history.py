"""The independent check of a load history: the work in its last step."""

from __future__ import annotations

from typing import cast

import numpy as np

from bemkit.operators.linear_solvers import Tag
from bemkit.results.solution import Solution

LOST = 1e-6
"""Unexplained work in a load step by iterative linear solvers and long rigid motions, relative to the work."""
ROUND_OFF = 1e-12
"""Share, on top, of the work by which the displacement would strain a body of its own size: the last digits of sums of
forces, each of that size, which a body that is carried along has."""


def energy_fault(step: Solution) -> str:
    """Describe a fault of the work in the last step of a history: negative dissipation, or missing work."""
    if step.loading is None:
        return ""
    last = step.loading.steps[-1]
    energy = step.loading.steps[-2].elastic_energy if len(step.loading.steps) > 1 else 0.0
    work = last.work
    missing = work.external_work - (last.elastic_energy - energy) - work.dissipation - work.increment_work
    size = max(abs(value) for value in (last.elastic_energy, energy, *vars(work).values()))
    ends = [cast(Solution, each.end) for each in step.loading.steps[-2:]]
    allowed = LOST * size + ROUND_OFF * max(map(_work_of_motion, ends))
    if work.friction_gain > allowed:
        return f"friction acts along slip, which gives {work.friction_gain / size:.1e} of the work"
    if work.dissipation < 0.0:
        return f"friction gave back {-work.dissipation:.1e}"
    # stiffnesses of collocation are not symmetric: work and energy do not agree to round-off
    is_balanced = all(Tag.SYMMETRIC in body.map_tags for body in step.bodies.values())
    return f"{missing / size:.1e} of the work is missing" if is_balanced and abs(missing) > allowed else ""


def _work_of_motion(step: Solution) -> float:
    """Return ``E' |u|^2`` [J/m] of the largest displacement, of bodies that only move, too."""
    return max(
        body.scene.material.plane_modulus * float(np.abs(body.boundary.displacement).max()) ** 2
        for body in step.bodies.values()
    )
