"""Newton steps on the projection equations, shared by all drivers, also where they leave the body free to move."""

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.conditions import (
    LinearConditions,
    RigidMotions,
    as_dense,
    as_rows,
    of_statuses,
    separated,
    stick,
)
from bemkit.contact.problem import (
    DEFORMED,
    ContactProblem,
    ContactState,
    LinearBody,
    SingularResponse,
    certificate_scales,
)
from bemkit.errors import InputError
from bemkit.solvers.active_sets import ActiveSets, ProjectionEquations, Residual, coheres

_SPRING = 1e-3
"""Springs that hold an unheld body, in units of its stiffness scale. Small: each further step reduces what the
springs still carry by about this factor. Not tiny: the response must stay well determined."""

_WEAKER = 0.1
WEAKEST_AFTER = 8
"""Springs become weaker by the factor with every step that ends in the sets it began with, so that a small force soon
carries the body to where other sets hold it; so many times at most."""

_BEYOND = 1.01
"""Share of the way to the next node that closes by which a body is carried there: a little beyond it, so that the node
counts as closed although springs pull it back, and no other one does."""

_NEGLIGIBLE = 100.0
"""Residuals and imbalances below this many times the accuracy of a body mean nothing. Of a direct solver that is 1e-12:
a certificate asks for 1e-9, but a load of 1e-10 may still carry a body to an obstacle."""

_UNFELT = 1e-12
"""Squared size of slips, relative to the largest, below which a motion makes no slip."""

_JAMMED = 1e-12
"""Rest of a least-squares problem below which there is no way out of the obstacle."""

_MOST_PINNED = 60
"""Of more free motions than that the forces are not sorted out: springs hold them."""


@dataclass(frozen=True, eq=False)
class Response:
    """Answer of the body to Newton's linear equations.

    Parameters
    ----------
    state : ContactState
    linear_solves : int
        Linear systems spent.
    is_regularised : bool
        Whether the conditions left the body free to move, so that springs had to hold it in this step.
    """

    state: ContactState
    linear_solves: int
    is_regularised: bool


def respond(equations: ProjectionEquations, residual: Residual, sets: ActiveSets, n_regularised: int = 0) -> Response:
    """Solve the equations linearised at a residual, for the given sets.

    If the sets do not hold the body, it stays near its present displacements: exactly there if the forces on it
    balance, or else held by weak springs during this step, weaker after `n_regularised` such steps with the same sets.
    Raises `SingularResponse` if even springs at all free nodes do not hold it.
    """
    body = equations.problem.body
    linear = equations.linearised(residual, sets)
    try:
        return Response(body.respond(linear), 1, is_regularised=False)
    except SingularResponse:
        floating = floating_response(body, linear)
        if floating is not None:
            return Response(floating.nearest(residual.state.displacement), 2, is_regularised=False)
        stiffness = spring_stiffness(equations.problem, residual.state) * _WEAKER ** min(n_regularised, WEAKEST_AFTER)
        springs = linear.regularised(residual.state.displacement, stiffness)
        return Response(equations.problem.respond(springs), 2, is_regularised=True)


def spring_stiffness(problem: ContactProblem, state: ContactState) -> float:
    """Return the stiffness of springs [Pa/m] so weak that the body reaches a far obstacle in about one step."""
    stress, _ = certificate_scales(problem, state)
    nearest = float(np.min(problem.gap - state.u_n))
    stiffness = problem.body.stiffness_scale
    if np.isfinite(nearest) and nearest > 0.0:
        return _SPRING * stiffness / (1.0 + _SPRING * stiffness * nearest / stress)
    return _SPRING * stiffness


def carried_on(problem: ContactProblem, before: ContactState, after: ContactState) -> ContactState:
    """Return a state in which springs hold a body, moved on the way it takes until the next open node closes.

    A force so small that it hardly moves the body against the springs would need ever weaker ones, and these at last
    let go: a disc that stands on a single node, a little out of balance. If no node closes, it stays where it is.
    """
    way, clearance = after.displacement - before.displacement, problem.gap - after.u_n
    closes = (clearance > 0.0) & (way[:, 0] > 0.0)
    if not closes.any():
        return after
    share = _BEYOND * float(np.min(clearance[closes] / way[closes, 0]))
    return ContactState(after.displacement + share * way, after.traction)


def merit(problem: ContactProblem, residual: Residual) -> float:
    """Return the size of the residual of (15), (16) in the weighted mean square, relative to the traction scale."""
    weights = problem.body.weights
    mean_square = float(weights @ (residual.value**2).sum(axis=1)) / float(weights.sum())
    stress, _ = certificate_scales(problem, residual.state)
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
    equations = ProjectionEquations(problem, rho, rho)
    residual = equations.evaluate(guess, coheres(problem, guess))
    response = respond(equations, residual, residual.sets)
    return response.state, response.linear_solves


def negligible(body: LinearBody) -> float:
    """Return the relative size below which a residual is nothing but the inaccuracy of the body's responses."""
    return _NEGLIGIBLE * body.accuracy


