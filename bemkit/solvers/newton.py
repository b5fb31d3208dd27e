"""Newton steps on the projection equations, and responses of bodies that the active sets do not hold.

Intermediate active sets may not hold rigid motions of a body. If its forces are in equilibrium, it keeps its position
(`floating_response`); otherwise weak springs hold it in that step (`respond`).
"""

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.body import ClosedVolume, ContactState, LinearBody, SingularResponse, of_statuses, separated, stick
from bemkit.contact.certificate import DEFORMED, Scales
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.rigid_modes import RigidMotions, as_dense, as_rows
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual, coheres

_SPRING_STIFFNESS = 1e-3
"""Stiffness of the springs that hold a free body, in units of its stiffness scale. Small, because each step reduces the
force in the springs by about this factor; not tiny, because the response must stay well determined."""

_SPRING_DECREASE = 0.1
WEAKEST_AFTER = 8
"""Factor of the stiffness after each step that ends in the sets it began with, and how often it is applied at most. A
small force then soon carries the body to where other sets hold it."""

_BEYOND = 1.01
"""Step of a body relative to the step at which the next node closes. Slightly beyond it this node counts as closed,
although springs pull it back, and no other node does."""

_NEGLIGIBLE = 100.0
"""Largest residual or imbalance, relative to the accuracy of a body, that is round-off: 1e-12 for a direct solver. A
load of 1e-10 may still move a body to an obstacle, although certificates require 1e-9."""

_NO_SLIP = 1e-12
"""Squared slip, relative to the largest one, below which a rigid motion causes no slip."""

_INFEASIBLE = 1e-12
"""Residual of a least-squares problem below which no motion moves all nodes out of the obstacle."""

_MOST_PINNED = 60
"""Largest number of free motions for which reactions are computed; with more motions springs hold the body."""


@dataclass(frozen=True, eq=False)
class Response:
    """Solution of Newton's linear equations.

    Parameters
    ----------
    state : ContactState
    linear_solves : int
        Number of linear systems solved.
    is_regularised : bool
        Whether springs held the body in this step.
    """

    state: ContactState
    linear_solves: int
    is_regularised: bool


def respond(equations: ProjectionEquations, residual: Residual, sets: ActiveSets, n_regularised: int = 0) -> Response:
    """Solve the equations linearised at a residual, for the given sets.

    A body that the sets do not hold moves to the nearest admissible position if its forces are in equilibrium;
    otherwise weak springs hold it in this step. Springs also take the place of an obstacle that leaves an
    incompressible body no room, once for each sets.

    Parameters
    ----------
    equations : ProjectionEquations
    residual : Residual
        Residual at which the equations are linearised.
    sets : ActiveSets
    n_regularised : int
        Number of previous steps with springs and equal sets; each makes the springs weaker.

    Raises
    ------
    SingularResponse
        If springs at all free nodes do not hold the body.
    ClosedVolume
        If the sets leave an incompressible body no room, and are those of the last step with springs.
    """
    problem, body = equations.problem, equations.problem.body
    linear, held = equations.linearised(residual, sets), problem.respond if n_regularised else problem.respond_with_room
    try:
        return Response(body.respond(linear), 1, is_regularised=False)
    except ClosedVolume:
        return Response(held(linear), 2, is_regularised=True)
    except SingularResponse:
        floating = floating_response(body, linear)
        if floating is not None:
            return Response(floating.nearest(residual.state.displacement), 2, is_regularised=False)
        decrease = _SPRING_DECREASE ** min(n_regularised, WEAKEST_AFTER)
        stiffness = spring_stiffness(problem, residual.state) * decrease
        springs = linear.regularised(residual.state.displacement, stiffness)
        return Response(held(springs), 2, is_regularised=True)


def spring_stiffness(problem: ContactProblem, state: ContactState) -> float:
    """Return a spring stiffness [Pa/m] with which the body reaches a far obstacle in about one step."""
    stress = Scales.of(problem, state).stress
    nearest = float(np.min(problem.gap - state.u_n))
    stiffness = problem.body.stiffness_scale
    if np.isfinite(nearest) and nearest > 0.0:
        return _SPRING_STIFFNESS * stiffness / (1.0 + _SPRING_STIFFNESS * stiffness * nearest / stress)
    return _SPRING_STIFFNESS * stiffness


