"""The common loop of all solvers: steps, certificate, status, history."""

import math
from collections.abc import Callable
from dataclasses import dataclass, field, fields, replace
from enum import Enum
from typing import Protocol

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.body import ClosedVolume, ContactState, SingularResponse
from bemkit.contact.certificate import Certificate, certify
from bemkit.contact.problem import ContactProblem
from bemkit.contact.solvability import find_long_motion, find_unsolvable_load, needs_contact
from bemkit.errors import InputError, NoResultError, counted
from bemkit.interrupts import interruptible, raise_missed_interrupt
from bemkit.solvers.active_sets import ActiveSets, NodeStatus, contact_sets
from bemkit.solvers.newton import FloatingResponse, consistent_state, contact_free_response, with_least_slip


class Status(Enum):
    """Outcome of a solve; the value is a sentence of advice."""

    CONVERGED = "The state satisfies contact and friction to the tolerance."
    MAX_STEPS = "The steps ran out before the certificate was met; raise max_steps or start from a nearby solution."
    STALLED = (
        "The certificate no longer improves; try another solver, a larger rho, a nearby start or a looser tolerance."
    )
    CYCLING = (
        "The iterates repeat themselves; add solvers such as SolutionPath to Fallbacks, or try another one: "
        "the problem may have no solution, or several."
    )
    CLOSED_VOLUME = "Contact leaves an incompressible body no room; load less, or give a poisson_ratio of 0.499999."
    SINGULAR = "The body can move freely for every state of its contact nodes; hold it by its boundary conditions."
    UNSOLVABLE_LOAD = "No contact tractions can balance this load; change the load or hold the body."
    TOO_FAR = (
        "The load first moves the body so far to an obstacle that round-off hides the deformation; move body and "
        "obstacle together, so that they nearly touch."
    )
    INNER_FAILED = "An inner solve failed, for the reason given in the message; change the options of the inner solver."
    ACCURACY_NOT_REACHED = (
        "The state satisfies contact and friction on its mesh, but not the requested accuracy; allow more "
        "elements or more time, or request less."
    )
    LOAD_NOT_REACHED = "Ever smaller increments reached only a part of this load; load less, or give more load steps."
    UNFINISHED = (
        "The load history is incomplete; run its scene again with the same result file to resume from the "
        "last finished step."
    )
    TOO_COSTLY = (
        "This solver needs several responses for each contact node, which are expensive for this body; use "
        "SemismoothNewton, AugmentedLagrangian or FixedPoint."
    )
    MISSED_CONTACT = "The elements are too long to find the contact; use more elements there, or give an accuracy."
    NEGATIVE_ENERGY = (
        "The elastic energy is, or can become, negative, because the elements are too long for collocation; "
        "use more elements, at least two for the thickness of a thin body, or linear or quadratic Galerkin elements."
    )
    FINITE_SLIDING = "Contacts slide farther than small displacements describe; draw bodies where they come to rest."
    NOT_FINITE = "Numbers overflowed or are undefined; check stiffness, load and friction law for huge entries."


@dataclass(frozen=True, eq=False, kw_only=True)
class Iterate:
    """State of an iteration; solvers with more data derive their own iterates.

    Parameters
    ----------
    state : ContactState
        A response of the body.
    linear_solves : int
        Linear systems solved since `init`.
    ended : Status or None
        Reason why the solver cannot continue; None if it can.
    message : str
        Explanation of the reason, or a note on the step for the history.
    """

    state: ContactState
    linear_solves: int = 0
    ended: Status | None = None
    message: str = ""


class ContactSolver(Protocol):
    """A contact solver: frozen options and two pure functions.

    Solvers do not decide on convergence; `solve` does, by the certificate.
    """

    @property
    def max_steps(self) -> int:
        """Default largest number of steps in `solve`."""

    def init(self, problem: ContactProblem, start: ContactState) -> Iterate:
        """Return the first iterate.

        Parameters
        ----------
        problem : ContactProblem
        start : ContactState
            A response of the body.
        """

    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        """Return the next iterate.

        Parameters
        ----------
        problem : ContactProblem
        iterate : Iterate
            Result of `init` or `step` of the same solver.

        Raises
        ------
        SingularResponse
            If the body has no response; `solve` converts it to a status.
        """


@dataclass(frozen=True)
class StepRecord:
    """One row of the convergence table.

    Parameters
    ----------
    step : int
        Zero for the start.
    linear_solves : int
        Linear systems solved so far.
    certificate : Certificate
    relative_change : float
        ``max|u - u_previous| / max|u|``, the stopping criterion of the paper; infinite at the start.
    n_separated, n_stick, n_slip : int
        Number of nodes in each status.
    n_changed : int
        Number of nodes whose status changed in this step.
    message : str
        Note of the solver on the step.
    """

    step: int
    linear_solves: int
    certificate: Certificate
    relative_change: float
    n_separated: int
    n_stick: int
    n_slip: int
    n_changed: int
    message: str


