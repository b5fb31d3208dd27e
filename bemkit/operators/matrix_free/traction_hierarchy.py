"""An approximate inverse of the single layer on the elements whose tractions are unknown, from pyamg's hierarchy.

The single layer smoothes by one order: on waves of the number xi along a straight boundary it is pi kappa / (8 pi mu
(1 - nu) |xi|). Its inverse, of the order one, is a difference before and after an operator of the order minus one,
which the additive multilevel sum over a hierarchy of piecewise linear functions is [BramblePasciakXu1990]:

    D^T (c I + P_1 P_1^T + P_1 P_2 P_2^T P_1^T + ...) D,        D the jumps between elements.

The prolongations are those of the Ruge-Stueben hierarchy [RugeStueben1987] of a string along these elements, whichever
these are and however long: it needs nothing but the sparse matrix of the string. A Jacobi step takes the kinks out of
them: these are waves of all lengths, which the sum would count several times.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.collocation.layers import Constants

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_STRENGTH, _FINEST, _SMOOTHING = 2.1, 1.5, 0.5
"""The multilevel sum by |xi|, on chains of 512 elements; with this weight c of the finest level, which represents all
levels that would be finer, and this damping of the Jacobi step it varies by a tenth, with 1 and 0 by a factor of two.
"""
_HOLD = 1e-6
"""Springs to the ground, by those of the string, that make the matrix of a closed string definite."""
_COARSEST = 10


@dataclass(frozen=True, eq=False)
class TractionHierarchy:
    """The inverse for one set of unknown tractions.

    Parameters
    ----------
    unknowns : (k,) array
        2 * place + number of the unknown tractions.
    jumps : (n_jumps, k) sparse matrix
    prolongations : tuple of sparse matrices
        From each level to the next finer one, the finest first.
    scale : (k,) array [Pa/m]
    """

    unknowns: IntArray
    jumps: csr_matrix
    prolongations: tuple[csr_matrix, ...]
    scale: FloatArray

    @classmethod
    def of(
        cls, is_traction: BoolArray, following: IntArray, lengths: FloatArray, constants: Constants
    ) -> TractionHierarchy:
        """Return the inverse for the unknowns (n_elements, 2) that are tractions; `following` is the next element."""
        from pyamg import ruge_stuben_solver
        from scipy.sparse import csr_matrix, diags_array

        unknowns = np.flatnonzero(is_traction)
        place, number = np.divmod(unknowns, 2)
        starts, ends = unknowns, 2 * following[place] + number
        joints = np.unique(np.concatenate([starts, ends]))
        k = unknowns.size
        rows = np.searchsorted(joints, np.concatenate([starts, ends]))
        entries = np.repeat([-1.0, 1.0], k)
        jumps = csr_matrix((entries, (rows, np.tile(np.arange(k), 2))), shape=(joints.size, k))
        prolongations: tuple[csr_matrix, ...] = ()
        if k > _COARSEST:
            string = (jumps @ diags_array(1.0 / lengths[place]) @ jumps.T).tocsr()
            string += diags_array(_HOLD * string.diagonal())
            hierarchy = ruge_stuben_solver(csr_matrix(string), max_coarse=_COARSEST, max_levels=40)
            prolongations = tuple(_smoothed(level.P, level.A) for level in hierarchy.levels[:-1])
        kappa = 3.0 - 4.0 * constants.poisson_ratio
        return cls(
            unknowns,
            jumps,
            prolongations,
            1.0 / (_STRENGTH * np.pi * kappa * constants.single * lengths[place]),
        )

    def apply(self, displacement: FloatArray) -> FloatArray:
        """Return the tractions (k,) that cause displacements (k,) along them, as far as these oscillate."""
        levels = [self.jumps @ displacement]
        for prolongation in self.prolongations:
            levels.append(prolongation.T @ levels[-1])
        levels[0] *= _FINEST
        total = levels.pop()
        for prolongation in reversed(self.prolongations):
            total = levels.pop() + prolongation @ total
        return np.asarray(self.scale * (self.jumps.T @ total))


def _smoothed(prolongation: csr_matrix, matrix: csr_matrix) -> csr_matrix:
    """Return a prolongation without its kinks, after one damped Jacobi step for the matrix of the finer level."""
    from scipy.sparse import diags_array

    step = diags_array(_SMOOTHING / matrix.diagonal()) @ (matrix @ prolongation)
    smoothed: csr_matrix = (prolongation - step).tocsr()
    return smoothed