def carried_on(problem: ContactProblem, before: ContactState, after: ContactState) -> ContactState:
    """Move a state that springs hold further in the direction of the step until the next node closes.

    A small force, such as that on a disc on a single node slightly out of equilibrium, hardly moves the body against
    the springs; weaker and weaker springs would finally not hold it.

    Parameters
    ----------
    problem : ContactProblem
    before, after : ContactState
        States at the beginning and the end of the step.

    Returns
    -------
    ContactState
        `after` if no node closes.
    """
    step, clearance = after.displacement - before.displacement, problem.gap - after.u_n
    closes = (clearance > 0.0) & (step[:, 0] > 0.0)
    if not closes.any():
        return after
    factor = _BEYOND * float(np.min(clearance[closes] / step[closes, 0]))
    return ContactState(after.displacement + factor * step, after.traction)


def merit(problem: ContactProblem, residual: Residual) -> float:
    """Return the weighted root mean square of the residual of (15), (16), relative to the stress of the certificate."""
    weights = problem.body.weights
    mean_square = float(weights @ (residual.value**2).sum(axis=1)) / float(weights.sum())
    stress = Scales.of(problem, residual.state).stress
    return float(np.sqrt(mean_square)) / stress


def consistent_state(problem: ContactProblem, guess: ContactState) -> tuple[ContactState, int]:
    """Return the response of the body to the sets of a guessed state, and the linear solves.

    Solvers start from states in equilibrium; a guess need not be in equilibrium. If a problem has several solutions,
    the guess selects one of them.

    Raises
    ------
    ValueError
        If the guess has another number of nodes, or entries that are not finite.
    SingularResponse
        If the body has no response even with springs.
    """
    if len(guess.displacement) != problem.n_contact:
        raise InputError(f"start has {len(guess.displacement)} nodes; the problem has {problem.n_contact}")
    if not guess.is_finite:
        raise InputError("start contains entries that are not finite; give finite displacements and tractions")
    equations = ProjectionEquations.scaled(problem)
    residual = equations.evaluate(guess, coheres(problem, guess))
    response = respond(equations, residual, residual.sets)
    return response.state, response.linear_solves


def negligible(body: LinearBody) -> float:
    """Return the relative residual that the accuracy of the responses permits."""
    return _NEGLIGIBLE * body.accuracy


@dataclass(frozen=True, eq=False)
class FloatingResponse:
    """Responses of a body in equilibrium whose position along its free motions is arbitrary.

    Parameters
    ----------
    state : ContactState
        One of the responses; the others differ by free motions.
    free_motions : (n_free, n_contact, 2) array
        Rigid motions that no condition holds.
    """

    state: ContactState
    free_motions: FloatArray

    def nearest(self, displacement: FloatArray) -> ContactState:
        """Return the response nearest to displacements (n_contact, 2) [m], by least squares over all contact nodes."""
        motions = self.free_motions.reshape(len(self.free_motions), -1)
        difference = (displacement - self.state.displacement).ravel()
        shift = np.linalg.lstsq(motions.T, difference, rcond=None)[0] @ motions
        return ContactState(self.state.displacement + shift.reshape(-1, 2), self.state.traction)

    def nearest_clear(self, displacement: FloatArray, gap: FloatArray) -> ContactState:
        """Return the nearest response, moved by the smallest free motion that moves all nodes out of the obstacle.

        Parameters
        ----------
        displacement : (n_contact, 2) array [m]
        gap : (n_contact,) array [m]

        Returns
        -------
        ContactState
            Not moved if no free motion clears the obstacle, or if the depth of a node exceeds 1e-3 of the displacement.

        Notes
        -----
        Let M_n be the normal components of orthonormal free motions. The smallest c with ``M_n c >= u_n - gap`` follows
        from the residual of a non-negative least-squares problem [LawsonHanson1974], chapter 23. Nodes are added as
        constraints one by one, the deepest node first.
        """
        from scipy.optimize import nnls

        state = self.nearest(displacement)
        motions = np.linalg.qr(self.free_motions.reshape(len(self.free_motions), -1).T)[0]
        depth, shift, nodes = state.u_n - gap, np.zeros(len(motions)), []
        if depth.max() > DEFORMED * np.abs(state.displacement).max():
            return state
        while (deepest := int(np.argmax(depth - shift[0::2]))) not in nodes and depth[deepest] > shift[2 * deepest]:
            nodes.append(deepest)
            rows = np.vstack([motions[2 * np.array(nodes)].T, depth[nodes] / np.abs(depth[nodes]).max()])
            residual = rows @ nnls(rows, np.eye(len(rows))[-1])[0] - np.eye(len(rows))[-1]
            if abs(residual[-1]) < _INFEASIBLE:
                return state
            shift = motions @ (np.abs(depth[nodes]).max() * residual[:-1] / -residual[-1])
        return ContactState(state.displacement - shift.reshape(-1, 2), state.traction)