@dataclass(frozen=True, eq=False)
class ContactSolution:
    """State, status and history of one call of `solve`.

    Parameters
    ----------
    state : ContactState
        Displacements and tractions; NaN if the solve ended before the first state.
    status : Status
    certificate : Certificate
        Certificate of `state`.
    node_status : (n_contact,) array of `NodeStatus` values
    steps, linear_solves : int
        Steps of the solver, and all linear systems including those at the start.
    message : str
        A sentence on the outcome.
    history : tuple of StepRecord
    """

    state: ContactState
    status: Status
    certificate: Certificate
    node_status: IntArray
    steps: int
    linear_solves: int
    message: str
    history: tuple[StepRecord, ...] = field(repr=False)

    @property
    def is_converged(self) -> bool:
        """Whether the status is CONVERGED."""
        return self.status is Status.CONVERGED

    def named(self, status: Status, reason: str) -> "ContactSolution":
        """Return the same outcome under another status, for a reason in words."""
        return replace(self, status=status, message=f"{status.value} [{reason}]")


class ContactFailure(NoResultError):  # noqa: N818 - an outcome of the mathematics, not an error of the program
    """A solve ended without a certified solution; `solution` is its last result."""

    def __init__(self, solution: ContactSolution) -> None:
        super().__init__(f"{solution.status.name}: {solution.message}")
        self.solution = solution


@interruptible()
def solve(
    problem: ContactProblem,
    solver: ContactSolver,
    *,
    start: ContactState | None = None,
    max_steps: int | None = None,
    tolerance: float = 1e-9,
    throw: bool = True,
    callback: Callable[[StepRecord], None] | None = None,
) -> ContactSolution:
    """Run a solver until the certificate is below the tolerance or the solver fails.

    Parameters
    ----------
    problem : ContactProblem
    solver : ContactSolver
    start : ContactState, optional
        Initial guess, in equilibrium or not. In the cold start, the default, all nodes are closed and stick.
    max_steps : int, optional
        By default that of the solver.
    tolerance : float
        Bound of all entries of the certificate.
    throw : bool
        Whether to raise an error if the solve does not converge.
    callback : callable, optional
        Called with each new `StepRecord`.

    Raises
    ------
    ContactFailure
        If `throw` and the status is not CONVERGED; its `solution` is the result.
    LawError
        If the friction law fails.
    ValueError
        If an argument is out of range.
    """
    limit = solver.max_steps if max_steps is None else max_steps
    if limit < 0:
        raise InputError(f"max_steps = {limit}; give zero or a positive number")
    if not tolerance >= 0.0:
        raise InputError(f"tolerance = {tolerance}; give zero or a positive number")
    solution = _Run(problem, solver, limit, tolerance, callback).finish(start)
    if throw and not solution.is_converged:
        raise ContactFailure(solution)
    return solution


def check_rho(name: str, rho: float | None) -> None:
    """Raise ValueError unless `rho` is None (automatic) or a positive finite number."""
    if rho is not None and not (math.isfinite(rho) and rho > 0.0):
        raise InputError(f"{name} = {rho}; give a positive number, or omit it for the automatic choice")


def check_max_steps(max_steps: int) -> None:
    """Raise ValueError unless `max_steps` is positive."""
    if max_steps < 1:
        raise InputError(f"max_steps = {max_steps}; give at least 1")


