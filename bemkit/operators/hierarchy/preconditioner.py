"""Two levels that approximate the inverse of boundary equations with two conditions on each element.

The slow part of a solution is that of the equations on groups of elements (`coarse_equations`), solved directly. What
oscillates from element to element hardly feels the rest of the boundary: there the equations are 1/2 for unknown
displacements, and the single layer for unknown tractions, whose inverse pyamg's hierarchy gives
(`traction_hierarchy`).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.hierarchy.boundary_columns import BoundaryColumns
from bemkit.operators.hierarchy.coarse_equations import ElementGroups
from bemkit.operators.hierarchy.collocation_system import boundary_border
from bemkit.operators.hierarchy.factor import ElementLaws
from bemkit.operators.hierarchy.traction_hierarchy import TractionHierarchy
from bemkit.operators.linear.dense import DenseLU
from bemkit.operators.material import Material

_CHUNK = 64
"""Groups whose columns are evaluated at a time."""


@dataclass(frozen=True, eq=False)
class Preconditioner:
    """Approximate inverse of the equations under one kind of conditions.

    Parameters
    ----------
    groups : ElementGroups
    coarse : DenseLU
        Of their equations.
    turn : (n_elements, 2, 2) array
        By place, from x and y to the directions along which the two unknowns act.
    is_traction : (n_elements, 2) bool array
        By place, the unknowns that are tractions.
    tractions : TractionHierarchy
    """

    groups: ElementGroups
    coarse: DenseLU
    turn: FloatArray
    is_traction: BoolArray
    tractions: TractionHierarchy

    @classmethod
    def of(cls, mesh: BoundaryMesh, material: Material, columns: BoundaryColumns, laws: ElementLaws) -> Preconditioner:
        """Return the inverse under laws, by place.

        Parameters
        ----------
        mesh : BoundaryMesh
        material : Material
        columns : BoundaryColumns
            Of the mesh.
        laws : ElementLaws
            What is given counts for nothing.

        Raises
        ------
        SingularMatrixError
            If the conditions do not hold the body.
        """
        factors, order = laws.factors, columns.order
        is_traction = np.asarray(~factors[:, 2:].any(axis=1), bool)
        along = np.where(is_traction[:, None], factors[:, :2], factors[:, 2:])
        kind = np.empty(order.size, np.intp)
        kind[order] = _kinds(factors, is_traction)
        groups = ElementGroups.of(mesh, kind)
        place = np.empty_like(order)
        place[order] = np.arange(order.size)
        hierarchy = TractionHierarchy.of(is_traction, columns.neighbours[2], columns.lengths, columns.constants)
        coarse = _coarse(groups, material, factors[place[groups.middle]], columns)
        by_place = ElementGroups(groups.mesh, groups.group[order], groups.middle)
        return cls(by_place, coarse, np.linalg.inv(along), is_traction, hierarchy)

    def apply(self, right: FloatArray) -> FloatArray:
        """Return unknowns (2 n_elements + n_border,) for what the equations and balances leave, of the same shape."""
        n = 2 * len(self.turn)
        felt = right[:n].reshape(-1, 2)
        means = self.groups.mean(felt)
        of_groups = self.coarse.solve(np.concatenate([means.ravel(), right[n:]]))
        unknowns = of_groups[: means.size].reshape(-1, 2)[self.groups.group]
        rest = np.einsum("nij,nj->ni", self.turn, felt - means[self.groups.group])
        of_tractions = self.tractions.apply(rest[self.is_traction])
        rest *= 2.0
        rest[self.is_traction] = -of_tractions
        unknowns += rest
        return np.concatenate([unknowns.ravel(), of_groups[means.size :]])


def _kinds(factors: FloatArray, is_traction: BoolArray) -> FloatArray:
    """Return numbers of equal conditions: which unknowns are tractions, and on which side slip acts."""
    slip = np.sign(np.round(np.einsum("ni,ni->n", factors[:, :2, 0], factors[:, :2, 1]), 6))
    return np.asarray(is_traction @ np.array([1, 2]) + 4 * slip, np.intp)


def _coarse(groups: ElementGroups, material: Material, factors: FloatArray, columns: BoundaryColumns) -> DenseLU:
    """Factor the equations of the groups under laws (n_groups, 4, 2)."""
    n, takes_slopes = len(factors), columns.slopes is not None
    order = np.arange(n)
    of_groups = BoundaryColumns.of(
        groups.mesh, material, order, takes_slopes=takes_slopes, log_length=columns.constants.log_length
    )
    border = boundary_border(groups.mesh, material, order, takes_slopes, has_holes=True)
    balances = border.balances.reshape(-1, n, 4)
    # by columns: the LU of what is stored by rows is that of the transpose, whose pivots grow on graded groups
    matrix = np.zeros((2 * n + len(balances), 2 * n + len(balances)), order="F")
    for begin in range(0, n, _CHUNK):
        own = np.arange(begin, min(begin + _CHUNK, n))
        entries = of_groups.entries(np.arange(2 * n), (4 * own[:, None] + np.arange(4)).ravel())
        of_unknowns = np.einsum("rnq,nqz->rnz", entries.reshape(2 * n, -1, 4), factors[own])
        matrix[: 2 * n, 2 * begin : 2 * begin + 2 * own.size] = of_unknowns.reshape(2 * n, -1)
    matrix[2 * n :, : 2 * n] = np.einsum("bnq,nqz->bnz", balances, factors).reshape(len(balances), -1)
    matrix[: 2 * n, 2 * n :] = border.errors
    return DenseLU(matrix, "the system of the body on groups of elements")
