"""Fixed point iteration on the friction bound."""

from dataclasses import dataclass, field

from bemkit.contact.body import ContactState
from bemkit.contact.laws import Tresca
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.solvers.base import ContactSolver, Iterate, check_max_steps, solve
from bemkit.solvers.fallbacks import Fallbacks
from bemkit.solvers.progress import OuterIterate


@dataclass(frozen=True)
class FixedPoint:
    """Solve Tresca problems, each with the bound from the normal tractions of the last one.

    Parameters
    ----------
    inner : ContactSolver
        Solver of the Tresca problems.
    inner_tolerance : float
        Certificate of the inner solutions; at least a thousand times the accuracy of the body.
    max_steps : int
        Largest number of outer steps.

    Notes
    -----
    This is the iteration of the classical proof of existence [NecasJarusekHaslinger1980], and the limit of
    `AugmentedLagrangian` for large rho. It converges for moderate friction only; otherwise it ends with CYCLING or
    STALLED.
    """

    inner: ContactSolver = field(default_factory=Fallbacks)
    inner_tolerance: float = 1e-11
    max_steps: int = 500

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)
        if not 0.0 < self.inner_tolerance < 1.0:
            raise InputError(f"inner_tolerance = {self.inner_tolerance}; give a number between 0 and 1")

    def init(self, problem: ContactProblem, start: ContactState) -> OuterIterate:
        """Compute the bound from the normal tractions of the start."""
        return OuterIterate.begun(problem, start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> OuterIterate:
        """Solve one Tresca problem."""
        if not isinstance(iterate, OuterIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        sigma_n = iterate.state.sigma_n
        bound = problem.friction_bound(sigma_n, is_closed=sigma_n < 0.0)
        tresca = problem.with_law(Tresca(bound))
        tolerance = max(self.inner_tolerance, 1e3 * problem.body.accuracy)
        inner = solve(tresca, self.inner, start=iterate.state, tolerance=tolerance, throw=False)
        if inner.is_converged:
            return iterate.followed_by(problem, inner.state, inner.linear_solves)
        state = inner.state if inner.state.is_finite else iterate.state
        message = f"Tresca problem of this step: {inner.status.name}: {inner.message}"
        return iterate.failed_at(state, inner.linear_solves, message)
