"""From one load step to the next: slip from the last converged state, smaller increments if a jump fails, work."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.contact.problem import ContactProblem
from bemkit.geometry.vectors import norms
from bemkit.model.model import Model
from bemkit.results.solution import continued
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, ContactSolver, Status, StepRecord, solve
from bemkit.solvers.fallbacks import Fallbacks
from bemkit.stopwatch import announce

if TYPE_CHECKING:
    from bemkit.results.load_history import StepWork

MOST_HALVINGS = 6
"""Number of times that an increment is halved before the step fails."""
MOST_LAWS = 60
"""Largest number of solves of one increment under a law that depends on its slip."""
_LEAST_SHARE = 1e-3
"""Least share of the way to the slip found that the next guess goes."""
_SETTLED = 1e-10
"""Change of a converged law, relative to the largest bound."""

_RESTED = 1e-6
"""Slip of a node that rested, relative to its slip in the next increment."""
_FAST, _SLOW = 10, 20
"""The next increment is twice as large after at most this number of steps of the solver, and half as large after more
than the second number."""

_NOT_RETRIED = (Status.UNSOLVABLE_LOAD, Status.CLOSED_VOLUME, Status.TOO_FAR, Status.TOO_COSTLY)
"""Failures that smaller increments cannot cure."""
_RETRIED = (Status.MAX_STEPS, Status.STALLED, Status.CYCLING, Status.SINGULAR)
"""Failures that may come from the solver or from a collapse."""

Callback = Callable[[StepRecord], None] | None


@dataclass(frozen=True, eq=False)
class IncrementEnd:
    """The end of an increment.

    Parameters
    ----------
    state : ContactState
        Dimensionless.
    motion : SlipHistory
    gap : (n_contact,) array
        Dimensionless.
    loads : tuple of (float, Model)
        The models whose loads act there, each with its share; none at rest.
    dragged : (n_contact,) array
        How far obstacles have travelled along the tangents in this increment, dimensionless.
    bound : (n_contact,) array
        Largest friction there, dimensionless.
    """

    state: ContactState
    motion: SlipHistory
    gap: FloatArray
    loads: tuple[tuple[float, Model], ...] = ()
    obstacle_slip: FloatArray | float = 0.0
    bound: FloatArray | float = 0.0

    @property
    def share(self) -> float:
        """The share of the way of its step; zero at rest."""
        return self.loads[-1][0] if self.loads else 0.0

    @cached_property
    def acting(self) -> tuple[FloatArray, FloatArray]:
        """(n,) arrays [N/m], [m]: the forces of loads and supports, and the displacements on which they work."""
        forces, displacements = np.zeros(1), np.zeros(1)
        for share, model in self.loads:  # both are affine in the loads
            of_model = model.acting(self.state)
            forces, displacements = forces + share * of_model[0], displacements + share * of_model[1]
        return forces, displacements

    @classmethod
    def at_rest(cls, model: Model) -> IncrementEnd:
        """Return the state before any load, with obstacles that overlap with the body still at its surface."""
        n = model.problem.n_contact
        rest = ContactState(np.zeros((n, 2)), np.zeros((n, 2)))
        return cls(rest, SlipHistory.at_rest(n), np.maximum(model.problem.gap, 0.0))

    @classmethod
    def under(cls, model: Model, state: ContactState, motion: SlipHistory) -> IncrementEnd:
        """Return the end of a step of a model."""
        problem = model.problem
        if problem.law.needs_history:
            problem = problem.with_law(problem.law.at_slip(motion))
        return cls(state, motion, problem.gap, ((1.0, model),), bound=_bound(problem, state))

    def work_from(self, before: IncrementEnd, model: Model) -> StepWork:
        """Return the work from the end of the increment before to this one, by the trapezoidal rule."""
        from bemkit.results.load_history import StepWork

        units = model.units
        unit = units.stress * units.displacement * units.length * model.depth
        weights = 0.5 * unit * model.problem.body.weights
        sigma = weights[:, None] * (before.state.traction + self.state.traction)
        moved = self.state.displacement - before.state.displacement
        with np.errstate(invalid="ignore"):  # infinite gaps, whose nodes carry nothing
            approached = np.where(np.isfinite(self.gap), self.gap - before.gap, 0.0)
        # at a node that opens or closes the traction is not that of the trapezoidal rule: not counted as dissipation
        is_held = (before.state.traction != 0.0).any(axis=1) & (self.state.traction != 0.0).any(axis=1)
        slip = moved[:, 1] - self.obstacle_slip
        of_friction = -sigma[:, 1] * slip
        # drawn touching, a node is closed before any load
        rests = before.gap - before.state.displacement[:, 0] <= _RESTED * norms(moved)
        rests &= (self.state.traction != 0.0).any(axis=1)
        dissipation = max(float(of_friction[is_held | rests].sum()), 0.0)
        # a node that rested, or slipped the other way, slips under no less than the smaller bound of both ends
        friction = np.minimum(-self.state.traction[:, 1] * slip, before.bound * np.abs(slip))
        missed = weights * (friction + before.state.traction[:, 1] * slip)
        along_slip = 2.0 * weights * self.state.traction[:, 1] * slip
        (forces_before, displacements_before), (forces, displacements) = before.acting, self.acting
        of_forces = 0.5 * model.depth * float((forces_before + forces) @ (displacements - displacements_before))
        return StepWork(
            external_work=of_forces + float(sigma[:, 0] @ approached + np.sum(sigma[:, 1] * self.obstacle_slip)),
            dissipation=dissipation,
            increment_work=float(sigma[:, 0] @ (approached - moved[:, 0])) + float(of_friction.sum()) - dissipation,
            friction_gain=float(np.maximum(along_slip, 0.0).sum()),
            missed_dissipation=float(np.maximum(missed[is_held], 0.0).sum()),
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
    ends : tuple of IncrementEnd
        Of the increments that converged.
    """

    path: Path
    problem: ContactProblem
    result: ContactSolution
    ends: tuple[IncrementEnd, ...]

    @property
    def end(self) -> IncrementEnd:
        """The end of the last increment that converged."""
        return (self.path.start, *self.ends)[-1]

    @property
    def work(self) -> StepWork:
        """The work up to that end."""
        from bemkit.results.load_history import StepWork

        pairs = pairwise((self.path.start, *self.ends))
        return sum((end.work_from(before, self.path.model) for before, end in pairs), StepWork())


