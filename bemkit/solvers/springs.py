"""A solver for many loose bodies: springs on all bodies that become weaker (the proximal point method)."""

from dataclasses import dataclass, field, replace

from bemkit.contact.problem import ContactProblem, ContactState
from bemkit.errors import InputError
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual
from bemkit.solvers.base import ContactSolver, Iterate, Status, check_max_steps
from bemkit.solvers.ssn import SemismoothNewton

SPRINGS_MESSAGE = "springs of"
"""How the messages of steps begin that hold all bodies by springs."""

_DECREASE = 0.25
"""Factor from one spring to the next."""

_SETTLED = 100
"""Springs become weaker once no more than one node in this many changes its status."""


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
