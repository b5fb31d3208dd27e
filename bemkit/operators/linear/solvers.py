"""Linear solvers for the displacements of a body outside of its contact boundary."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol, TypeAlias

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.counts import Factorisation
from bemkit.operators.linear.dense import Cholesky


class Factor(Protocol):
    """A factored matrix A."""

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """The factorisations, for operation counts."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Return A^-1 right for (order,) or (order, m) arrays."""


class LinearSolver(Protocol):
    """Solves for the free displacements of a body whose matrix is formed."""

    def factor(self, matrix: FloatArray, name: str) -> Factor:
        """Factor a matrix.

        Parameters
        ----------
        matrix : (order, order) array
            Symmetric positive definite; not changed.
        name : str
            Name of the matrix in messages.

        Raises
        ------
        SingularMatrixError
            If the matrix is not positive definite; raised here or by `Factor.solve`.
        """


@dataclass(frozen=True)
class DenseCholesky:
    """Cholesky factorisation of the dense matrix."""

    def factor(self, matrix: FloatArray, name: str) -> Cholesky:
        """Return the Cholesky factor."""
        return Cholesky(matrix, name)


@dataclass(frozen=True)
class Automatic:
    """Choose dense or compressed equations: the faster ones that fit into memory."""


@dataclass(frozen=True)
class Hierarchical:
    """Boundary equations compressed over a tree and factored: time and memory grow like the number of elements.

    It requires constant collocation; scenes with Galerkin elements are refused. Bodies whose equations cannot be
    compressed are solved as by `Automatic`; the plan gives the reason.

    Parameters
    ----------
    tolerance : float
        Relative error of the compression; errors of tractions and displacements are a few times as large.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-12 and 1e-8. Smaller tolerances cannot be reached in double precision, and
        from 1e-7 on residuals may exceed the 1e-9 that certificates allow.
    """

    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        if not 1e-12 <= self.tolerance <= 1e-8:
            raise InputError(
                f"tolerance is {self.tolerance}: give a number from 1e-12 (round-off) to 1e-8 (the "
                "certificate), such as 1e-10"
            )

    @property
    def accuracy(self) -> float:
        """Largest expected error of tractions and displacements: ten times the tolerance.

        Errors of two to four times the tolerance were measured, on bodies from a strip of 100 : 1 to a plate with a
        hole.
        """
        return 10.0 * self.tolerance


@dataclass(frozen=True)
class MatrixFree:
    """Boundary equations solved by GMRES with products by the fast multipole method, in a fraction of the memory.

    It requires constant collocation on straight elements. Other equations are solved as by `Automatic`; the plan gives
    the reason. A response takes about seventeen products or fewer, for any number of elements.

    Parameters
    ----------
    tolerance : float
        Tolerance of the preconditioned residual, in the mean of all elements. The largest residual of an equation,
        which certificates bound by 1e-9, is at most 2.5 times larger.
    max_steps : int
        Largest number of steps of a response.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-11 and 3e-10, or there is no step.
    """

    tolerance: float = 1e-10
    max_steps: int = 100

    def __post_init__(self) -> None:
        if not 1e-11 <= self.tolerance <= 3e-10:
            raise InputError(
                f"tolerance is {self.tolerance}: give a number from 1e-11 (round-off) to 3e-10 (the "
                "certificate), such as 1e-10"
            )
        if self.max_steps < 1:
            raise InputError(f"max_steps is {self.max_steps}: give a positive whole number")

    @property
    def accuracy(self) -> float:
        """Largest expected error of tractions and displacements: a hundred times the tolerance.

        Errors of tractions are largest where the contact status changes.
        """
        return 100.0 * self.tolerance


LinearSolverChoice: TypeAlias = Automatic | Hierarchical | MatrixFree | LinearSolver


@dataclass(frozen=True)
class ChosenLinearSolver:
    """A linear solver and the reason for its choice.

    Parameters
    ----------
    solver : LinearSolver
    reason : str
        Part of a sentence, for the plan.
    hierarchical : Hierarchical or MatrixFree, optional
        If given, the equations are compressed over a tree or not stored, and `solver` is not used.
    """

    solver: LinearSolver
    reason: str
    hierarchical: Hierarchical | MatrixFree | None = None


def choose_linear_solver(requested: LinearSolverChoice) -> ChosenLinearSolver:
    """Choose the linear solver of a body with a symmetric Steklov-Poincare matrix.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical, MatrixFree or Automatic

    Returns
    -------
    ChosenLinearSolver
        The requested linear solver if there is one, otherwise Cholesky.
    """
    if not isinstance(requested, Automatic | Hierarchical | MatrixFree):
        return ChosenLinearSolver(requested, "asked for")
    without = {Automatic: "", Hierarchical: "not compressed over a tree, but ", MatrixFree: "not matrix-free, but "}
    return ChosenLinearSolver(DenseCholesky(), f"{without[type(requested)]}Cholesky, because S is positive definite")
