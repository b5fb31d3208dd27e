"""Lemke's algorithm on the linear complementarity problem of Coulomb friction: an independent check of the solvers.

It uses no projections, rho, active sets or Newton matrix. It pivots in a tableau of the compliance of the body and is
intended for small problems.
"""

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray, spread_fractions
from bemkit.contact.body import ClosedVolume, ContactState, stick
from bemkit.contact.further_laws import law_name
from bemkit.contact.laws import LawError
from bemkit.contact.problem import ContactProblem
from bemkit.errors import counted
from bemkit.operators.rigid_modes import as_dense
from bemkit.solvers.base import Iterate, Status, check_max_steps
from bemkit.solvers.newton import spring_stiffness

_RELATIVE_STIFFNESS = 1e-2
"""Stiffness of springs on free rigid motions, relative to that of the other solvers. Weaker springs let a body slide
far in few steps, but cost digits."""

_ROUND_OFF = 1e-11
"""Largest tableau entry, relative to the largest of its column, that is round-off of eliminations."""

_MOST_PIVOTS = 50
"""Largest number of pivots for each unknown."""


@dataclass(frozen=True)
class LemkePivoting:
    """Lemke's complementary pivoting in the normal forces, friction forces and slips of all contact nodes.

    Parameters
    ----------
    max_steps : int
        Largest number of steps. A held body takes one step, a body with free rigid motions a few.

    Notes
    -----
    The unknowns are the pressing force p, the friction forces b and f against backward and forward slip, and the
    magnitude of slip l, all non-negative. The problem is (Stewart and Trinkle)

        0 <= g - u_n          complementary to p,
        0 <= l + slip         complementary to b,
        0 <= l - slip         complementary to f,
        0 <= c + s p - b - f  complementary to l,

    where ``u = compliance (load + F)`` with the nodal forces ``F = (-p, b - f)``. The matrix is copositive for every
    friction coefficient, so Lemke's algorithm finds a solution if the body is held. Laws must be affine in the
    pressure.

    References
    ----------
    [StewartTrinkle1996]; [CottlePangStone1992], section 4.4.
    """

    max_steps: int = 30

    def __post_init__(self) -> None:
        check_max_steps(self.max_steps)

    def init(self, problem: ContactProblem, start: ContactState) -> Iterate:
        """Store the start, which matters only for free rigid motions.

        Raises
        ------
        ValueError
            If the friction bound is not affine in the pressure, or jumps when a node opens.
        """
        _affine_bound(problem)
        return Iterate(state=start)

    def step(self, problem: ContactProblem, iterate: Iterate) -> Iterate:
        """Pivot from the origin to a solution; it takes two responses for each contact node."""
        if problem.body.responses_are_expensive:
            return replace(iterate, ended=Status.TOO_COSTLY)
        try:
            stiffness, load, linear_solves = _probed(problem)
        except ClosedVolume:
            reason = "an incompressible body whose volume only contact nodes change has no stiffness, which Lemke takes"
            return replace(iterate, ended=Status.STALLED, message=reason)
        springs, spring_load = _springs(problem, iterate.state)
        try:
            compliance = np.asarray(np.linalg.inv(stiffness + springs), dtype=float)
        except np.linalg.LinAlgError:
            return replace(iterate, ended=Status.SINGULAR, message="the body has motions that are not listed as rigid")
        free = compliance @ (load + spring_load)
        matrix, vector, unit_force = _complementarity(problem, compliance, free)
        exists = np.isfinite(vector)  # nodes that can never touch have no pressing force
        unknowns = np.zeros(len(vector))
        solution, n_pivots = lemke(matrix[np.ix_(exists, exists)], vector[exists])
        spent = iterate.linear_solves + linear_solves + 1
        if solution is None:
            message = f"Lemke's algorithm ended on a ray after {counted(n_pivots, 'pivot')}"
            return replace(iterate, linear_solves=spent, ended=Status.STALLED, message=message)
        unknowns[exists] = solution
        pressed, backward, forward, _ = unit_force * unknowns.reshape(4, -1)
        force = np.stack([-pressed, backward - forward], axis=1)
        displacement = free + compliance @ force.ravel()
        # one step of iterative refinement, because weak springs cost digits of the inverse
        residual = load + spring_load + force.ravel() - (stiffness + springs) @ displacement
        displacement = (displacement + compliance @ residual).reshape(-1, 2)
        displacement = problem.respond(stick(*displacement.T)).displacement  # with the tangents that follow
        state = ContactState(displacement, force / problem.body.weights[:, None])
        return Iterate(state=state, linear_solves=spent, message=counted(n_pivots, "pivot"))


