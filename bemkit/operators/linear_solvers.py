"""Linear solvers of bodies: dense factorisations with LAPACK, whose errors name the matrix, and options of others."""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.counts import Factorisation, FactorKind

_SMALLEST_PIVOT = 1e-13
"""Smallest pivot relative to the largest entry of its column; smaller pivots are round-off."""


class Tag(enum.Enum):
    """Properties of an operator; `bemkit.testing.check_operator` verifies each one."""

    SYMMETRIC = "symmetric"
    POSITIVE_DEFINITE = "positive definite"
    POSITIVE_SEMIDEFINITE = "positive semidefinite"
    KILLS_RIGID_MOTIONS = "zero on rigid motions"
    KILLS_TRANSLATIONS = "zero on translations"


def multiply(left: FloatArray, right: FloatArray) -> FloatArray:
    """Return left @ right by the BLAS of scipy.

    numpy and scipy have separate BLAS libraries, whose threads keep spinning for a while after each call. Products
    between LAPACK calls are several times faster if both use the same library.
    """
    from scipy.linalg.blas import dgemm

    a, trans_a = (left.T, 1) if left.flags.c_contiguous else (left, 0)
    b, trans_b = (right.T, 1) if right.flags.c_contiguous else (right, 0)
    return np.asarray(dgemm(1.0, a, b, trans_a=trans_a, trans_b=trans_b))


def subtract_product(target: FloatArray, left: FloatArray, right: FloatArray) -> None:
    """Subtract left @ right.T from a column-major array in place."""
    from scipy.linalg.blas import dgemm

    dgemm(-1.0, left, right, beta=1.0, c=target, trans_b=1, overwrite_c=1)


class SingularMatrixError(InputError):
    """A matrix is singular; the message names it."""


class Cholesky:
    """Cholesky factors of a symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) array
    name : str
        Name of the matrix in the message.
    overwrite : bool
        Whether a row-major matrix may be overwritten.

    Raises
    ------
    SingularMatrixError
        If the matrix is not positive definite to working precision.
    """

    def __init__(self, matrix: FloatArray, name: str, *, overwrite: bool = False) -> None:
        from scipy.linalg.lapack import dpotrf

        # pivots are compared with their diagonal entries, which vary with the square of the grading of a mesh
        sizes = np.sqrt(np.abs(np.diag(matrix)))
        # the transpose of a row-major matrix is column-major and needs no copy
        column_major = np.asarray(matrix.T, order="F") if overwrite else np.array(matrix.T, order="F")
        self._factor, info = dpotrf(column_major, lower=1, overwrite_a=1, clean=0)
        pivots = np.diag(self._factor)
        if info or np.any(pivots <= 1e-14 * sizes):
            raise SingularMatrixError(
                f"{name} is not positive definite: check for coincident elements and for supports that leave "
                "the body free"
            )

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """A tuple with the only factorisation."""
        return (Factorisation(FactorKind.CHOLESKY, len(self._factor)),)

    def solve(self, right: FloatArray) -> FloatArray:
        """Solve A x = right."""
        from scipy.linalg.lapack import dpotrs

        if not right.size:  # LAPACK refuses empty systems, as of a body in contact on its whole boundary
            return np.zeros(right.shape)
        return np.asarray(dpotrs(self._factor, right, lower=1)[0])

    def solve_lower(self, right: FloatArray, *, overwrite: bool = False) -> FloatArray:
        """Solve L x = right with A = L L^T; a row-major right-hand side may be overwritten by the solution."""
        from scipy.linalg.blas import dtrsm

        # the transpose of a row-major matrix is column-major: solve x^T L^T = right^T in place
        x = np.array(right.reshape(len(right), -1), order="C", copy=None if overwrite else True)
        dtrsm(1.0, self._factor, x.T, side=1, lower=1, trans_a=1, overwrite_b=1)
        return x.reshape(right.shape)

    def solve_upper(self, right: FloatArray) -> FloatArray:
        """Solve L^T x = right with A = L L^T."""
        from scipy.linalg.lapack import dtrtrs

        return np.asarray(dtrtrs(self._factor, right, lower=1, trans=1)[0])


class DenseLU:
    """LU factors of a general square matrix.

    Parameters
    ----------
    matrix : (n, n) array
        Overwritten.
    name : str
        Name of the matrix in the message.

    Raises
    ------
    SingularMatrixError
        If the matrix is singular to working precision.
    """

    def __init__(self, matrix: FloatArray, name: str) -> None:
        from scipy.linalg.lapack import dgecon, dgetrf, dlange

        # columns belong to elements, whose size varies on graded meshes: scale them
        sizes = np.maximum(matrix.max(axis=0, initial=0.0), -matrix.min(axis=0, initial=0.0))
        self._column_sizes = np.where(sizes > 0.0, sizes, 1.0)
        matrix /= self._column_sizes
        # LAPACK uses column-major storage: factor the transpose of a row-major matrix, without a copy
        self._is_transposed = matrix.flags.c_contiguous and not matrix.flags.f_contiguous
        stored = matrix.T if self._is_transposed else matrix
        lange: Callable[..., float] = dlange  # some stubs lack its arguments
        norm = lange("1", stored)
        self._factor, self._pivots, info = dgetrf(stored, overwrite_a=1)
        reciprocal_condition = 0.0 if info else dgecon(self._factor, norm)[0]
        if not reciprocal_condition > 1e-15:
            raise SingularMatrixError(
                f"{name} is singular (reciprocal condition {reciprocal_condition:.1e}): "
                "check that the supports and contacts hold it"
            )

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """A tuple with the only factorisation."""
        return (Factorisation(FactorKind.LU, len(self._factor)),)

    def solve(self, right: FloatArray) -> FloatArray:
        """Solve A x = right."""
        from scipy.linalg.lapack import dgetrs

        solution = np.asarray(dgetrs(self._factor, self._pivots, right, trans=int(self._is_transposed))[0])
        solution /= self._column_sizes[(slice(None), *[None] * (solution.ndim - 1))]
        return solution


class SmallLU:
    """LU factors of one of many small matrices, whose columns may have any size.

    Parameters
    ----------
    matrix : (n, n) array
    error : SingularMatrixError
        Raised if the matrix is singular.
    smallest_size : float
        Lower bound of the column sizes with which pivots are compared.
    """

    def __init__(self, matrix: FloatArray, error: SingularMatrixError, smallest_size: float = 0.0) -> None:
        from scipy.linalg.lapack import dgetrf

        if not matrix.size:
            return
        sizes = np.maximum(np.abs(matrix).max(axis=0, initial=0.0), smallest_size)
        self._factor, self._pivots, info = dgetrf(matrix)
        if info or np.any(np.abs(np.diagonal(self._factor)) <= _SMALLEST_PIVOT * sizes):
            raise error

    def solve(self, right: FloatArray) -> FloatArray:
        """Solve A x = right."""
        from scipy.linalg.lapack import dgetrs

        if not right.size:
            return np.zeros(right.shape)
        return np.asarray(dgetrs(self._factor, self._pivots, right)[0])


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
