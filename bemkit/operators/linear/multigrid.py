"""One multigrid cycle on a dense matrix, over a hierarchy that pyamg finds in a sparse one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.linear.dense import Cholesky, multiply

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix


@dataclass(frozen=True, eq=False)
class _Level:
    """A dense matrix and the way down to the next coarser one."""

    matrix: FloatArray
    prolongation: csr_matrix


class Multigrid:
    """A symmetric V-cycle, the approximate inverse of a dense symmetric positive definite matrix.

    Parameters
    ----------
    matrix : (n, n) array
        Row-major; kept, not copied.
    neighbours : (n, n) sparse matrix
        Symmetric positive definite, with the same smooth functions at the lower end of its spectrum; its
        Ruge-Stueben hierarchy [RugeStueben1987] is taken for the dense matrix as well.
    coarsest : int
        Order from which on a matrix is factored instead of coarsened.
    name : str
        What the matrix stands for, for messages.

    Raises
    ------
    SingularMatrixError
        If the matrix of the coarsest level is not positive definite.

    Notes
    -----
    The matrices of the coarser levels are Galerkin products P^T A P. Smoothing is one sweep of Gauss-Seidel forwards
    before and one backwards after the correction, which is a triangular solve with one half of the dense matrix.
    """

    def __init__(self, matrix: FloatArray, neighbours: csr_matrix, *, coarsest: int, name: str) -> None:
        self._levels: list[_Level] = []
        if len(matrix) > coarsest:
            from pyamg import ruge_stuben_solver

            hierarchy = ruge_stuben_solver(neighbours, max_coarse=coarsest, max_levels=30)
            for level in hierarchy.levels[:-1]:
                down = level.P.T.tocsr()
                self._levels.append(_Level(matrix, level.P.tocsr()))
                matrix = down @ np.ascontiguousarray((down @ matrix).T)
        self._coarsest = Cholesky(matrix, name)

    @property
    def orders(self) -> tuple[int, ...]:
        """The orders of the matrices, from the finest to the coarsest."""
        return (*(len(level.matrix) for level in self._levels), self._coarsest.factorisation.order)

    def apply(self, right: FloatArray) -> FloatArray:
        """Return the result of one cycle for the columns of `right` (n, m)."""
        return self._cycle(0, right)

    def _cycle(self, number: int, right: FloatArray) -> FloatArray:
        if number == len(self._levels):
            return self._coarsest.solve(right)
        level = self._levels[number]
        solution = _sweep(level.matrix, right, is_forward=True)
        residual = right - multiply(level.matrix, solution)
        solution += level.prolongation @ self._cycle(number + 1, level.prolongation.T @ residual)
        residual = right - multiply(level.matrix, solution)
        return solution + _sweep(level.matrix, residual, is_forward=False)


def _sweep(matrix: FloatArray, right: FloatArray, *, is_forward: bool) -> FloatArray:
    """Solve with the lower triangle of a symmetric matrix, or with its transpose."""
    from scipy.linalg.lapack import dtrtrs

    return np.asarray(dtrtrs(matrix.T, right, lower=1, trans=0 if is_forward else 1)[0])
