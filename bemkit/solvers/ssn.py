"""Semismooth Newton method for contact and friction: Algorithm 2 of the paper with differentiated friction bound."""

from dataclasses import dataclass, replace

from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual
from bemkit.solvers.base import Iterate, Status, check_max_steps, check_rho
from bemkit.solvers.newton import WEAKEST_AFTER, carried_on, merit, negligible, respond


@dataclass(frozen=True, eq=False, kw_only=True)
class NewtonIterate(Iterate):
    """Iterate of Algorithm 2.

    Parameters
    ----------
    residual : Residual
        The projections at the state.
    sets : ActiveSets
        Sets of the next step.
    visited : frozenset of bytes
        Keys of all sets so far.
    is_regularised : bool
        Whether springs had to hold the body in this step; see `bemkit.solvers.newton.respond`.
    n_regularised : int
        Number of consecutive steps with springs and equal sets.
    """

    residual: Residual
    sets: ActiveSets
    visited: frozenset[bytes]
    is_regularised: bool = False
    n_regularised: int = 0


@dataclass(frozen=True)
class SemismoothNewton:
    """Newton's method for the projection equations (15), (16): Algorithm 2 of the paper.

    Parameters
    ----------
    rho : float, optional
        Ratio of traction to displacement in the projections [Pa/m], rho_1 = rho_2 of the paper. By default the
        stiffness scale of the body. It only affects nodes that reverse their slip, or that open or close.
    max_steps : int
        Largest number of steps; `Fallbacks` then begins the next solver.

    Notes
    -----
    For Coulomb's law the equations are piecewise linear, so a step that reproduces its active sets has found an exact
    solution, in 5 to 10 steps for any friction. If sets recur instead, `Fallbacks` begins another solver. Deviations
    from the print: the friction bound is differentiated instead of lagged; the multiplier is the traction; a node
    reverses its slip only through stick; and weak springs hold a body that the sets do not hold.

    References
    ----------
    Algorithm 2 of the paper; [HintermuellerItoKunisch2002], [HueeberStadlerWohlmuth2008]; the linearised bound after
    [ChristensenEtAl1998].
    """

    rho: float | None = None
    max_steps: int = 30

    def __post_init__(self) -> None:
        check_rho("rho", self.rho)
        check_max_steps(self.max_steps)

    def init(self, problem: ContactProblem, start: ContactState) -> NewtonIterate:
        """Perform step 0: begin at a response of the body."""
        return newton_start(self._equations(problem), start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> NewtonIterate:
        """Perform steps 1 to 3."""
        if not isinstance(iterate, NewtonIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        following = newton_step(self._equations(problem), iterate)
        # Equal sets give equal steps, unless springs or a nonlinear law remember the state.
        if following.is_regularised or following.sets.key not in iterate.visited:
            return following
        size = merit(problem, following.residual)
        if size < 0.5 * merit(problem, iterate.residual):
            return following
        if size <= negligible(problem.body):
            reason = "contact and friction are satisfied, the rest of the certificate is beyond this driver"
            return replace(following, ended=Status.STALLED, message=reason)
        return replace(following, ended=Status.CYCLING, message="the active sets come back")

    def _equations(self, problem: ContactProblem) -> ProjectionEquations:
        rho = problem.body.stiffness_scale if self.rho is None else self.rho
        return ProjectionEquations(problem, rho, rho)


def newton_start(equations: ProjectionEquations, start: ContactState) -> NewtonIterate:
    """Return the first iterate of Algorithm 2 on given equations, with the sets of the start."""
    residual = equations.evaluate(start)
    return NewtonIterate(state=start, residual=residual, sets=residual.sets, visited=frozenset([residual.sets.key]))


def newton_step(equations: ProjectionEquations, iterate: NewtonIterate) -> NewtonIterate:
    """Do Steps 1 to 3 of Algorithm 2 once on given equations, which may hold the multiplier or the bound fixed.

    Step 1 of the first iteration is that of `newton_start`; each later one ends the step before it, so that solvers
    see at once whether sets come back.
    """
    problem, sets = equations.problem, iterate.sets
    # Step 2: respond with u_n = g on A_n, sigma_n = 0 on S_n, slip at the bound on A_t, stick on S_t
    response = respond(equations, iterate.residual, sets, iterate.n_regularised)
    state = response.state
    if response.is_regularised and iterate.n_regularised >= WEAKEST_AFTER:
        state = carried_on(problem, iterate.state, state)
    # Step 3: k = k + 1, and Step 1 of the next iteration: A_n, S_n, A_t, S_t at the new state
    residual = equations.evaluate(state)
    following = equations.through_stick(residual, sets)
    keeps_sets = response.is_regularised and following.key == sets.key
    return NewtonIterate(
        state=state,
        linear_solves=iterate.linear_solves + response.linear_solves,
        message="held by springs" if response.is_regularised else "",
        residual=residual,
        sets=following,
        visited=iterate.visited | {following.key},
        is_regularised=response.is_regularised,
        n_regularised=iterate.n_regularised + 1 if keeps_sets else 0,
    )
