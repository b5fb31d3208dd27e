"""Progress of outer iterations: repetition and stagnation."""

from dataclasses import dataclass

import numpy as np

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.base import Status
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