@dataclass(frozen=True)
class _Run:
    """One call of `solve`."""

    problem: ContactProblem
    solver: ContactSolver
    max_steps: int
    tolerance: float
    callback: Callable[[StepRecord], None] | None

    def finish(self, start: ContactState | None) -> ContactSolution:
        """Run the solver from a start to a status."""
        # no warnings of overflow: it ends in the status NOT_FINITE
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            try:
                if self.problem.body.lacks_room(self.problem.gap):
                    raise ClosedVolume
                contact_free = self.problem.for_all_laws("contact_free", self._contact_free_response)
                if contact_free is None and (unsolvable := find_unsolvable_load(self.problem)) is not None:
                    return self._without_state(Status.UNSOLVABLE_LOAD, unsolvable.description)
                iterate = self._without_contact(self._first(start, int(contact_free is not None)), contact_free)
            except SingularResponse as error:
                return self._without_state(_status_of(error), str(error))
            sets = contact_sets(self.problem, iterate.state)
            history = [self._record(iterate, sets, 0, float("inf"), 0)]
            while (status := self._status(iterate, history)) is None:
                raise_missed_interrupt()
                try:
                    following = self.solver.step(self.problem, iterate)
                except SingularResponse as error:
                    following = replace(iterate, ended=_status_of(error), message=str(error))
                if not following.state.is_finite:  # the state before is the last one of use
                    following = replace(iterate, linear_solves=following.linear_solves, ended=Status.NOT_FINITE)
                following = self._without_contact(following, contact_free)
                new_sets = contact_sets(self.problem, following.state)
                change = _relative_change(following.state, iterate.state)
                history.append(self._record(following, new_sets, len(history), change, new_sets.n_changed(sets)))
                iterate, sets = following, new_sets
            # where the travel to the obstacle hides the deformation, the certificate is relative to the travel
            may_travel = contact_free is None and status is not Status.MAX_STEPS
            if may_travel and (travel := find_long_motion(self.problem)) is not None:
                status, words = Status.TOO_FAR, f"the travel is {travel:.1e} times the deformation"
                iterate = replace(iterate, message=f"{words}; {iterate.message}".rstrip("; "))
            certificate = history[-1].certificate
            # choose among the positions that contact does not determine, unless another contact forbids it
            if status is Status.CONVERGED and sets.is_closed.any():
                state = with_least_slip(self.problem, iterate.state, sets)
                moved = certificate if state is iterate.state else certify(self.problem, state)
                if moved.is_below(self.tolerance):
                    iterate, certificate = replace(iterate, state=state), moved
                    sets = contact_sets(self.problem, state)
        return self._solution(iterate, status, sets, certificate, history)

    def _contact_free_response(self) -> FloatingResponse | None:
        return None if needs_contact(self.problem) else contact_free_response(self.problem.body)

    def _first(self, start: ContactState | None, n_before: int) -> Iterate:
        """Return the first iterate, with all linear solves counted."""
        if start is None:
            state, linear_solves = self.problem.sticking_state, 1
        else:
            state, linear_solves = consistent_state(self.problem, start)
        iterate = self.solver.init(self.problem, state)
        return replace(iterate, linear_solves=iterate.linear_solves + linear_solves + n_before)

    def _without_contact(self, iterate: Iterate, contact_free: FloatingResponse | None) -> Iterate:
        """Return the iterate without contact tractions, if the body needs none at its displacements.

        Solvers converge to zero tractions only approximately, and without other tractions there is no scale to compare
        them with. A body that has moved far may be moved slightly further, out of the obstacle.
        """
        if contact_free is None or not iterate.state.is_finite:
            return iterate
        state = contact_free.nearest_clear(iterate.state.displacement, self.problem.gap)
        if not certify(self.problem, state).is_below(self.tolerance):
            return iterate
        return replace(iterate, state=state, message="the body rests without touching")

    def _record(self, iterate: Iterate, sets: ActiveSets, step: int, change: float, n_changed: int) -> StepRecord:
        slips = sets.is_closed & (sets.direction != 0)
        record = StepRecord(
            step=step,
            linear_solves=iterate.linear_solves,
            certificate=certify(self.problem, iterate.state),
            relative_change=change,
            n_separated=int(np.count_nonzero(~sets.is_closed)),
            n_stick=int(np.count_nonzero(sets.is_closed & ~slips)),
            n_slip=int(np.count_nonzero(slips)),
            n_changed=n_changed,
            message=iterate.message,
        )
        if self.callback is not None:
            self.callback(record)
        return record

    def _status(self, iterate: Iterate, history: list[StepRecord]) -> Status | None:
        """Return the status if the solve ends here, otherwise None."""
        if not iterate.state.is_finite:
            return Status.NOT_FINITE
        if history[-1].certificate.is_below(self.tolerance):
            return Status.CONVERGED
        return iterate.ended or (Status.MAX_STEPS if history[-1].step >= self.max_steps else None)

    def _solution(
        self, iterate: Iterate, status: Status, sets: ActiveSets, certificate: Certificate, history: list[StepRecord]
    ) -> ContactSolution:
        worst = f"worst certificate entry {certificate.worst:.1e} after {counted(history[-1].step, 'step')}"
        return ContactSolution(
            state=iterate.state,
            status=status,
            certificate=certificate,
            node_status=sets.node_status,
            steps=history[-1].step,
            linear_solves=iterate.linear_solves,
            message=f"{status.value} [{worst}]" + (f" ({iterate.message})" if iterate.message else ""),
            history=tuple(history),
        )

    def _without_state(self, status: Status, message: str) -> ContactSolution:
        unknown = np.full((self.problem.n_contact, 2), np.nan)
        return ContactSolution(
            state=ContactState(unknown, unknown),
            status=status,
            certificate=Certificate(*[float("nan")] * len(fields(Certificate))),
            node_status=np.full(len(unknown), NodeStatus.SEPARATED, dtype=np.intp),
            steps=0,
            linear_solves=0,
            message=f"{status.value} {message}",
            history=(),
        )


def _status_of(error: SingularResponse) -> Status:
    return Status.CLOSED_VOLUME if isinstance(error, ClosedVolume) else Status.SINGULAR


def _relative_change(state: ContactState, previous: ContactState) -> float:
    """Return the largest change of displacements, relative to the largest displacement."""
    largest = float(np.abs(state.displacement).max())
    change = float(np.abs(state.displacement - previous.displacement).max())
    return change / largest if largest > 0.0 else float(change > 0.0)
