"""Search for several solutions of one problem."""

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.certificate import Scales
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.solvers.base import ContactSolution, ContactSolver, solve


def probe(problem: ContactProblem, solver: ContactSolver, *, n_starts: int = 8) -> tuple[ContactSolution, ...]:
    """Solve from several starts and return the distinct certified solutions.

    With Coulomb friction a problem may have several solutions; the start selects one of them.

    Parameters
    ----------
    problem : ContactProblem
    solver : ContactSolver
    n_starts : int
        Number of starts: all nodes sticking, open, slipping forward, slipping backward, then random statuses with a
        fixed seed.

    Returns
    -------
    tuple of ContactSolution
        Empty if no start leads to a solution. A single solution is no proof of uniqueness.

    Raises
    ------
    ValueError
        If `n_starts` is negative.
    """
    if n_starts < 0:
        raise InputError(f"n_starts = {n_starts}; give zero or a positive number")
    random = np.random.default_rng(0)
    uniform = [1, 0, 2, 3]
    choices = [np.full(problem.n_contact, status) for status in uniform[:n_starts]]
    choices += [random.integers(0, 4, problem.n_contact) for _ in range(n_starts - len(choices))]
    distinct: list[ContactSolution] = []
    for choice in choices:
        solution = solve(problem, solver, start=start_with(problem, choice), throw=False)
        if solution.is_converged and not any(_is_same(problem, solution.state, other.state) for other in distinct):
            distinct.append(solution)
    return tuple(distinct)


def start_with(problem: ContactProblem, node_status: Sequence[int] | IntArray) -> ContactState:
    """Return an initial guess with given node statuses, to select a branch of solutions.

    Parameters
    ----------
    problem : ContactProblem
    node_status : (n_contact,) sequence of `NodeStatus` values

    Returns
    -------
    ContactState
        Not in equilibrium; `solve` uses its statuses only.
    """
    status = np.asarray(node_status)
    scales = Scales.of(problem, problem.sticking_state)
    is_closed = (status != 0) & np.isfinite(problem.gap)
    direction = np.where(status == 2, 1.0, 0.0) - np.where(status == 3, 1.0, 0.0)
    sigma_n = np.where(is_closed, -scales.stress, 0.0)
    slip = direction * (2.0 * problem.friction_bound(sigma_n) / problem.body.stiffness_scale + scales.length)
    resting = np.where(np.isfinite(problem.gap), problem.gap, 0.0)
    u_n = np.where(is_closed, resting, resting - scales.length)
    return ContactState(
        np.stack([u_n, problem.slip_origin + slip], axis=1), np.stack([sigma_n, np.zeros_like(sigma_n)], axis=1)
    )


def _is_same(problem: ContactProblem, state: ContactState, other: ContactState) -> bool:
    scales = Scales.of(problem, state)
    length = max(scales.length, float(np.abs(state.displacement).max()))
    return bool(
        np.abs(state.displacement - other.displacement).max() < 1e-6 * length
        and np.abs(state.traction - other.traction).max() < 1e-6 * scales.stress
    )
