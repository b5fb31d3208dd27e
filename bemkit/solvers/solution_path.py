"""A solver that follows the path of solutions from given statuses, or from all nodes sticking."""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.solvers.active_sets import ActiveSets, contact_sets
from bemkit.solvers.base import Iterate, Status, check_max_steps

PATH_MESSAGE = "path of"
"""How the messages of steps begin that have followed a path to its end."""

_SHORT = 20
"""Segments of a path from given statuses, besides one for eight nodes; the whole path has one or two for each node."""

_SHORT_AND_COSTLY = 80
"""The most such segments where responses are costly: after springs, packings of 200 discs took 37."""


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
