"""An approximate inverse of the single layer on the elements with unknown tractions, from pyamg's hierarchy.

The single layer has the order -1: a wave of number xi along a straight boundary is multiplied by pi kappa / (8 pi mu
(1 - nu) |xi|). Its inverse has the order 1. It is approximated by differences before and after an operator of the order
-1, the additive multilevel sum over a hierarchy of piecewise linear functions [BramblePasciakXu1990]:

    D^T (c I + P_1 P_1^T + P_1 P_2 P_2^T P_1^T + ...) D,        D the jumps between elements.

The prolongations come from the Ruge-Stueben hierarchy [RugeStueben1987] of a string along these elements, which may
have any lengths; only the sparse matrix of the string is needed. A Jacobi step smooths the prolongations: their kinks
contain waves of all lengths, which the sum would count several times.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.collocation.layers import Constants

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_STRENGTH, _FINEST, _SMOOTHING = 2.1, 1.5, 0.5
"""The multilevel sum times |xi|, the weight c of the finest level, and the damping of the Jacobi step. On chains of 512
elements the sum then varies by a tenth; with c = 1 and no damping it varies by a factor of two."""
_HOLD = 1e-6
"""Stiffness of springs to the ground relative to the string; they make the matrix of a closed string definite."""
_COARSEST = 10
"""Largest number of unknowns of the coarsest level."""


class TractionHierarchy:
    """Approximate inverse of the single layer for those k of all unknowns that are tractions.

    Parameters
    ----------
    is_traction : (n_elements, 2) bool array
    next_element : (n_elements,) array
    lengths : (n_elements,) array [m]
    constants : Constants

    Attributes
    ----------
    jumps : (n_jumps, k) sparse matrix
    prolongations : tuple of sparse matrices
        From each level to the next finer level, finest first.
    scale : (k,) array [Pa/m]
    """

    def __init__(
        self, is_traction: BoolArray, next_element: IntArray, lengths: FloatArray, constants: Constants
    ) -> None:
        from pyamg import ruge_stuben_solver
        from scipy.sparse import csr_matrix, diags_array

        unknowns = np.flatnonzero(is_traction)
        element, component = np.divmod(unknowns, 2)
        # a jump at each end of an element; jumps between two unknowns coincide
        starts, ends = unknowns, 2 * next_element[element] + component
        jump_keys = np.unique(np.concatenate([starts, ends]))
        k = unknowns.size
        rows = np.searchsorted(jump_keys, np.concatenate([starts, ends]))
        entries = np.repeat([-1.0, 1.0], k)
        self.jumps = jumps = csr_matrix((entries, (rows, np.tile(np.arange(k), 2))), shape=(jump_keys.size, k))
        self.prolongations: tuple[csr_matrix, ...] = ()
        if k > _COARSEST:
            string = (jumps @ diags_array(1.0 / lengths[element]) @ jumps.T).tocsr()
            string += diags_array(_HOLD * string.diagonal())
            hierarchy = ruge_stuben_solver(csr_matrix(string), max_coarse=_COARSEST, max_levels=40)
            self.prolongations = tuple(_smoothed(level.P, level.A) for level in hierarchy.levels[:-1])
        kappa = 3.0 - 4.0 * constants.poisson_ratio
        self.scale = 1.0 / (_STRENGTH * np.pi * kappa * constants.single * lengths[element])

    def apply(self, displacement: FloatArray) -> FloatArray:
        """Return the tractions (k,) that cause oscillating displacements (k,)."""
        levels = [self.jumps @ displacement]
        for prolongation in self.prolongations:
            levels.append(prolongation.T @ levels[-1])
        levels[0] *= _FINEST
        total = levels.pop()
        for prolongation in reversed(self.prolongations):
            total = levels.pop() + prolongation @ total
        return np.asarray(self.scale * (self.jumps.T @ total))


def _smoothed(prolongation: csr_matrix, matrix: csr_matrix) -> csr_matrix:
    """Smooth a prolongation by one damped Jacobi step with the matrix of the finer level."""
    from scipy.sparse import diags_array

    step = diags_array(_SMOOTHING / matrix.diagonal()) @ (matrix @ prolongation)
    smoothed: csr_matrix = (prolongation - step).tocsr()
    return smoothed
