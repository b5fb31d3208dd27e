"""Conformance of linear solvers."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.linear_solvers import LinearSolver, SingularMatrixError
from bemkit.testing.failure import class_name, demand

_ORDER = 40


def check_linear_solver(solver: LinearSolver, *, rtol: float = 1e-7) -> None:
    """Check everything that `LinearSolver` promises; call it on your own solver.

    Parameters
    ----------
    solver : LinearSolver
    rtol : float
        Allowed errors, relative to the solution in the energy norm.

    Raises
    ------
    CheckFailed
        Naming the solver, the promise broken, and by how much.
    """
    name = class_name(solver)
    random = np.random.default_rng(0)
    matrix = _string(_ORDER)
    before = matrix.copy()
    exact = random.normal(size=(_ORDER, 3))
    exact[:, 2] = 0.0  # a right-hand side without forces
    right = matrix @ exact
    right_before = right.copy()

    factor = solver.factor(matrix, name)
    solution = factor.solve(right)
    demand(np.array_equal(matrix, before), f"{name} changes the matrix")
    demand(np.array_equal(right, right_before), f"{name} changes the right-hand sides")
    demand(solution.shape == right.shape, f"{name}: the solution has the shape {solution.shape}, not {right.shape}")
    worst = _energy_error(matrix, solution, exact)
    demand(worst <= rtol, f"{name}: the solution errs by {worst:.3g} in the energy norm")
    demand(not np.any(solution[:, 2]), f"{name}: zero forces cause displacements of {np.abs(solution[:, 2]).max():.3g}")
    single = factor.solve(right[:, 0])
    demand(single.shape == (_ORDER,), f"{name}: one right-hand side gives a solution of the shape {single.shape}")
    worst = _energy_error(matrix, single[:, None], exact[:, :1])
    demand(worst <= rtol, f"{name}: the solution of one right-hand side errs by {worst:.3g} in the energy norm")
    empty = factor.solve(np.zeros((_ORDER, 0)))
    demand(empty.shape == (_ORDER, 0), f"{name}: no right-hand side gives a solution of the shape {empty.shape}")
    _check_refusal(solver, name, right)


def _string(order: int) -> FloatArray:
    """Return the stiffness of a string, with springs of very different sizes along it."""
    matrix = 2.0 * np.eye(order) - np.eye(order, k=1) - np.eye(order, k=-1)
    scale = np.geomspace(1.0, 1e3, order)
    result: FloatArray = scale[:, None] * matrix * scale
    return result


def _energy_error(matrix: FloatArray, solution: FloatArray, exact: FloatArray) -> float:
    """Return the largest error of a column in the energy norm, relative to the column; columns of zeros aside."""
    error = solution - exact
    squares = np.einsum("im,ij,jm->m", error, matrix, error), np.einsum("im,ij,jm->m", exact, matrix, exact)
    is_moved = squares[1] > 0.0
    return float(np.sqrt(np.max(np.abs(squares[0][is_moved]) / squares[1][is_moved])))


def _check_refusal(solver: LinearSolver, name: str, right: FloatArray) -> None:
    indefinite = _string(_ORDER)
    indefinite[_ORDER // 2, _ORDER // 2] *= -1.0
    try:
        solver.factor(indefinite, "the matrix of the check").solve(right)
    except SingularMatrixError as error:
        demand("the matrix of the check" in str(error), f"{name}: the message {str(error)!r} does not name the matrix")
    else:
        demand(False, f"{name} solves with an indefinite matrix without a word")
