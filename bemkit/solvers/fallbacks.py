"""A sequence of solvers as one solver, the default of scenes, and those that follow Newton's method in it."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, replace

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError, counted
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual, contact_sets
from bemkit.solvers.base import ContactSolver, Iterate, Status, check_max_steps
from bemkit.solvers.newton import merit, negligible
from bemkit.solvers.ssn import SemismoothNewton

PATH_MESSAGE = "path of"
"""How the messages of steps begin that have followed a path to its end."""

_SHORT = 20
"""Segments of a path from given statuses, besides one for eight nodes; the whole path has one or two for each node."""

_SHORT_AND_COSTLY = 80
"""The most such segments where responses are costly: after springs, packings of 200 discs took 37."""

SPRINGS_MESSAGE = "springs of"
"""How the messages of steps begin that hold all bodies by springs."""

_DECREASE = 0.25
"""Factor from one spring to the next."""

_SETTLED = 100
"""Springs become weaker once no more than one node in this many changes its status."""


@dataclass(frozen=True, eq=False, kw_only=True)
class PathIterate(Iterate):
    """Iterate of `SolutionPath`; `n_paths` is the number of paths followed so far."""

    n_paths: int = 0


@dataclass(frozen=True)
class SolutionPath:
    """Lemke's complementary pivoting on a body: follow exact solutions while an artificial load decreases to zero.

    Parameters
    ----------
    from_start : bool
        Whether to begin with all nodes closed and sticking. That path leads to a solution of a held body by a few
        linear solves for each node. Otherwise the path begins with the present statuses, most of which are correct, and
        takes two linear solves for each change of a node.
    max_steps : int
        Largest number of paths, each with the tangent of the law at the end of the last path. One is sufficient for
        bounds that are affine in the pressure.

    Notes
    -----
    See `bemkit.solvers.homotopy`. Bodies with expensive responses do not follow the whole path.

    References
    ----------
    [Lemke1965], [CottlePangStone1992].
    """

    from_start: bool = False
    max_steps: int = 5

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)

    def init(self, problem: ContactProblem, start: ContactState) -> PathIterate:
        """Begin at a response; end if there is no path to follow."""
        from bemkit.solvers.homotopy import why_no_path

        hindrance = why_no_path(problem, is_short=not self.from_start)
        return PathIterate(state=start, ended=Status.STALLED if hindrance else None, message=hindrance)

    def step(self, problem: ContactProblem, iterate: Iterate) -> PathIterate:
        """Follow one path to its end; only the first step may follow the whole path."""
        from bemkit.solvers.homotopy import AffineBound, follow_path

        if not isinstance(iterate, PathIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        bound = AffineBound.tangent(problem, iterate.state.sigma_n)
        if self.from_start and iterate.n_paths == 0:
            end = follow_path(problem, bound)
        else:
            most = _SHORT + problem.n_contact // 8
            most = min(most, _SHORT_AND_COSTLY) if problem.body.responses_are_expensive else most
            sets = contact_sets(problem, iterate.state)
            # a node whose friction acts along its slip is changing its slip direction through stick
            direction = np.where(sets.direction * iterate.state.sigma_t > 0.0, 0, sets.direction)
            end = follow_path(problem, bound, ActiveSets(sets.is_closed, direction), max_segments=most)
        spent = iterate.linear_solves + end.linear_solves
        following = replace(iterate, linear_solves=spent, n_paths=iterate.n_paths + 1)
        if end.state is None:
            return replace(following, ended=Status.STALLED, message=end.reason)
        return replace(following, state=end.state, message=f"{PATH_MESSAGE} {end.n_segments} segments")


@dataclass(frozen=True, eq=False, kw_only=True)
class SpringIterate(Iterate):
    """Iterate of `Springs`.

    Parameters
    ----------
    spring : float
        Stiffness of the springs of the next step in units of the stiffness scale [-].
    anchor : ContactState
        State with zero spring forces.
    residual : Residual
    sets : ActiveSets
        Projections at the state, and sets of the next step.
    released : Iterate or None
        Iterate of the solver that continues without springs.
    """

    spring: float
    anchor: ContactState
    residual: Residual
    sets: ActiveSets
    released: Iterate | None = None


@dataclass(frozen=True)
class Springs:
    """Proximal point method: Newton steps with springs on all bodies, which become weaker from step to step.

    Parameters
    ----------
    first, last : float
        The first and the weakest spring in units of the stiffness scale of the body [-].
    then : ContactSolver
        Solver that continues without springs after the weakest ones.
    least_motions : int
        Smallest number of rigid motions that only contact holds; with fewer the solver does not apply. Four are those
        of at least two loose bodies.
    max_steps : int
        Largest number of steps, including those of `then`; packings of 200 discs take 50 to 70.

    Notes
    -----
    The solver is for many loose bodies, which only contact holds. It begins with all nodes sticking, because Newton's
    method may have moved loose bodies far away.

    References
    ----------
    The proximal point method [Rockafellar1976].
    """

    first: float = 3e-2
    last: float = 1e-5
    then: ContactSolver = field(default_factory=SemismoothNewton)
    least_motions: int = 0
    max_steps: int = 120

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)
        if not 0.0 < self.last <= self.first < float("inf"):
            raise InputError(f"springs from {self.first} to {self.last}; give positive numbers, the last not larger")

    def init(self, problem: ContactProblem, start: ContactState) -> SpringIterate:
        """Begin with all nodes held; end if few motions are free."""
        anchor, n_motions = problem.sticking_state, problem.body.rigid_motions().shape[0]
        residual = ProjectionEquations.scaled(problem).evaluate(anchor)
        begun = SpringIterate(state=start, spring=self.first, anchor=anchor, residual=residual, sets=residual.sets)
        if n_motions >= self.least_motions:
            return begun
        reason = f"contact holds {n_motions} rigid motions, less than {self.least_motions}"
        return replace(begun, ended=Status.STALLED, message=reason)

    def step(self, problem: ContactProblem, iterate: Iterate) -> SpringIterate:
        """Take a step with springs, or without if they have become weak enough."""
        if not isinstance(iterate, SpringIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        if iterate.released is not None:
            return self._released(iterate, self.then.step(problem, iterate.released))
        equations, stiffness = ProjectionEquations.scaled(problem), iterate.spring * problem.body.stiffness_scale
        linear = equations.linearised(iterate.residual, iterate.sets)
        state = problem.respond_with_room(linear.regularised(iterate.anchor.displacement, stiffness))
        residual = equations.evaluate(state)
        sets = equations.through_stick(residual, iterate.sets)
        following = replace(
            iterate,
            state=residual.state,
            linear_solves=iterate.linear_solves + 1,
            message=f"{SPRINGS_MESSAGE} {iterate.spring:.1e}",
            residual=residual,
            sets=sets,
        )
        if sets.n_changed(iterate.sets) > problem.n_contact // _SETTLED:
            return following
        following = replace(following, spring=_DECREASE * iterate.spring, anchor=residual.state)
        if following.spring >= self.last:
            return following
        return replace(following, released=self.then.init(problem, residual.state))

    def _released(self, iterate: SpringIterate, then: Iterate) -> SpringIterate:
        """Return the iterate after a step without springs."""
        assert iterate.released is not None
        solves = iterate.linear_solves + then.linear_solves - iterate.released.linear_solves
        return replace(
            iterate, state=then.state, linear_solves=solves, ended=then.ended, message=then.message, released=then
        )


@dataclass(frozen=True, eq=False, kw_only=True)
class FallbackIterate(Iterate):
    """Iterate of `Fallbacks`.

    Parameters
    ----------
    index : int
        Index of the present solver.
    inner : Iterate
        Iterate of that solver.
    n_steps : int
        Its number of steps so far.
    reasons : tuple of str
        Reasons why previous solvers ended.
    """

    index: int
    inner: Iterate
    n_steps: int = 0
    reasons: tuple[str, ...] = ()


@dataclass(frozen=True)
class Fallbacks:
    """A sequence of solvers, each of which starts from the last state of the previous one.

    Parameters
    ----------
    drivers : tuple of ContactSolver
        By default Newton's method, which is nearly always sufficient; springs, for many loose bodies; the path of
        solutions from the present statuses; and the whole path.

    Notes
    -----
    A solver that does not apply ends in `init`, and the next one begins. If contact and friction are fulfilled, no
    other solver is tried, because only more accurate responses could improve the certificate.

    Examples
    --------
    >>> Fallbacks((SemismoothNewton(max_steps=10), SolutionPath()))
    Fallbacks(drivers=(SemismoothNewton(rho=None, max_steps=10), SolutionPath(from_start=False, max_steps=5)))
    """

    drivers: tuple[ContactSolver, ...] = (
        SemismoothNewton(),
        Springs(least_motions=4),
        SolutionPath(),
        SolutionPath(from_start=True),
    )

    def __post_init__(self) -> None:
        drivers = tuple(self.drivers) if isinstance(self.drivers, Iterable) else (self.drivers,)
        object.__setattr__(self, "drivers", drivers)
        if not drivers:
            raise InputError("drivers is empty; give at least one solver, such as SemismoothNewton()")
        for driver in drivers:
            if isinstance(driver, type) or not callable(getattr(driver, "step", None)):
                raise InputError(f"drivers contains {driver!r}; give solvers, such as SemismoothNewton()")

    @property
    def max_steps(self) -> int:
        """Sum over all solvers."""
        return sum(driver.max_steps for driver in self.drivers)

    def without_whole_path(self) -> "Fallbacks":
        """Return the solvers without those that follow the whole path of solutions."""
        return self._without(lambda driver: isinstance(driver, SolutionPath) and driver.from_start)

    def without_new_starts(self) -> "Fallbacks":
        """Return the solvers that continue from a given state, without those that begin with all nodes sticking."""
        return self.without_whole_path()._without(lambda driver: isinstance(driver, Springs))

    def _without(self, is_excluded: Callable[[ContactSolver], bool]) -> "Fallbacks":
        others = tuple(driver for driver in self.drivers if not is_excluded(driver))
        return Fallbacks(others) if others else self

    def init(self, problem: ContactProblem, start: ContactState) -> FallbackIterate:
        """Begin with the first solver that applies."""
        return self._begun(problem, FallbackIterate(state=start, index=-1, inner=Iterate(state=start)))

    def step(self, problem: ContactProblem, iterate: Iterate) -> FallbackIterate:
        """Take a step of the present solver; begin the next solver if it ends."""
        if not isinstance(iterate, FallbackIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        driver, n_steps = self.drivers[iterate.index], iterate.n_steps + 1
        inner = driver.step(problem, iterate.inner)
        if not inner.state.is_finite:
            inner = replace(inner, state=iterate.state, ended=Status.NOT_FINITE, message="numbers overflowed")
        if inner.ended is None and n_steps >= driver.max_steps:
            inner = replace(
                inner,
                ended=Status.STALLED,
                message=f"no solution after {counted(n_steps, 'step')}",
            )
        following = replace(
            iterate,
            state=inner.state,
            linear_solves=iterate.linear_solves + inner.linear_solves - iterate.inner.linear_solves,
            ended=inner.ended,
            message=inner.message,
            inner=inner,
            n_steps=n_steps,
        )
        if inner.ended is None or _is_satisfied(problem, inner.state):
            return following
        return self._begun(problem, replace(following, reasons=(*iterate.reasons, self._reason(iterate.index, inner))))

    def _begun(self, problem: ContactProblem, iterate: FallbackIterate) -> FallbackIterate:
        """Return the first iterate of the next solver that applies, or the given one, ended, if there is none."""
        ended, reasons = iterate.ended, iterate.reasons
        for index in range(iterate.index + 1, len(self.drivers)):
            inner = self.drivers[index].init(problem, iterate.state)
            if inner.ended is None:
                spent = iterate.linear_solves + inner.linear_solves
                message = "; ".join([*filter(None, [iterate.message]), _begins(self.drivers[index])]) if index else ""
                return FallbackIterate(
                    state=inner.state, linear_solves=spent, message=message, index=index, inner=inner, reasons=reasons
                )
            ended = ended or inner.ended
            reasons = (*reasons, self._reason(index, inner))
        return replace(iterate, ended=ended, message="; ".join(reasons))

    def _reason(self, index: int, inner: Iterate) -> str:
        return f"{type(self.drivers[index]).__name__}: {inner.message}"


def drivers_at_work(solver: ContactSolver, messages: Iterable[str]) -> tuple[ContactSolver, ...]:
    """Return the solvers that took part in a solve, from the messages of its history; by default the first one."""
    if not isinstance(solver, Fallbacks):
        return (solver,)
    words = "; ".join(messages)
    return (solver.drivers[0], *(driver for driver in solver.drivers[1:] if _begins(driver) in words))


def _begins(driver: ContactSolver) -> str:
    return f"{type(driver).__name__} is next"


def _is_satisfied(problem: ContactProblem, state: ContactState) -> bool:
    """Whether contact and friction are fulfilled to round-off, so that no other solver can improve the state."""
    return merit(problem, ProjectionEquations.scaled(problem).evaluate(state)) <= negligible(problem.body)
