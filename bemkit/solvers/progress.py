"""Progress of outer iterations: repetition and stagnation."""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.base import Iterate, Status
from bemkit.solvers.newton import merit

_MEMORY = 8
"""States compared with the present one; lagged bounds oscillate with period two, rarely four."""

_PATIENCE = 60
"""Outer steps without a tenth of improvement after which an iteration counts as stalled."""


@dataclass(frozen=True, eq=False, kw_only=True)
class OuterIterate(Iterate):
    """Iterate of a solver whose steps depend only on the state and take several linear solves.

    It ends with CYCLING if a state recurs, and with STALLED without improvement.

    Parameters
    ----------
    earlier : tuple of ContactState
        Previous states, newest last.
    best : float
        Smallest relative residual of (15), (16) so far.
    steps_since_best : int
        Steps since the last improvement by a tenth.
    """

    earlier: tuple[ContactState, ...] = ()
    best: float
    steps_since_best: int = 0

    @classmethod
    def begun(cls, problem: ContactProblem, start: ContactState) -> "OuterIterate":
        """Return the first iterate, at the start."""
        return cls(state=start, best=_residual(problem, start))

    def followed_by(self, problem: ContactProblem, state: ContactState, linear_solves: int) -> "OuterIterate":
        """Return the iterate after another outer step with the given number of linear solves."""
        residual, accuracy = _residual(problem, state), problem.body.accuracy
        improved = residual < 0.9 * self.best
        since = 0 if improved else self.steps_since_best + 1
        ended = None
        if since > _PATIENCE or _is_same(state, self.state, accuracy):
            ended = Status.STALLED
        elif any(_is_same(state, earlier, accuracy) for earlier in self.earlier):
            ended = Status.CYCLING
        return OuterIterate(
            state=state,
            linear_solves=self.linear_solves + linear_solves,
            earlier=(*self.earlier, self.state)[1 - _MEMORY :],
            best=residual if improved else self.best,
            steps_since_best=since,
            ended=ended,
            message=f"{linear_solves} inner solves",
        )

    def failed_at(self, state: ContactState, linear_solves: int, message: str) -> "OuterIterate":
        """Return the last iterate after a failed inner solve; the message gives the reason."""
        total = self.linear_solves + linear_solves
        return replace(self, state=state, linear_solves=total, ended=Status.INNER_FAILED, message=message)


def _residual(problem: ContactProblem, state: ContactState) -> float:
    return merit(problem, ProjectionEquations.scaled(problem).evaluate(state))


def _is_same(state: ContactState, other: ContactState, accuracy: float) -> bool:
    """Whether two states agree to ten times the accuracy of the body."""
    return all(
        float(np.abs(a - b).max()) <= 10.0 * accuracy * float(np.abs(a).max())
        for a, b in ((state.displacement, other.displacement), (state.traction, other.traction))
    )
