"""Dense factorisations with LAPACK, whose errors name the matrix."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.counts import Factorisation, FactorKind


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


_SMALLEST_PIVOT = 1e-13
"""Smallest pivot relative to the largest entry of its column; smaller pivots are round-off."""


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
    def factorisation(self) -> Factorisation:
        """Operation counts."""
        return Factorisation(FactorKind.CHOLESKY, len(self._factor))

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """A tuple with the only factorisation."""
        return (self.factorisation,)

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
    def factorisation(self) -> Factorisation:
        """Operation counts."""
        return Factorisation(FactorKind.LU, len(self._factor))

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