def lemke(matrix: FloatArray, vector: FloatArray) -> tuple[FloatArray | None, int]:
    """Return z with ``z >= 0``, ``w = matrix z + vector >= 0``, ``z w = 0``, by Lemke's algorithm.

    Parameters
    ----------
    matrix : (n, n) array
    vector : (n,) array

    Returns
    -------
    z : (n,) array or None
        None if the algorithm ends on a ray or runs out of pivots.
    n_pivots : int
    """
    n = len(vector)
    limit = _MOST_PIVOTS * n
    if vector.min() >= 0.0:
        return np.zeros(n), 0
    # columns: w (n), z (n), artificial variable, right-hand side; the covering vector is uneven to avoid ties
    cover = 1.0 + 0.5 * spread_fractions(n)
    tableau = np.hstack([np.eye(n), -matrix, -cover[:, None], vector[:, None]])
    basis = np.arange(n)
    row, entering = int(np.argmin(vector / cover)), 2 * n
    cover_at_start = -vector[row] / cover[row]
    for n_pivots in range(1, limit + 1):
        leaving = int(basis[row])
        tableau[row] /= tableau[row, entering]
        others = np.arange(n) != row
        tableau[others] -= np.outer(tableau[others, entering], tableau[row])
        basis[row] = entering
        if leaving == 2 * n:
            solution = np.zeros(2 * n)
            solution[basis] = np.maximum(tableau[:, -1], 0.0)
            return _solved_anew(matrix, vector, solution[n:], basis[basis >= n] - n), n_pivots
        entering = leaving + n if leaving < n else leaving - n
        covering = int(np.flatnonzero(basis == 2 * n)[0])
        next_row = _leaving_row(tableau[:, entering], tableau[:, -1], covering, cover_at_start)
        if next_row is None:
            return None, n_pivots
        row = next_row
    return None, limit


def _solved_anew(matrix: FloatArray, vector: FloatArray, found: FloatArray, basic: IntArray) -> FloatArray:
    """Return the solution of the last basis from a new factorisation, without the round-off of the pivots."""
    result = np.zeros_like(found)
    try:
        result[basic] = np.linalg.solve(matrix[np.ix_(basic, basic)], -vector[basic])
    except np.linalg.LinAlgError:
        return found
    is_same = np.allclose(result, found, rtol=0.0, atol=1e-6 * found.max(initial=0.0))
    # variables that are zero in a degenerate basis may come out on the other side of it
    return np.maximum(result, 0.0) if is_same else found


def _leaving_row(column: FloatArray, right_side: FloatArray, covering: int, cover_at_start: float) -> int | None:
    """Return the row whose variable reaches zero first when the entering one grows; None if none does (a ray)."""
    may_leave = column > _ROUND_OFF * np.abs(column).max()
    if not may_leave.any():
        return None
    ratio = np.full(len(column), np.inf)
    ratio[may_leave] = np.maximum(right_side[may_leave], 0.0) / column[may_leave]
    row = int(np.argmin(ratio))
    # Of equal rows the covering variable leaves first: the problem is then solved. Rows are often equal there,
    # because an open node has no friction either.
    left_over = right_side[covering] - ratio[row] * column[covering]
    return covering if may_leave[covering] and left_over <= _ROUND_OFF * cover_at_start else row


