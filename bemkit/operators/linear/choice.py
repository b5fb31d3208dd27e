"""Which linear solver a body gets, from its size, with the reason.

With n displacements (and as many tractions), m of them retained for contact, a factorisation forms and factors S.
Iteration factors the single layer and the preconditioner, and takes a number of steps that depends neither on n nor on
m, each with five products of a matrix and a block of m + 1 columns. Flops tell the times of factorisations apart;
products with narrow blocks are slower, because the matrices come from memory again for each.
`tests/benchmarks/krylov.py` measures what is estimated here.
"""

from __future__ import annotations

from dataclasses import dataclass

from bemkit.operators.linear.solvers import (
    Automatic,
    ChosenLinearSolver,
    DenseCholesky,
    Hierarchical,
    Krylov,
    LinearSolverChoice,
    MatrixFree,
)

_BYTES = 8
_STEPS = 20.0
"""Steps of the iteration, with the products before and after it."""
_READ = 28.0
"""Flops of a factorisation that take as long as reading one number of a matrix from memory."""
_GAIN = 0.5
"""Predicted share of the time below which iteration is taken: narrow products suffer most on a busy computer."""


@dataclass(frozen=True)
class LinearCost:
    """What solving for the free displacements takes, the boundary operators included.

    Parameters
    ----------
    flops : float
        At the rate of a factorisation; those of assembly aside.
    peak : int [bytes]
        Largest memory.
    """

    flops: float
    peak: int


def direct_cost(n_dofs: int, n_retained: int) -> LinearCost:
    """Estimate forming S and factoring it.

    Parameters
    ----------
    n_dofs : int
        Displacements, about as many as tractions.
    n_retained : int
        Directions retained for contact.

    Returns
    -------
    LinearCost
    """
    n, m = float(n_dofs), float(n_retained)
    # factors of V and S, L^-1 K and its square; then the response of the free directions
    return LinearCost(8.0 / 3.0 * n**3 + 2.0 * n * n * m, int(_BYTES * (6.0 * n * n + 2.0 * n * m)))


def krylov_cost(n_dofs: int, n_retained: int) -> LinearCost:
    """Estimate the iteration, with the parameters of `direct_cost`."""
    n, m = float(n_dofs), float(n_retained)
    # factors of V and W; in each step W, K, K^T and both halves of the two factors
    step = 5.0 * n * n * (_READ + 2.0 * (m + 1.0))
    return LinearCost(2.0 / 3.0 * n**3 + _STEPS * step, int(_BYTES * (5.0 * n * n + 8.0 * n * (m + 1.0))))


def choose_linear_solver(
    requested: LinearSolverChoice, n_dofs: int, n_retained: int, memory: float = float("inf")
) -> ChosenLinearSolver:
    """Choose the linear solver of a body whose Steklov-Poincare map is symmetric.

    Parameters
    ----------
    requested : LinearSolver or Automatic
    n_dofs : int
        Displacements, about as many as tractions.
    n_retained : int
        Those retained for contact, each of which is a right-hand side.
    memory : float [bytes]
        Of the computer.

    Returns
    -------
    ChosenLinearSolver
        A linear solver that was asked for, or the faster one of those that fit.
    """
    if isinstance(requested, Hierarchical | MatrixFree):
        automatic = choose_linear_solver(Automatic(), n_dofs, n_retained, memory)
        without = "compressed over a tree" if isinstance(requested, Hierarchical) else "matrix-free"
        return ChosenLinearSolver(automatic.solver, f"not {without}, but {automatic.reason}")
    if not isinstance(requested, Automatic):
        return ChosenLinearSolver(requested, "asked for")
    direct, krylov = direct_cost(n_dofs, n_retained), krylov_cost(n_dofs, n_retained)
    share = krylov.flops / direct.flops
    sizes = f"{n_retained} of {n_dofs} displacements are retained for contact"
    if krylov.peak <= memory < direct.peak:
        reason = f"a factorisation needs about {direct.peak / 1e9:.3g} GB, this computer has {memory / 1e9:.3g} GB"
        return ChosenLinearSolver(Krylov(), f"conjugate gradients, because {reason}")
    if share < _GAIN:
        return ChosenLinearSolver(
            Krylov(), f"conjugate gradients, because only {sizes}: about {share:.2f} of the time of Cholesky"
        )
    reason = f"Cholesky, because {sizes}: conjugate gradients would take {share:.2g} times as long"
    return ChosenLinearSolver(DenseCholesky(), reason)
