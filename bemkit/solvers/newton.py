"""Newton steps on the projection equations, shared by all drivers."""

from dataclasses import dataclass

import numpy as np

from bemkit.contact.certificate import certificate_scales
from bemkit.contact.problem import ContactProblem, ContactState, SingularResponse
from bemkit.errors import InputError
from bemkit.solvers.active_sets import ActiveSets, ProjectedConditions, Trial, coheres
from bemkit.solvers.floating import floating_response

_SPRING = 1e-3
"""Springs that hold an unheld body, in units of its stiffness scale. Small: each further step reduces what the
springs still carry by about this factor. Not tiny: the response must stay well determined."""

_WEAKER = 0.1
_WEAKEST = 1e-8
"""Springs become weaker by the first factor with every step that ends in the sets it began with, so that a small force
soon carries the body to where other sets hold it; by the second at most."""


@dataclass(frozen=True, eq=False)
class Response:
    """Answer of the body to Newton's linear conditions.

    Parameters
    ----------
    state : ContactState
    linear_solves : int
        Linear systems spent.
    is_sprung : bool
        Whether the conditions left the body free to move, so that springs had to hold it in this step.
    """

    state: ContactState
    linear_solves: int
    is_sprung: bool


def respond(conditions: ProjectedConditions, trial: Trial, sets: ActiveSets, n_sprung: int = 0) -> Response:
    """Solve the linearised conditions.

    Parameters
    ----------
    conditions : ProjectedConditions
    trial : Trial
        Where to linearise.
    sets : ActiveSets
        Sets of the Newton matrix.
    n_sprung : int
        Steps before this one that springs held with the same sets.

    Returns
    -------
    Response
        If the sets do not hold the body, it stays near its present displacements: exactly there if the forces on it
        balance, or else held by weak springs during this step.

    Raises
    ------
    SingularResponse
        If even springs at all free nodes do not.
    """
    body = conditions.problem.body
    linear = conditions.linearised(trial, sets)
    try:
        return Response(body.respond(linear), 1, is_sprung=False)
    except SingularResponse:
        floating = floating_response(body, linear)
        if floating is not None:
            return Response(floating.nearest(trial.state.displacement), 2, is_sprung=False)
        stiffness = spring_stiffness(conditions.problem, trial.state) * max(_WEAKER**n_sprung, _WEAKEST)
        springs = linear.held_by_springs(trial.state.displacement, stiffness)
        return Response(conditions.problem.respond(springs), 2, is_sprung=True)


def spring_stiffness(problem: ContactProblem, state: ContactState) -> float:
    """Return the stiffness of springs [Pa/m] so weak that the body reaches a far obstacle in about one step."""
    stress, _ = certificate_scales(problem, state)
    nearest = float(np.min(problem.gap - state.u_n))
    stiffness = problem.body.stiffness_scale
    if np.isfinite(nearest) and nearest > 0.0:
        return _SPRING * stiffness / (1.0 + _SPRING * stiffness * nearest / stress)
    return _SPRING * stiffness


def merit(problem: ContactProblem, trial: Trial) -> float:
    """Return the size of the residual of (15), (16) in the weighted mean square, relative to the traction scale."""
    weights = problem.body.weights
    mean_square = float(weights @ (trial.residual**2).sum(axis=1)) / float(weights.sum())
    stress, _ = certificate_scales(problem, trial.state)
    return float(np.sqrt(mean_square)) / stress


def consistent_state(problem: ContactProblem, guess: ContactState) -> tuple[ContactState, int]:
    """Return the response of the body to the sets of a guessed state, and the linear solves spent.

    A guess need not be in equilibrium; what drivers start from is. The guess chooses the branch where a problem has
    several solutions.

    Raises
    ------
    ValueError
        If the guess has another number of nodes or entries that are not finite.
    SingularResponse
        If the sets do not hold the body in any way.
    """
    if len(guess.displacement) != problem.n_contact:
        raise InputError(f"start has {len(guess.displacement)} nodes; the problem has {problem.n_contact}")
    if not guess.is_finite:
        raise InputError("start contains entries that are not finite; give finite displacements and tractions")
    rho = problem.body.stiffness_scale
    conditions = ProjectedConditions(problem, rho, rho)
    trial = conditions.evaluate(guess, coheres(problem, guess))
    response = respond(conditions, trial, trial.sets)
    return response.state, response.linear_solves
