"""A sequence of solvers as one solver, the default of scenes."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.errors import InputError
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.base import ContactSolver, Iterate, Status
from bemkit.solvers.newton import merit, negligible
from bemkit.solvers.solution_path import SolutionPath
from bemkit.solvers.springs import Springs
from bemkit.solvers.ssn import SemismoothNewton


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
        object.__setattr__(self, "drivers", tuple(self.drivers))
        if not self.drivers:
            raise InputError("drivers is empty; give at least one solver, such as SemismoothNewton()")

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
                message=f"no solution after {n_steps} {'step' if n_steps == 1 else 'steps'}",
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
