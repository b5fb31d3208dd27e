"""From one load step to the next: slip from the last converged state, smaller increments where a jump fails, work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property, partial
from itertools import pairwise
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.contact.problem import ContactProblem
from bemkit.model.units import Units
from bemkit.results.load_history import StepWork
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, ContactSolver, Status, StepRecord, solve

MOST_HALVINGS = 6
"""How often an increment is halved before a step is given up."""
MOST_LAWS = 60
"""Solves of one increment under a law that depends on its slip."""
_SETTLED = 1e-10
"""Change of such a law, relative to the largest bound, up to which it has converged."""

_HOPELESS = (Status.UNSOLVABLE_LOAD, Status.TOO_FAR, Status.TOO_COSTLY)
"""Failures that smaller increments do not change."""
_UNDECIDED = (Status.MAX_STEPS, Status.STALLED, Status.CYCLING, Status.SINGULAR)
"""Failures that may be the driver's, or a collapse."""

Callback = Callable[[StepRecord], None] | None


class StepModel(Protocol):
    """The members of a model that a load history needs; `Model` and `AssembledModel` have them."""

    @property
    def problem(self) -> ContactProblem:
        """The problem under the loads of the step; slip counts from the undeformed bodies."""

    @property
    def units(self) -> Units:
        """The physical size of one dimensionless unit."""

    @property
    def solver(self) -> ContactSolver:
        """The driver."""

    @property
    def has_body_forces(self) -> bool:
        """Whether something acts inside a body."""

    def acting(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return the forces of loads and supports, and the displacements on which they work."""


@dataclass(frozen=True, eq=False)
class Standing:
    """The end of an increment.

    Parameters
    ----------
    state : ContactState
        Dimensionless.
    motion : SlipHistory
    gap : (n_contact,) array
        Dimensionless.
    acts : callable
        () -> the forces and displacements of `StepModel.acting` there; a single zero each at rest.
    """

    state: ContactState
    motion: SlipHistory
    gap: FloatArray
    acts: Callable[[], tuple[FloatArray, FloatArray]]

    @cached_property
    def acting(self) -> tuple[FloatArray, FloatArray]:
        """(n,) arrays [N/m], [m]: the forces of loads and supports, and the displacements on which they work."""
        return self.acts()

    @classmethod
    def at_rest(cls, model: StepModel) -> Standing:
        """Return the state before any load, with obstacles that overlap with the body still at its surface."""
        n = model.problem.n_contact
        return cls(_no_state(n), SlipHistory.at_rest(n), np.maximum(model.problem.gap, 0.0), _nothing)

    @classmethod
    def under(cls, model: StepModel, state: ContactState, motion: SlipHistory) -> Standing:
        """Return the end of a step of a model."""
        return cls(state, motion, model.problem.gap, partial(model.acting, state))

    def work_from(self, before: Standing, model: StepModel) -> StepWork:
        """Return the work from the end of the increment before to this one, by the trapezoidal rule."""
        units = model.units
        unit = units.stress * units.displacement * units.length
        weights = 0.5 * unit * model.problem.body.weights
        sigma = weights[:, None] * (before.state.traction + self.state.traction)
        moved = self.state.displacement - before.state.displacement
        with np.errstate(invalid="ignore"):  # infinite gaps, whose nodes carry nothing
            approached = np.where(np.isfinite(self.gap), self.gap - before.gap, 0.0)
        # at a node that opens or closes the traction is not that of the trapezoidal rule: not counted as dissipation
        is_held = (before.state.traction != 0.0).any(axis=1) & (self.state.traction != 0.0).any(axis=1)
        of_friction = -sigma[:, 1] * moved[:, 1]
        dissipation = max(float(of_friction[is_held].sum()), 0.0)
        along_slip = 2.0 * weights * self.state.traction[:, 1] * moved[:, 1]
        (forces_before, displacements_before), (forces, displacements) = before.acting, self.acting
        of_forces = 0.5 * float((forces_before + forces) @ (displacements - displacements_before))
        return StepWork(
            external_work=of_forces + float(sigma[:, 0] @ approached),
            dissipation=dissipation,
            increment_work=float(sigma[:, 0] @ (approached - moved[:, 0])) + float(of_friction.sum()) - dissipation,
            friction_gain=float(np.maximum(along_slip, 0.0).sum()),
        )


@dataclass(frozen=True, eq=False)
class ReachedStep:
    """Result of the increments to a load step.

    Parameters
    ----------
    path : Path
    problem : ContactProblem
        Of the last increment, slip counting from the one before, the law that of its slip.
    result : ContactSolution
        Of the last increment, with the records and linear solves of all; its message says what was done.
    ends : tuple of Standing
        Of the increments that converged.
    """

    path: Path
    problem: ContactProblem
    result: ContactSolution
    ends: tuple[Standing, ...]

    @property
    def end(self) -> Standing:
        """The end of the last increment that converged."""
        return (self.path.start, *self.ends)[-1]

    @property
    def work(self) -> StepWork:
        """The work up to that end."""
        stands = pairwise((self.path.start, *self.ends))
        return sum((end.work_from(before, self.path.model) for before, end in stands), StepWork())


@dataclass(frozen=True, eq=False)
class Path:
    """The way from the loads of one step to those of the next.

    Parameters
    ----------
    model : StepModel
        Of the step.
    start : Standing
        Where the step before has ended, or rest.
    time : float [s]
        At the end of the step.
    before : StepModel, optional
        Of the step before; without one there is a single increment.
    between : callable, optional
        Share of the way -> the problem there.
    """

    model: StepModel
    start: Standing
    time: float
    before: StepModel | None
    between: Callable[[float], ContactProblem]

    def time_at(self, share: float) -> float:
        """Return the time at a share of the way."""
        begin = self.start.motion.time
        return self.time if share == 1.0 else begin + share * (self.time - begin)

    def standing(self, problem: ContactProblem, share: float, state: ContactState, motion: SlipHistory) -> Standing:
        """Return the end of an increment."""
        before = self.before if share < 1.0 else None
        return Standing(state, motion, problem.gap, partial(_acting, self.model, before, share, state))


def reach(path: Path, guess: ContactState | None = None, callback: Callback = None) -> ReachedStep:
    """Go from the load of one step to that of the next one, in smaller increments where a jump does not converge.

    Parameters
    ----------
    path : Path
    guess : ContactState, optional
        Where to start the first step from; by default all nodes stick.
    callback : callable, optional

    Returns
    -------
    ReachedStep
        Converged under the load of the step, or with the failure of the last and smallest increment. An increment that
        fails is halved; after one that converges the next is twice as large.

    Notes
    -----
    Loads that nothing can balance are found by a linear programme before any step, see `bemkit.contact.solvability`,
    and are not approached. Loads that contact can balance make a convex set, so that without friction there is no
    collapse between two of them: an increment that fails has stalled. With Coulomb friction, whose slip does not
    dilate, the programme gives an upper bound: bodies may give way below it, and this function does not decide which of
    the two has happened.
    """
    reached, increment, end = 0.0, 1.0, path.start
    ends: tuple[Standing, ...] = ()
    records: tuple[StepRecord, ...] = ()
    is_first = path.before is None
    while True:
        target = min(reached + increment, 1.0)
        problem = path.between(target)
        if not is_first:
            problem = replace(problem, reference_slip=end.state.u_t)
        words = "" if target == 1.0 and not records else f"increment to {target:.4g} of the step"
        recorder = _Recorder(records, words, callback)
        attempt = _attempt(path, problem, end, path.time_at(target), guess if is_first else end.state, recorder)
        records, result = attempt.result.history, attempt.result
        if result.is_converged:
            end = path.standing(problem, target, result.state, attempt.motion)
            reached, ends, increment = target, (*ends, end), 2.0 * increment
            if reached == 1.0:
                break
            _ = end.acting  # now, while a compressed body still holds this response
        elif is_first or result.status in _HOPELESS or target - reached <= 0.5**MOST_HALVINGS:
            break
        else:
            increment = 0.5 * (target - reached)
    words = result.message
    if result.is_converged and len(ends) > 1:
        words += f" The jump to this load stalled; {len(ends)} increments in its place led there."
    elif not is_first and result.status in _UNDECIDED:
        bound = "" if problem.law.is_frictionless else ", but friction may give way before that does"
        words = (
            f"{Status.LOAD_NOT_REACHED.value} Increments down to {target - reached:.2g} of the step led to "
            f"{reached:.3g} of it. The static programme finds no collapse under this load{bound}. The last increment "
            f"ended {result.status.name.lower().replace('_', ' ')}: {words}"
        )
        result = replace(result, status=Status.LOAD_NOT_REACHED)
    return ReachedStep(path, attempt.problem, replace(result, message=words), ends)


@dataclass(frozen=True, eq=False)
class _Attempt:
    problem: ContactProblem
    result: ContactSolution
    motion: SlipHistory


def _attempt(
    path: Path,
    problem: ContactProblem,
    end: Standing,
    time: float,
    start: ContactState | None,
    recorder: _Recorder,
) -> _Attempt:
    """Solve one increment; under a law that depends on its slip, until slip and law agree."""
    law, unit = problem.law, path.model.units.displacement
    motion = end.motion.followed(time, np.zeros(problem.n_contact), np.zeros(problem.n_contact, bool))
    for _ in range(MOST_LAWS):
        present = replace(problem, law=law.at_slip(motion)) if law.needs_history else problem
        result = recorder.solved(present, path.model.solver, start)
        if not result.is_converged:
            return _Attempt(present, result, motion)
        slip = (result.state.u_t - problem.slip_origin) * unit
        motion = end.motion.followed(time, slip, result.node_status != NodeStatus.SEPARATED)
        if not law.needs_history:
            return _Attempt(present, result, motion)
        sigma_n = np.minimum(result.state.sigma_n, 0.0)
        bounds = [of_slip.bound(sigma_n) for of_slip in (present.law, law.at_slip(motion))]
        if np.abs(bounds[1] - bounds[0]).max(initial=0.0) <= _SETTLED * np.abs(bounds[0]).max(initial=0.0):
            return _Attempt(present, result, motion)
        start = result.state
        recorder = recorder.after(result)
    words = f"{Status.STALLED.value} [the friction law and the slip on which it depends do not come to agree]"
    return _Attempt(present, replace(result, status=Status.STALLED, message=words), motion)


@dataclass(frozen=True)
class _Recorder:
    """Numbers the records and linear solves of a solve after those of the solves before."""

    records: tuple[StepRecord, ...]
    words: str
    callback: Callback

    def after(self, result: ContactSolution) -> _Recorder:
        return replace(self, records=result.history)

    def solved(self, problem: ContactProblem, solver: ContactSolver, start: ContactState | None) -> ContactSolution:
        records = self.records
        first, solves_before = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)

        def renumbered(record: StepRecord) -> StepRecord:
            if not records and not self.words:
                return record
            message = "; ".join(filter(None, (self.words, record.message)))
            total = solves_before + record.linear_solves
            return replace(record, step=first + record.step, linear_solves=total, message=message)

        def report(record: StepRecord) -> None:
            if self.callback is not None:
                self.callback(renumbered(record))

        if problem.n_contact:
            result = solve(problem, solver, start=start, throw=False, callback=report)
        else:
            from bemkit.model.untouched_body import certified

            result = certified(problem.body, report)
        history = (*records, *(renumbered(record) for record in result.history))
        steps = history[-1].step if history else 0
        return replace(result, history=history, steps=steps, linear_solves=solves_before + result.linear_solves)


def _acting(
    model: StepModel, before: StepModel | None, share: float, state: ContactState
) -> tuple[FloatArray, FloatArray]:
    """Return `StepModel.acting` at a share of the way from the loads of the step before, in which it is affine."""
    forces, displacements = model.acting(state)
    if before is None:
        return forces, displacements
    of_before = before.acting(state)
    return (1.0 - share) * of_before[0] + share * forces, (1.0 - share) * of_before[1] + share * displacements


def _nothing() -> tuple[FloatArray, FloatArray]:
    return np.zeros(1), np.zeros(1)


def _no_state(n_contact: int) -> ContactState:
    return ContactState(np.zeros((n_contact, 2)), np.zeros((n_contact, 2)))
