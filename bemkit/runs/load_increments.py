"""Reach a load step in smaller increments where one jump stalls."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.model.assembled.model import AssembledModel
from bemkit.solvers.base import ContactSolution, ContactSolver, Status, StepRecord, solve

MOST_HALVINGS = 6
"""Times that an increment is halved before a step counts as out of reach."""

_HOPELESS = (Status.UNSOLVABLE_LOAD, Status.TOO_FAR, Status.TOO_COSTLY)
"""What smaller increments do not change."""


@dataclass(frozen=True, eq=False)
class ReachedStep:
    """Where the increments to a load step have led.

    Parameters
    ----------
    problem : ContactProblem
        Of the last increment, slip counting from the one before.
    result : ContactSolution
        Of the last increment, with the records and linear solves of all; its message says what was done.
    """

    problem: ContactProblem
    result: ContactSolution


def reach_load(
    before: AssembledModel,
    after: AssembledModel,
    start: ContactState,
    callback: Callable[[StepRecord], None] | None = None,
) -> ReachedStep:
    """Go from the load of one step to that of the next one, in halves where a jump does not converge.

    Parameters
    ----------
    before, after : AssembledModel
        The same bodies under the loads, given displacements and gaps of two steps; laws are those of the second.
    start : ContactState
        Certified under the first load. Slip counts from here, and from the end of each increment that converges.
    callback : callable, optional

    Returns
    -------
    ReachedStep
        Converged under the load of `after`, or how the last increment failed, the smallest that is tried. After an
        increment that converges the next one is twice as large.

    Notes
    -----
    Loads that contact can balance make a convex set, so that there is no collapse between two of them: an increment
    that fails has stalled. Loads that nothing can balance are found by the static programme before any step, see
    `bemkit.contact.solvability`, and are not approached.
    """
    reached, increment, state, n_increments = 0.0, 1.0, start, 0
    records: list[StepRecord] = []
    while True:
        target = min(reached + increment, 1.0)
        problem = between(before, after, target, state)
        result = _attempt(problem, after.prepared.assembly.solver, state, records, target, callback)
        records, failure = list(result.history), result
        if result.is_converged:
            reached, state, n_increments, increment = target, result.state, n_increments + 1, 2.0 * increment
            if reached == 1.0:
                break
        elif result.status in _HOPELESS or target - reached <= 0.5**MOST_HALVINGS:
            break
        else:
            increment = 0.5 * (target - reached)
    words = failure.message
    if failure.is_converged and n_increments > 1:
        words += f" The jump to this load stalled; {n_increments} increments in its place led there."
    elif not failure.is_converged and failure.status not in _HOPELESS:
        words += (
            f" Increments down to {target - reached:.2g} of the step led to {reached:.3g} of it. The static programme "
            "finds no collapse under this load: give load factors closer to each other."
        )
    return ReachedStep(problem, replace(failure, message=words))


def between(before: AssembledModel, after: AssembledModel, share: float, state: ContactState) -> ContactProblem:
    """Return the contact problem at a share of the way from one load to another, slip counting from a state.

    Notes
    -----
    Condensed loads, relative displacements that supports prescribe, and gaps are affine in what is given, so that these
    are interpolated, and no formula.
    """
    problem = replace(after.problem, reference_slip=state.u_t)
    if share == 1.0:
        return problem
    loads = [
        _blended(one.load, two.load, share) for one, two in zip(before.body.members, after.body.members, strict=True)
    ]
    body = after.body.under(loads, _blended(before.body.offset, after.body.offset, share))
    return replace(problem, body=body, gap=_blended(before.problem.gap, after.problem.gap, share))


def _blended(one: FloatArray, two: FloatArray, share: float) -> FloatArray:
    """Return values a share of the way from one to another; equal ones, infinite gaps among them, stay."""
    with np.errstate(invalid="ignore"):
        return np.where(one == two, two, one + share * (two - one))


def _attempt(
    problem: ContactProblem,
    solver: ContactSolver,
    start: ContactState,
    records: list[StepRecord],
    target: float,
    callback: Callable[[StepRecord], None] | None,
) -> ContactSolution:
    """Solve one increment; its records and linear solves follow those of the increments before."""
    first, spent = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)
    words = "" if target == 1.0 and not records else f"increment to {target:.4g} of the step"

    def following(record: StepRecord) -> StepRecord:
        message = "; ".join(filter(None, (words, record.message)))
        return replace(record, step=first + record.step, linear_solves=spent + record.linear_solves, message=message)

    def told(record: StepRecord) -> None:
        if callback is not None:
            callback(following(record))

    result = solve(problem, solver, start=start, throw=False, callback=told)
    history = (*records, *(following(record) for record in result.history))
    steps = history[-1].step if history else 0
    return replace(result, history=history, steps=steps, linear_solves=spent + result.linear_solves)
