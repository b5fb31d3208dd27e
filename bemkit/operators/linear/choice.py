"""Which linear solver a body gets whose equations are symmetric and dense, with the reason."""

from __future__ import annotations

from bemkit.operators.linear.solvers import (
    Automatic,
    ChosenLinearSolver,
    DenseCholesky,
    Hierarchical,
    LinearSolverChoice,
    MatrixFree,
)


def choose_linear_solver(requested: LinearSolverChoice) -> ChosenLinearSolver:
    """Choose the linear solver of a body whose Steklov-Poincare map is symmetric and formed.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical, MatrixFree or Automatic

    Returns
    -------
    ChosenLinearSolver
        A linear solver that was asked for, else Cholesky.
    """
    if not isinstance(requested, Automatic | Hierarchical | MatrixFree):
        return ChosenLinearSolver(requested, "asked for")
    without = {Automatic: "", Hierarchical: "not compressed over a tree, but ", MatrixFree: "not matrix-free, but "}
    return ChosenLinearSolver(DenseCholesky(), f"{without[type(requested)]}Cholesky, because S is positive definite")
