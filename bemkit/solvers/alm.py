"""Augmented Lagrangian method: Algorithm 1 of the paper, corrected."""

from dataclasses import dataclass, field
from enum import Enum

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.problem import ContactProblem, ContactState, certificate_scales
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual
from bemkit.solvers.base import Iterate, check_count, check_max_steps, check_rho
from bemkit.solvers.newton import negligible, respond
from bemkit.solvers.progress import OuterIterate

_AUTOMATIC_RHO = 100.0
"""In units of the body's stiffness scale. Large enough that the multipliers gain two digits a step, so that the rate of
the outer iteration is that of the lagged friction bound; small enough not to cost digits."""


@dataclass(frozen=True)
class InnerNewton:
    """Options of the semismooth Newton iteration inside each outer step.

    Parameters
    ----------
    max_steps : int
        Linear solves allowed in one outer step.
    full_steps : int
        Full steps before the line search begins. Full steps nearly always end after a few; the line search makes the
        iteration converge from any start.
    """

    max_steps: int = 100
    full_steps: int = 12

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)
        check_count("full_steps", self.full_steps)


class BoundUpdate(Enum):
    """Which normal traction the friction bound of an outer step comes from."""

    LAGGED = "lagged"
    """The multiplier of the last outer step, as printed in Algorithm 1: each outer step solves a Tresca problem."""

    CURRENT = "current"
    """The present one, differentiated inside the inner Newton iteration. The outer iteration then converges at the rate
    of the augmentation alone."""


@dataclass(frozen=True)
class AugmentedLagrangian:
    """Algorithm 1 of the paper: solve with fixed multipliers, and take the tractions as the next multipliers.

    Parameters
    ----------
    rho_n, rho_t : float, optional
        rho_1 and rho_2 of the paper as ratios of traction to displacement [Pa/m]; a body in units of E' and L takes
        them in units of E'/L. By default 100 times the stiffness scale of the body.
    inner : InnerNewton
    bound : BoundUpdate
        Whether the friction bound of an outer step comes from the multiplier or from the present normal traction.
    max_steps : int
        Outer steps allowed.

    Notes
    -----
    Deviations from the print: the bound is ``s |sigma_n^(k)|``; slip tractions are ``-bound sign(rho u_t - sigma_t)``;
    the multiplier stays fixed during the inner loop; a node changes its direction of slip only by way of stick; and
    the first multiplier is the traction of the body with all nodes held, since zero multipliers would start from an
    empty contact set. For Tresca's law each step reduces the distance of the multipliers to the solution (Theorem 1);
    for Coulomb's law the lagged bound converges for moderate friction only.

    References
    ----------
    Algorithms 1 and 2 of the paper; `docs/conventions.md` lists the corrections. [Stadler2004] for Tresca's law.
    """

    rho_n: float | None = None
    rho_t: float | None = None
    inner: InnerNewton = field(default_factory=InnerNewton)
    bound: BoundUpdate = BoundUpdate.LAGGED
    max_steps: int = 500

    def __post_init__(self) -> None:
        check_rho("rho_n", self.rho_n)
        check_rho("rho_t", self.rho_t)
        check_max_steps(self.max_steps)

    def init(self, problem: ContactProblem, start: ContactState) -> OuterIterate:
        """Take the tractions of the start as multipliers."""
        return OuterIterate.begun(problem, start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> OuterIterate:
        """Do one outer step."""
        if not isinstance(iterate, OuterIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give what init or step of this driver returned")
        equations = self._equations(problem, iterate.state.traction)
        inner = solve_projected(equations, iterate.state, self.inner)
        if inner.is_solved:
            return iterate.followed_by(problem, inner.state, inner.linear_solves)
        message = f"inner Newton iteration unfinished after {inner.linear_solves} linear solves"
        return iterate.failed_at(inner.state, inner.linear_solves, message)

    def _equations(self, problem: ContactProblem, multiplier: FloatArray) -> ProjectionEquations:
        automatic = _AUTOMATIC_RHO * problem.body.stiffness_scale
        given_bound = None
        if self.bound is BoundUpdate.LAGGED:
            given_bound = problem.friction_bound(multiplier[:, 0], is_closed=multiplier[:, 0] < 0.0)
        return ProjectionEquations(
            problem,
            rho_n=automatic if self.rho_n is None else self.rho_n,
            rho_t=automatic if self.rho_t is None else self.rho_t,
            multiplier=multiplier,
            given_bound=given_bound,
        )


@dataclass(frozen=True, eq=False)
class InnerResult:
    """Outcome of `solve_projected`."""

    state: ContactState
    linear_solves: int
    is_solved: bool


def solve_projected(equations: ProjectionEquations, start: ContactState, options: InnerNewton) -> InnerResult:
    """Solve projection equations with fixed multipliers by semismooth Newton, from a response of the body.

    With a given bound and a symmetric body the weighted residual along a Newton direction d, ``sum w residual . d``, is
    the slope of a convex function, the augmented energy. A line search to the zero of this slope makes the iteration
    descend from any start.
    """
    residual = equations.evaluate(start)
    sets, linear_solves, n_regularised = residual.sets, 0, 0
    for step in range(options.max_steps):
        response = respond(equations, residual, sets, n_regularised)
        linear_solves += response.linear_solves
        reached = equations.evaluate(response.state)
        if _is_solved(equations, residual, reached, sets, is_regularised=response.is_regularised):
            return InnerResult(response.state, linear_solves, is_solved=True)
        if step < options.full_steps:
            following = equations.through_stick(reached, sets)
        else:
            reached = equations.evaluate(_descended(equations, residual, response.state))
            following = reached.sets
        n_regularised = n_regularised + 1 if response.is_regularised and following.key == sets.key else 0
        residual, sets = reached, following
    return InnerResult(residual.state, linear_solves, is_solved=False)


def _is_solved(
    equations: ProjectionEquations, residual: Residual, reached: Residual, sets: ActiveSets, *, is_regularised: bool
) -> bool:
    """Whether the Newton point solves the equations: no residual, or the same sets and an exactly linear bound."""
    stress, _ = certificate_scales(equations.problem, reached.state)
    tolerance = negligible(equations.problem.body) * stress
    if np.abs(reached.value).max() <= tolerance:
        return True
    # The round-off of displacements times a large rho may be larger, so compare what was linearised instead.
    linearised = residual.bound + residual.slope * (reached.predicted_sigma_n - residual.predicted_sigma_n)
    is_exact = bool(np.all(np.abs(reached.bound - linearised)[sets.direction != 0] <= tolerance))
    return not is_regularised and reached.sets.key == sets.key and is_exact


def _descended(equations: ProjectionEquations, residual: Residual, target: ContactState) -> ContactState:
    """Return the point towards `target` where the augmented energy is least (the target if it falls all the way)."""
    weights = equations.problem.body.weights[:, None]
    direction = target.displacement - residual.state.displacement

    def slope(fraction: float) -> float:
        value = equations.evaluate(residual.state.blended(target, fraction)).value
        return float((weights * value * direction).sum())

    if slope(1.0) <= 0.0:
        return target
    low, high = 0.0, 1.0
    for _ in range(40):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if slope(middle) < 0.0 else (low, middle)
    return residual.state.blended(target, low)