@dataclass(frozen=True, eq=False)
class Path:
    """The way from the loads of one step to those of the next.

    Parameters
    ----------
    model : Model
        Of the step.
    start : IncrementEnd
        Where the step before has ended, or rest.
    time : float [s]
        At the end of the step.
    before : Model, optional
        Of the step before; without one there is a single increment.
    factors : (float, float), optional
        Load factors before and at the end of the step [-], where the scene states some.
    """

    model: Model
    start: IncrementEnd
    time: float
    before: Model | None
    factors: tuple[float, float] | None = None

    def time_at(self, share: float) -> float:
        """Return the time at a share of the way [s]."""
        begin = self.start.motion.time
        return self.time if share == 1.0 else begin + share * (self.time - begin)

    def name_of(self, share: float) -> str:
        """Return the load factor at a share of the way in words, or the time where there is none."""
        if self.factors is None:
            return f"t = {self.time_at(share):.6g}"
        first, last = self.factors
        return f"load factor {first + share * (last - first):.6g}"

    def problem_at(self, share: float) -> ContactProblem:
        """Return the problem at a share of the way."""
        return self.model.problem if self.before is None else self.model.between(self.before, share)

    @cached_property
    def _travel(self) -> FloatArray | float:
        """(n_contact,) array: how far obstacles travel along the tangents on the whole way, dimensionless."""
        if self.before is None:
            return 0.0
        from bemkit.model.obstacle_travel import obstacle_travel

        return obstacle_travel(self.before.prepared, self.model.prepared) / self.model.units.displacement

    def obstacle_slip(self, start: IncrementEnd, share: float) -> FloatArray | float:
        """Return the travel of obstacles from the end of an increment to a share of the way."""
        return self._travel * (share if start is self.start else share - start.share)

    def end_of(self, attempt: _Attempt, share: float, start: IncrementEnd) -> IncrementEnd:
        """Return the end of an increment that has begun at another end."""
        state, motion, gap = attempt.result.state, attempt.motion, attempt.problem.gap
        obstacle_slip, bound = self.obstacle_slip(start, share), _bound(attempt.problem, state)
        if self.before is None or share == 1.0:
            return IncrementEnd(state, motion, gap, ((1.0, self.model),), obstacle_slip, bound)
        return IncrementEnd(state, motion, gap, ((1.0 - share, self.before), (share, self.model)), obstacle_slip, bound)


