"""Linear solvers for the displacements of a body away from its contact boundary."""

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
        """Sizes of the factorisations, for the counts of a run."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Return A^-1 right for (order,) or (order, m) arrays."""


class LinearSolver(Protocol):
    """A way to solve for the free displacements of a body whose matrix is formed."""

    def factor(self, matrix: FloatArray, name: str) -> Factor:
        """Factor a matrix.

        Parameters
        ----------
        matrix : (order, order) array
            Symmetric positive definite; not changed.
        name : str
            Its name in messages.

        Raises
        ------
        SingularMatrixError
            If it is not positive definite; raised here or by `Factor.solve`.
        """


@dataclass(frozen=True)
class DenseCholesky:
    """Cholesky factorisation of the dense matrix."""

    def factor(self, matrix: FloatArray, name: str) -> Cholesky:
        """Return the Cholesky factor."""
        return Cholesky(matrix, name)


@dataclass(frozen=True)
class Automatic:
    """Dense or compressed equations, whichever take less time and fit into memory."""


@dataclass(frozen=True)
class Hierarchical:
    """Boundary equations compressed over a tree and factored: time and memory grow like the number of elements.

    For constant collocation; scenes with equations of Galerkin's method are refused. Bodies whose equations cannot be
    compressed are solved as by `Automatic`; the plan says why.

    Parameters
    ----------
    tolerance : float
        Relative error of the compression; errors of tractions and displacements are a few times as large.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-12 and 1e-8: finer ones cannot be met in double precision, and from 1e-7 on
        residuals of the equations may exceed the 1e-9 that certificates allow.
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
        """Largest error of tractions and displacements that is expected.

        Ten times the tolerance: two to four on bodies from a strip of 100 : 1 to a plate with a hole.
        """
        return 10.0 * self.tolerance


@dataclass(frozen=True)
class MatrixFree:
    """Boundary equations solved by GMRES with products by the fast multipole method, in a fraction of the memory.

    For constant collocation on straight elements. Other equations are solved as by `Automatic`; the plan says why.
    Every response takes up to about seventeen products, for any number of elements.

    Parameters
    ----------
    tolerance : float
        Of the residual after preconditioning, in the mean of all elements. The largest residual of an equation, which
        certificates bound by 1e-9, is at most 2.5 times that.
    max_steps : int
        Steps allowed for a response.

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
        """Largest error of tractions and displacements that is expected: a hundred times the tolerance.

        The error of tractions where the contact status changes is that much larger than the mean error.
        """
        return 100.0 * self.tolerance


LinearSolverChoice: TypeAlias = Automatic | Hierarchical | MatrixFree | LinearSolver


@dataclass(frozen=True)
class ChosenLinearSolver:
    """A linear solver and why it was taken.

    Parameters
    ----------
    solver : LinearSolver
    reason : str
        Part of a sentence, for the plan.
    hierarchical : Hierarchical or MatrixFree, optional
        Given if the equations are compressed over a tree or not stored at all, and not solved by `solver`.
    """

    solver: LinearSolver
    reason: str
    hierarchical: Hierarchical | MatrixFree | None = None


def choose_linear_solver(requested: LinearSolverChoice) -> ChosenLinearSolver:
    """Choose the linear solver of a body whose Steklov-Poincare map is symmetric and formed.

    Parameters
    ----------
    requested : LinearSolver, Hierarchical, MatrixFree or Automatic

    Returns
    -------
    ChosenLinearSolver
        The linear solver if one is requested, else Cholesky.
    """
    if not isinstance(requested, Automatic | Hierarchical | MatrixFree):
        return ChosenLinearSolver(requested, "asked for")
    without = {Automatic: "", Hierarchical: "not compressed over a tree, but ", MatrixFree: "not matrix-free, but "}
    return ChosenLinearSolver(DenseCholesky(), f"{without[type(requested)]}Cholesky, because S is positive definite")
