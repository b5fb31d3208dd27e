"""Augmented Lagrangian method: Algorithm 1 of the paper with corrections."""

from dataclasses import dataclass, field, replace
from enum import Enum

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.certificate import Scales
from bemkit.contact.problem import ContactProblem
from bemkit.errors import counted
from bemkit.solvers.active_sets import ProjectionEquations
from bemkit.solvers.base import Iterate, Status, check_max_steps, check_rho
from bemkit.solvers.newton import negligible
from bemkit.solvers.progress import OuterIterate
from bemkit.solvers.ssn import NewtonIterate, newton_start, newton_step

_AUTOMATIC_RHO = 100.0
"""Automatic rho in units of the stiffness scale. Multipliers then gain two digits in each step, so that the lagged
friction bound determines the rate of the outer iteration, and rho costs no digits."""


@dataclass(frozen=True)
class InnerNewton:
    """Algorithm 2 with fixed multiplier, as printed: repeat Steps 1 to 3 until the active sets do not change.

    Parameters
    ----------
    max_steps : int
        Largest number of steps in one outer step; a few are usual.
    """

    max_steps: int = 100

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)

    def solved(self, equations: ProjectionEquations, start: ContactState) -> Iterate:
        """Return the iterate that solves the equations, or an ended iterate with a message.

        Parameters
        ----------
        equations : ProjectionEquations
            Equations with a fixed multiplier; the bound is fixed or depends on the normal traction.
        start : ContactState
            A response of the body.
        """
        iterate = newton_start(equations, start)
        for _ in range(self.max_steps):
            before, iterate = iterate, newton_step(equations, iterate)
            if _solves(equations, before, iterate):
                return iterate
        message = f"inner Newton iteration unfinished after {counted(iterate.linear_solves, 'linear solve')}"
        return replace(iterate, ended=Status.INNER_FAILED, message=message)


class BoundUpdate(Enum):
    """The normal traction from which the friction bound of an outer step is computed."""

    LAGGED = "lagged"
    """The multiplier of the last outer step, as printed in Algorithm 1: each outer step solves a Tresca problem."""

    CURRENT = "current"
    """The present traction, differentiated in the inner Newton iteration. The augmentation then determines the rate of
    the outer iteration."""


@dataclass(frozen=True)
class AugmentedLagrangian:
    """Algorithm 1 of the paper: solve with fixed multipliers; the tractions are the next multipliers.

    Parameters
    ----------
    rho_n, rho_t : float, optional
        rho_1 and rho_2 of the paper: ratios of traction to displacement [Pa/m], in the units of the body. By default
        100 times the stiffness scale of the body.
    inner : InnerNewton
        Solver of Step 1: Algorithm 2, or any object with the method `solved`.
    bound : BoundUpdate
        Source of the friction bound of an outer step.
    max_steps : int
        Largest number of outer steps.

    Notes
    -----
    Deviations from the print: the bound is ``s |sigma_n^(k)|``; slip tractions are ``-bound sign(rho u_t - sigma_t)``;
    the multiplier is fixed in the inner loop; a node reverses its slip direction only through stick; and the first
    multiplier is the traction of the body with all nodes held, because zero multipliers would give an empty contact
    set. For Tresca's law each step reduces the distance of the multipliers from the solution (Theorem 1); for Coulomb's
    law the lagged bound converges for moderate friction only.

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
        """Perform step 0: the tractions of the start are the multipliers."""
        return OuterIterate.begun(problem, start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> OuterIterate:
        """Perform steps 1 and 2."""
        if not isinstance(iterate, OuterIterate):
            raise TypeError(f"iterate is a {type(iterate).__name__}; give a result of init or step of this solver")
        # Step 1: solve with the multiplier sigma^(k) = present traction fixed, and its bound
        inner = self.inner.solved(self._equations(problem, iterate.state.traction), iterate.state)
        if inner.ended is not None:
            return iterate.failed_at(inner.state, inner.linear_solves, inner.message)
        # Step 2: the traction found is sigma^(k+1); `solve` stops by the certificate, and k = k + 1
        return iterate.followed_by(problem, inner.state, inner.linear_solves)

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


def _solves(equations: ProjectionEquations, iterate: NewtonIterate, following: NewtonIterate) -> bool:
    """Whether a step has solved the equations: no residual, or the same sets and an exactly linear bound."""
    before, reached = iterate.residual, following.residual
    stress = Scales.of(equations.problem, following.state).stress
    tolerance = negligible(equations.problem.body) * stress
    if np.abs(reached.value).max() <= tolerance:
        return True
    # The round-off of displacements times a large rho may be larger, so compare what was linearised instead.
    linearised = before.bound + before.slope * (reached.predicted_sigma_n - before.predicted_sigma_n)
    is_exact = bool(np.all(np.abs(reached.bound - linearised)[iterate.sets.direction != 0] <= tolerance))
    # frictionless nodes slide in either direction
    keeps_direction = (reached.sets.direction == iterate.sets.direction) | reached.is_free
    keeps_sets = bool(np.all((reached.sets.is_closed == iterate.sets.is_closed) & keeps_direction))
    return keeps_sets and is_exact and not following.is_regularised