def contact_free_response(body: LinearBody) -> FloatingResponse | None:
    """Return the response without contact, if the body has free rigid motions and the load does no work on them.

    Work by round-off of supports does not count.
    """
    return floating_response(body, separated(body.n_contact))


def floating_response(body: LinearBody, conditions: LinearConditions) -> FloatingResponse | None:
    """Return the response under conditions that do not hold all rigid motions.

    None if all are held, or if the forces are not in equilibrium. At conditions on tractions, as many displacements are
    pinned as there are free motions. The reactions of the pins are the residual of equilibrium; if they are round-off,
    the prescribed tractions replace them and are exact. Weak springs instead would cause a small traction at every
    node, which would count as contact.
    """
    free = _few(conditions.free_motions(body.rigid_motions()), body.n_contact)
    gives_traction = ~np.any(conditions.on_displacement != 0.0, axis=2)
    gives_traction[:, 1] &= ~body.tangent_follows  # whose displacement cannot be held
    if not len(free) or np.count_nonzero(gives_traction) < len(free):
        return None
    pins = _choose_pins(free, gives_traction)
    pinned = conditions.replaced(pins, stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    try:
        response = body.respond(pinned)
    except SingularResponse:
        return None
    traction = response.traction.copy()
    for row in (0, 1):  # first the normal traction, from which the friction of a slipping node follows
        nodes = np.flatnonzero(pins[:, row])
        factor, other_factor = conditions.on_traction[nodes, row, row], conditions.on_traction[nodes, row, 1 - row]
        traction[nodes, row] = (conditions.value[nodes, row] - other_factor * traction[nodes, 1 - row]) / factor
    state = ContactState(response.displacement, traction)
    return FloatingResponse(state, free) if body.imbalance(state).is_below(negligible(body)) else None


def with_least_slip(problem: ContactProblem, state: ContactState, sets: ActiveSets) -> ContactState:
    """Move a state along the rigid motions that its sets do not hold, to minimise the slip of contact nodes.

    For instance, contact does not determine the rotation of a disc in a frictionless hole, and round-off would
    determine it. The weighted mean square of the slip is minimised.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState
        A solution of the problem.
    sets : ActiveSets
        Sets of the state; see `contact_sets`.
    """
    motions = problem.body.rigid_motions()
    if not motions.shape[0]:
        return state
    sticking, open_nodes = stick(problem.gap, problem.slip_origin), separated(problem.n_contact)
    conditions = of_statuses(sets.is_closed, sets.direction != 0, sticking, open_nodes)
    free = as_rows(conditions.free_motions(motions))
    if not free.shape[0]:
        return state
    # least squares by normal equations, which have one unknown for each free motion
    tangential, weights = free[:, 1::2], problem.body.weights
    right_side = tangential @ (weights * (state.u_t - problem.slip_origin))
    weighted = tangential * weights if isinstance(tangential, np.ndarray) else tangential.multiply(weights).tocsr()
    normal = weighted @ tangential.T
    dense = normal if isinstance(normal, np.ndarray) else normal.toarray()
    amounts = -np.linalg.lstsq(dense, right_side, rcond=_NO_SLIP)[0]
    return ContactState(state.displacement + (free.T @ amounts).reshape(-1, 2), state.traction)


def _few(motions: RigidMotions, n_contact: int) -> FloatArray:
    """Return motions as a dense array (n, n_contact, 2); none if there are too many to pin them."""
    return as_dense(
        motions if motions.shape[0] <= _MOST_PINNED or isinstance(motions, np.ndarray) else motions[:0], n_contact
    )


def _choose_pins(free: FloatArray, allowed: BoolArray) -> BoolArray:
    """Return a mask (n_contact, 2) of allowed displacements that determine the free motions, one for each motion."""
    from scipy.linalg import qr

    candidates = np.flatnonzero(allowed)
    _, order = qr(free.reshape(len(free), -1)[:, candidates], mode="r", pivoting=True)
    pins = np.zeros(allowed.shape, dtype=bool)
    pins.flat[candidates[order[: len(free)]]] = True
    return pins
