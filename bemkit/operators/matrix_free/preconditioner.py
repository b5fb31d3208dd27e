"""Two levels that approximate the inverse of boundary equations with two conditions on each element.

The slow part of a solution is that of the equations on groups of elements (`coarse_equations`), solved directly. What
oscillates from element to element hardly feels the rest of the boundary: there the equations are 1/2 for unknown
displacements, and the single layer for unknown tractions, whose inverse pyamg's hierarchy gives
(`traction_hierarchy`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.hierarchy.system import turned
from bemkit.operators.linear.dense import DenseLU
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.coarse_equations import ElementGroups
from bemkit.operators.matrix_free.compact_laws import CompactLaws
from bemkit.operators.matrix_free.straight_elements import StraightElements
from bemkit.operators.matrix_free.traction_hierarchy import TractionHierarchy

_CHUNK = 16
"""Groups whose columns are evaluated at a time."""


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """Approximate inverse of the equations under one kind of conditions.

    Parameters
    ----------
    groups : ElementGroups
    coarse : DenseLU
        Of their equations.
    frame : (n_elements, 2, 2) array
        Rows are the directions of the conditions of each element.
    coupled : (n_coupled,) array
        Elements on which unknowns do not act along these.
    turn : (n_coupled, 2, 2) array
        From these directions to those along which they do.
    is_traction : (n_elements, 2) bool array
        The unknowns that are tractions.
    tractions : TractionHierarchy
    """

    groups: ElementGroups
    coarse: DenseLU
    frame: FloatArray
    coupled: IntArray
    turn: FloatArray
    is_traction: BoolArray
    tractions: TractionHierarchy

    @classmethod
    def of(cls, elements: StraightElements, material: Material, laws: CompactLaws, frame: FloatArray) -> Preconditioner:
        """Return the inverse under laws.

        Parameters
        ----------
        elements : StraightElements
        material : Material
        laws : CompactLaws
            Given values are ignored.
        frame : (n_elements, 2, 2) array
            Rows are the directions of the conditions of each element.

        Raises
        ------
        SingularMatrixError
            If the conditions do not hold the body.
        """
        mesh = elements.mesh
        is_traction = laws.is_traction(np.arange(mesh.n_elements))
        following = mesh.node_elements[mesh.elements[:, 1], 1]
        tractions = TractionHierarchy.of(is_traction, following, mesh.lengths, elements.constants)
        groups = ElementGroups.of(mesh, _kinds(laws))
        factors = turned(laws.take(groups.middle), frame[groups.middle]).factors
        coarse = _coarse(groups, material, factors, elements)
        coupled = laws.take(laws.coupled).factors
        along = np.where(is_traction[laws.coupled, None], coupled[:, :2], coupled[:, 2:])
        return cls(groups, coarse, frame, laws.coupled, np.linalg.inv(along), is_traction, tractions)

    def apply(self, equations: FloatArray, balances: FloatArray) -> FloatArray:
        """Return unknowns (2 n_elements + n_border,) for what equations (n_elements, 2) and balances leave."""
        means = self.groups.mean(equations)
        of_groups = self.coarse.solve(np.concatenate([means.ravel(), balances]))
        result = np.empty(equations.size + balances.size)
        result[equations.size :] = of_groups[means.size :]
        rest = result[: equations.size].reshape(-1, 2)
        np.einsum("nij,nj->ni", self.frame, equations - means[self.groups.group], out=rest)
        rest[self.coupled] = np.einsum("nij,nj->ni", self.turn, rest[self.coupled])
        of_tractions = self.tractions.apply(rest[self.is_traction])
        rest *= 2.0
        rest[self.is_traction] = -of_tractions
        rest += of_groups[: means.size].reshape(-1, 2)[self.groups.group]
        return result


def _kinds(laws: CompactLaws) -> IntArray:
    """Return numbers of equal conditions: which quantities follow from others, and on which side slip acts."""
    kinds = laws.choice.astype(np.intp)
    kinds[laws.coupled] += 8 * np.sign(laws.coupling.sum(axis=(1, 2))).astype(np.intp)
    return kinds


def _coarse(groups: ElementGroups, material: Material, factors: FloatArray, elements: StraightElements) -> DenseLU:
    """Factor the equations of the groups under laws (n_groups, 4, 2)."""
    n, takes_slopes = len(factors), elements.takes_slopes
    order = np.arange(n)
    border = collocation_border(groups.mesh, material, order, takes_slopes=takes_slopes)
    of_groups = CollocationEquations.of(
        groups.mesh, material, order, border, takes_slopes=takes_slopes, log_length=elements.constants.log_length
    )
    balances = border.balances.reshape(-1, n, 4)
    # by columns: the LU of what is stored by rows is that of the transpose, whose pivots grow on graded groups
    matrix = np.zeros((2 * n + len(balances), 2 * n + len(balances)), order="F")
    for begin in range(0, n, _CHUNK):
        own = np.arange(begin, min(begin + _CHUNK, n))
        entries = of_groups.block(np.arange(2 * n), (4 * own[:, None] + np.arange(4)).ravel())
        of_unknowns = np.einsum("rnq,nqz->rnz", entries.reshape(2 * n, -1, 4), factors[own])
        matrix[: 2 * n, 2 * begin : 2 * begin + 2 * own.size] = of_unknowns.reshape(2 * n, -1)
    matrix[2 * n :, : 2 * n] = np.einsum("bnq,nqz->bnz", balances, factors).reshape(len(balances), -1)
    matrix[: 2 * n, 2 * n :] = border.errors
    return DenseLU(matrix, "the system of the body on groups of elements")
