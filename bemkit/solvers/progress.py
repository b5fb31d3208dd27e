"""Progress of outer iterations: repetition and stagnation."""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.base import Iterate, Status
from bemkit.solvers.newton import merit

_MEMORY = 8
"""States compared with the present one; lagged bounds oscillate with period two, rarely four."""

_PATIENCE = 60
"""Outer steps without a tenth of improvement after which an iteration counts as stalled."""


@dataclass(frozen=True, eq=False)
class Progress:
    """What an outer iteration, whose steps depend on its state alone, has achieved.

    Parameters
    ----------
    recent : tuple of ContactState
        The last states, newest last.
    best : float
        Smallest residual of (15), (16) so far, relative.
    steps_since_best : int
        Steps since that improved by a tenth.
    ended : Status or None
        CYCLING if a state came back, STALLED if nothing improves.
    """

    recent: tuple[ContactState, ...]
    best: float
    steps_since_best: int = 0
    ended: Status | None = None

    @classmethod
    def begun(cls, problem: ContactProblem, start: ContactState) -> "Progress":
        """Return the record of a start."""
        return cls((start,), _residual(problem, start))

    def after(self, problem: ContactProblem, state: ContactState) -> "Progress":
        """Return the record after one more step."""
        residual, accuracy = _residual(problem, state), problem.body.accuracy
        improved = residual < 0.9 * self.best
        since = 0 if improved else self.steps_since_best + 1
        ended = Status.STALLED if since > _PATIENCE or _is_same(state, self.recent[-1], accuracy) else None
        if any(_is_same(state, earlier, accuracy) for earlier in self.recent[:-1]) and ended is None:
            ended = Status.CYCLING
        recent = (*self.recent, state)[-_MEMORY:]
        return Progress(recent, residual if improved else self.best, since, ended)


def _residual(problem: ContactProblem, state: ContactState) -> float:
    rho = problem.body.stiffness_scale
    return merit(problem, ProjectionEquations(problem, rho, rho).evaluate(state))


def _is_same(state: ContactState, other: ContactState, accuracy: float) -> bool:
    """Whether two states agree to ten times the accuracy of their body."""
    return all(
        float(np.abs(a - b).max()) <= 10.0 * accuracy * float(np.abs(a).max())
        for a, b in ((state.displacement, other.displacement), (state.traction, other.traction))
    )


@dataclass(frozen=True, eq=False, kw_only=True)
class OuterIterate(Iterate):
    """Iterate of a driver whose steps depend on the state alone, and each take several linear solves.

    Parameters
    ----------
    progress : Progress
        What the last outer steps achieved.
    """

    progress: Progress

    @classmethod
    def begun(cls, problem: ContactProblem, start: ContactState) -> "OuterIterate":
        """Return the first iterate."""
        return cls(state=start, progress=Progress.begun(problem, start))

    def followed_by(self, problem: ContactProblem, state: ContactState, linear_solves: int) -> "OuterIterate":
        """Return the iterate after one more outer step that has taken the given linear solves."""
        progress = self.progress.after(problem, state)
        return OuterIterate(
            state=state,
            linear_solves=self.linear_solves + linear_solves,
            progress=progress,
            ended=progress.ended,
            message=f"{linear_solves} inner solves",
        )

    def failed_at(self, state: ContactState, linear_solves: int, message: str) -> "OuterIterate":
        """Return the last iterate, after an inner solve that has failed for the reason given."""
        spent = self.linear_solves + linear_solves
        return replace(self, state=state, linear_solves=spent, ended=Status.INNER_FAILED, message=message)