@dataclass(frozen=True, eq=False)
class FloatingResponse:
    """Forces in balance without help from the obstacle, and a body that may be anywhere along its free motions.

    Parameters
    ----------
    state : ContactState
        One of its positions.
    free_motions : (n_free, n_contact, 2) array
        Rigid motions that change no condition.
    """

    state: ContactState
    free_motions: FloatArray

    def nearest(self, displacement: FloatArray) -> ContactState:
        """Return the position nearest to displacements (n_contact, 2) [m], by least squares over all contact nodes."""
        motions = self.free_motions.reshape(len(self.free_motions), -1)
        way = (displacement - self.state.displacement).ravel()
        shift = np.linalg.lstsq(motions.T, way, rcond=None)[0] @ motions
        return ContactState(self.state.displacement + shift.reshape(-1, 2), self.state.traction)

    def nearest_clear(self, displacement: FloatArray, gap: FloatArray) -> ContactState:
        """Return the nearest position, moved by the least that takes all nodes out of the obstacle.

        That is done only where it is little beside the displacement, and where it can be. The least c with
        ``motions_n^T c >= u_n - gap`` is the rest of a least-squares problem whose factors are not negative; of the
        nodes only those count that have been the deepest.

        Parameters
        ----------
        displacement : (n_contact, 2) array [m]
        gap : (n_contact,) array [m]
        """
        from scipy.optimize import nnls

        state = self.nearest(displacement)
        motions = np.linalg.qr(self.free_motions.reshape(len(self.free_motions), -1).T)[0]
        depth, shift, asked = state.u_n - gap, np.zeros(len(motions)), []
        if depth.max() > DEFORMED * np.abs(state.displacement).max():
            return state
        while (deepest := int(np.argmax(depth - shift[0::2]))) not in asked and depth[deepest] > shift[2 * deepest]:
            asked.append(deepest)
            rows = np.vstack([motions[2 * np.array(asked)].T, depth[asked] / np.abs(depth[asked]).max()])
            rest = rows @ nnls(rows, np.eye(len(rows))[-1])[0] - np.eye(len(rows))[-1]
            if abs(rest[-1]) < _JAMMED:
                return state
            shift = motions @ (np.abs(depth[asked]).max() * rest[:-1] / -rest[-1])
        return ContactState(state.displacement - shift.reshape(-1, 2), state.traction)


def untouched_response(body: LinearBody) -> FloatingResponse | None:
    """Return the response without any contact, if the body floats and the load on it balances.

    Then no load pushes it anywhere, whatever round-off supports leave that carry it along.
    """
    return floating_response(body, separated(body.n_contact))


def floating_response(body: LinearBody, conditions: LinearConditions) -> FloatingResponse | None:
    """Return the response under conditions that leave rigid motions free, if there are any and forces balance.

    Where only tractions are prescribed, as many displacements are held as there are free motions: just enough to
    determine the response, so that their reactions are what is out of balance. If that is round-off, the prescribed
    tractions take their place. The result carries them to the last digit; weak springs would leave a little
    everywhere, which a condition such as "friction only where something presses" cannot tell from contact.
    """
    free = _few(conditions.free_motions(body.rigid_motions()), body.n_contact)
    gives_traction = ~np.any(conditions.on_displacement != 0.0, axis=2)
    gives_traction[:, 1] &= ~body.tangent_is_eliminated  # whose displacement cannot be held
    if not len(free) or np.count_nonzero(gives_traction) < len(free):
        return None
    pins = _determinate(free, gives_traction)
    held = conditions.replaced(pins, stick(np.zeros(body.n_contact), np.zeros(body.n_contact)))
    try:
        response = body.respond(held)
    except SingularResponse:
        return None
    traction = response.traction.copy()
    own = np.einsum("nii->ni", conditions.on_traction)
    other = np.stack([conditions.on_traction[:, 0, 1], conditions.on_traction[:, 1, 0]], axis=1)
    for row in (0, 1):  # the friction of a slipping node follows its pressure
        node = np.flatnonzero(pins[:, row])
        rest = conditions.value[node, row] - other[node, row] * traction[node, 1 - row]
        traction[node, row] = rest / own[node, row]
    state = ContactState(response.displacement, traction)
    return FloatingResponse(state, free) if body.imbalance(state).is_below(negligible(body)) else None


def with_least_slip(problem: ContactProblem, state: ContactState, sets: ActiveSets) -> ContactState:
    """Return a state moved along the rigid motions that its sets leave free, so that contact nodes slip least.

    Nothing says how far a disc turns in a hole without friction; responses leave it where round-off has put it.

    Parameters
    ----------
    problem : ContactProblem
    state : ContactState
        That obeys it.
    sets : ActiveSets
        Its own; see `contact_sets`.
    """
    motions = problem.body.rigid_motions()
    if not motions.shape[0]:
        return state
    held, given = stick(problem.gap, problem.slip_origin), separated(problem.n_contact)
    conditions = of_statuses(sets.is_closed, sets.direction != 0, held, given)
    free = as_rows(conditions.free_motions(motions))
    if not free.shape[0]:
        return state
    along, weights = free[:, 1::2], problem.body.weights
    work = along @ (weights * (state.u_t - problem.slip_origin))
    weighted = along * weights if isinstance(along, np.ndarray) else along.multiply(weights).tocsr()
    squares = weighted @ along.T
    dense = squares if isinstance(squares, np.ndarray) else squares.toarray()
    amounts = -np.linalg.lstsq(dense, work, rcond=_UNFELT)[0]
    return ContactState(state.displacement + (free.T @ amounts).reshape(-1, 2), state.traction)


def _few(motions: RigidMotions, n_contact: int) -> FloatArray:
    """Return motions as a dense array (n, n_contact, 2), none if there are too many to be pinned one by one."""
    return as_dense(
        motions if motions.shape[0] <= _MOST_PINNED or isinstance(motions, np.ndarray) else motions[:0], n_contact
    )


def _determinate(free: FloatArray, allowed: BoolArray) -> BoolArray:
    """Return (n_contact, 2) bool: as many of the allowed displacements as there are free motions, and independent."""
    from scipy.linalg import qr

    candidates = np.flatnonzero(allowed)
    _, order = qr(free.reshape(len(free), -1)[:, candidates], mode="r", pivoting=True)
    pins = np.zeros(allowed.shape, dtype=bool)
    pins.flat[candidates[order[: len(free)]]] = True
    return pins