def advance(path: Path, guess: ContactState | None = None, callback: Callback = None) -> ReachedStep:
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
        Converged under the load of the step, or with the failure of the last and smallest increment.

    Notes
    -----
    An increment that fails is halved. After one that converges the next is twice as large if the solver took few steps,
    and half as large if it took many. Only the jump to the whole load may follow the whole path of solutions; solvers
    that begin anew, instead of where the last increment has ended, take part in the smallest increment only.

    Loads that nothing can balance are found by a linear programme before any step, see `bemkit.contact.solvability`,
    and are not approached. Loads that contact can balance make a convex set, so that without friction there is no
    collapse between two of them: an increment that fails has stalled. With Coulomb friction, whose slip does not
    dilate, the programme gives an upper bound: bodies may give way below it, and this function does not decide which of
    the two has happened.
    """
    # The first step from rest has no load to begin at: it is one jump.
    is_first, smallest = path.before is None, 0.5**MOST_HALVINGS
    increments = _Increments(path, callback)
    reached, increment, end = 0.0, 1.0, path.start
    ends: tuple[IncrementEnd, ...] = ()
    while True:
        target = min(reached + increment, 1.0)
        attempt = increments.attempt(
            target, end, guess if is_first else end.state, is_last=is_first or increment <= smallest
        )
        result = attempt.result
        if result.is_converged:  # go on from there, faster or slower by the number of steps
            end = path.end_of(attempt, target, end)
            reached, ends = target, (*ends, end)
            if reached == 1.0:
                break
            increment *= 2.0 if attempt.n_steps <= _FAST else 0.5 if attempt.n_steps > _SLOW else 1.0
            increment = max(increment, smallest)
            _ = end.acting  # now, while a compressed body still holds this response
            announce(f"{path.name_of(reached)} reached")
        elif is_first or result.status in _NOT_RETRIED or target - reached <= smallest:
            break
        else:  # try half of the way
            increment = 0.5 * (target - reached)
            announce(f"{path.name_of(target)} failed, {path.name_of(reached + increment)} is next")
    if result.is_converged and len(ends) > 1:
        message = f"{result.message} The jump to this load stalled; {len(ends)} increments reached it."
        result = replace(result, message=message)
    elif not is_first and result.status in _RETRIED:
        result = _not_reached(path, attempt, reached, target)
    return ReachedStep(path, attempt.problem, result, ends)


def _not_reached(path: Path, attempt: _Attempt, reached: float, target: float) -> ContactSolution:
    """Return the result of the last increment with a status and a message on the load that was not reached."""
    result = attempt.result
    bound = "" if attempt.problem.law.is_frictionless else ", but friction may give way below it"
    message = (
        f"{Status.LOAD_NOT_REACHED.value} Increments reached {path.name_of(reached)}, not {path.name_of(target)}. "
        f"The linear programme of rigid bodies finds no collapse under this load{bound}. The last increment "
        f"ended {result.status.name.lower().replace('_', ' ')}: {result.message}"
    )
    return replace(result, status=Status.LOAD_NOT_REACHED, message=message)


@dataclass(frozen=True, eq=False)
class _Attempt:
    """One increment: the problem, its result with the records of all increments so far, and the steps it took."""

    problem: ContactProblem
    result: ContactSolution
    motion: SlipHistory
    n_steps: int


@dataclass(eq=False)
class _Increments:
    """Solves increments of one load step, and keeps the records of all of them."""

    path: Path
    callback: Callback
    records: tuple[StepRecord, ...] = field(default=(), init=False)

    def attempt(self, target: float, end: IncrementEnd, start: ContactState | None, *, is_last: bool) -> _Attempt:
        """Solve the increment to a share of the way; under a law that depends on its slip until slip and law agree."""
        path, n_before = self.path, len(self.records)
        problem, time = path.problem_at(target), path.time_at(target)
        if path.before is not None:
            problem = replace(problem, reference_slip=end.state.u_t + path.obstacle_slip(end, target))
        words = "" if target == 1.0 and not n_before else f"increment to {path.name_of(target)}"
        law, unit = problem.law, path.model.units.displacement
        tried = end.motion.followed(time, np.zeros(problem.n_contact), np.zeros(problem.n_contact, bool))
        share, change = 1.0, np.zeros(problem.n_contact)
        for _ in range(MOST_LAWS):
            present = problem.with_law(law.at_slip(tried)) if law.needs_history else problem
            result = self._solved(present, start, words, is_last=is_last)
            n_steps = len(self.records) - n_before - 1
            if not result.is_converged:
                return _Attempt(present, result, tried, n_steps)
            slip = (result.state.u_t - problem.slip_origin) * unit
            motion = end.motion.followed(time, slip, result.node_status != NodeStatus.SEPARATED)
            if not law.needs_history or _agree(present.law.bound, law.at_slip(motion).bound, result.state):
                return _Attempt(present, result, motion, n_steps)
            # where friction rises with slip, iterates overshoot: Aitken's share of the way
            change, before = motion.last_slip - tried.last_slip, change
            if (turn := change - before) @ turn > 0.0 and before.any():
                share = float(np.clip(-share * (before @ turn) / (turn @ turn), _LEAST_SHARE, 1.0))
            tried = motion if share == 1.0 else tried.towards(motion, share)
            start = result.state
        words = f"{Status.STALLED.value} [the friction law and the slip on which it depends do not come to agree]"
        return _Attempt(present, replace(result, status=Status.STALLED, message=words), motion, n_steps)

    def _solved(
        self, problem: ContactProblem, start: ContactState | None, words: str, *, is_last: bool
    ) -> ContactSolution:
        """Solve a problem; return its result with the records and linear solves of all solves so far."""
        records, callback = self.records, self.callback

        def report(record: StepRecord) -> None:
            if callback is not None:
                callback(continued(records, (record,), words)[-1])

        if problem.n_contact:
            solver = _for_increments(self.path.model.solver, is_last=is_last) if records else self.path.model.solver
            result = solve(problem, solver, start=start, throw=False, callback=report)
        else:
            from bemkit.model.contact_free_body import certified

            result = certified(problem.body, report)
        self.records = continued(records, result.history, words)
        steps, solves = (self.records[-1].step, self.records[-1].linear_solves) if self.records else (0, 0)
        return replace(result, history=self.records, steps=steps, linear_solves=solves)


def _for_increments(solver: ContactSolver, *, is_last: bool) -> ContactSolver:
    """Return the solvers of an increment that follows a jump: those that go on from its start, at last springs, too."""
    if not isinstance(solver, Fallbacks):
        return solver
    return solver.without_whole_path() if is_last else solver.without_new_starts()


def _bound(problem: ContactProblem, state: ContactState) -> FloatArray:
    return problem.friction_bound(np.minimum(state.sigma_n, 0.0))


def _agree(
    bound: Callable[[FloatArray], FloatArray], following: Callable[[FloatArray], FloatArray], state: ContactState
) -> bool:
    """Whether the friction bound under which a state was found is that of its slip."""
    sigma_n = np.minimum(state.sigma_n, 0.0)
    before, after = bound(sigma_n), following(sigma_n)
    return bool(np.abs(after - before).max(initial=0.0) <= _SETTLED * np.abs(before).max(initial=0.0))