def _affine_bound(problem: ContactProblem) -> tuple[FloatArray, FloatArray]:
    """Return (c, s) of ``bound = c + s |sigma_n|``."""
    none = np.zeros(problem.n_contact)
    cohesion = problem.friction_bound(none)
    stress = float(np.abs(problem.sticking_state.traction).max()) or 1.0
    coefficient = (problem.friction_bound(none - stress) - cohesion) / stress
    far = problem.friction_bound(none - 1e3 * stress)
    is_affine = np.allclose(far, cohesion + 1e3 * stress * coefficient, rtol=1e-9, atol=0.0)
    if not is_affine or np.any((cohesion > 0.0) & ~np.asarray(problem.law.acts_across_gap)):
        raise LawError(
            f"LemkePivoting cannot treat the friction law {law_name(problem.law)}: its bound must be "
            "c + s |sigma_n| without cap, and c = 0 unless it acts across the gap; use SemismoothNewton"
        )
    return cohesion, coefficient


def _probed(problem: ContactProblem) -> tuple[FloatArray, FloatArray, int]:
    """Return stiffness and load of a body from its responses to unit displacements, and the linear solves.

    Tangents that follow, on which no force acts, get separate springs.
    """
    body, n_contact = problem.body, problem.n_contact
    weights = np.repeat(body.weights, 2)
    none = np.zeros(n_contact)
    amount = (float(np.abs(problem.sticking_state.traction).max()) or 1.0) / body.stiffness_scale
    at_rest = problem.respond(stick(none, none)).traction.ravel()
    stiffness = np.empty((2 * n_contact, 2 * n_contact))
    for column, unit in enumerate(amount * np.eye(2 * n_contact)):
        response = problem.respond(stick(unit[0::2], unit[1::2])).traction.ravel()
        stiffness[:, column] = weights * (response - at_rest) / amount
    idle = 2 * np.flatnonzero(body.tangent_follows) + 1
    stiffness[idle, idle] = weights[idle] * body.stiffness_scale
    return stiffness, -weights * at_rest, 2 * n_contact + 1


def _springs(problem: ContactProblem, state: ContactState) -> tuple[FloatArray, FloatArray]:
    """Return stiffness and load of springs on the free rigid motions, with zero force at the given state.

    The springs move with the body from step to step, and their forces vanish in the solution.
    """
    n_unknowns = 2 * problem.n_contact
    motions = as_dense(problem.body.rigid_motions(), problem.n_contact)
    if not len(motions):
        return np.zeros((n_unknowns, n_unknowns)), np.zeros(n_unknowns)
    is_unknown = np.stack([np.ones(problem.n_contact), ~problem.body.tangent_follows], axis=1)
    motions = (motions * is_unknown).reshape(len(motions), -1)
    orthonormal = np.linalg.qr(motions.T)[0]
    scale = _RELATIVE_STIFFNESS * spring_stiffness(problem, state) * float(np.median(problem.body.weights))
    springs = scale * orthonormal @ orthonormal.T
    return springs, springs @ state.displacement.ravel()


def _complementarity(
    problem: ContactProblem, compliance: FloatArray, free: FloatArray
) -> tuple[FloatArray, FloatArray, float]:
    """Return matrix and vector for nodal forces in units of the returned force.

    The unit of slip is the displacement by that force. So the off-diagonal blocks cancel in the quadratic form, and the
    matrix is copositive.
    """
    cohesion, coefficient = _affine_bound(problem)
    normal, tangential = slice(0, None, 2), slice(1, None, 2)
    force = float(np.abs(problem.body.weights[:, None] * problem.sticking_state.traction).max()) or 1.0
    unit_compliance = float(np.abs(compliance).max())
    length = force * unit_compliance
    relative = compliance / unit_compliance
    nn, nt = relative[normal, normal], relative[normal, tangential]
    tn, tt = relative[tangential, normal], relative[tangential, tangential]
    none, unit = np.zeros_like(nn), np.eye(problem.n_contact)
    matrix = np.block(
        [
            [nn, -nt, nt, none],
            [-tn, tt, -tt, unit],
            [tn, -tt, tt, unit],
            [np.diag(coefficient), -unit, -unit, none],
        ]
    )
    clearance = problem.gap - free[normal]
    slip = free[tangential] - problem.slip_origin
    most_friction = problem.body.weights * cohesion / force
    vector = np.concatenate([clearance / length, slip / length, -slip / length, most_friction])
    return matrix, vector, force
