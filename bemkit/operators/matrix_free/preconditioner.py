"""A two-level preconditioner of boundary equations with two conditions on each element.

Equations on groups of elements (`coarse_equations`), solved directly, give the smooth part of a solution. The part that
oscillates from element to element hardly depends on the rest of the boundary: there the equations reduce to 1/2 for
unknown displacements and to the single layer for unknown tractions. pyamg's hierarchy inverts the latter
(`traction_hierarchy`).
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.hierarchy.system import LocalConditions
from bemkit.operators.linear_solvers import DenseLU
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.coarse_equations import ElementGroups
from bemkit.operators.matrix_free.traction_hierarchy import TractionHierarchy

_CHUNK = 16
"""Groups whose columns are evaluated at a time."""
_COUPLED = 1e-6
"""Largest cosine of the angle between two directions that count as perpendicular."""


class Preconditioner:
    """Approximate inverse of the equations under the factors of local conditions.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    equations : CollocationEquations
    conditions : LocalConditions
    traction_unit : float [Pa]
        Scale of unknown tractions in the iteration.

    Raises
    ------
    SingularMatrixError
        If the conditions do not hold the body.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        equations: CollocationEquations,
        conditions: LocalConditions,
        traction_unit: float,
    ) -> None:
        of_traction, of_displacement = conditions.factors[:, :2], conditions.factors[:, 2:]
        compliance = (mesh.lengths / material.plane_modulus)[:, None]
        # whether an unknown acts as a traction rather than a displacement, and its direction
        is_traction = compliance * np.linalg.norm(of_traction, axis=1) > np.linalg.norm(of_displacement, axis=1)
        along = np.where(is_traction[:, None], of_traction, of_displacement)
        # elements of one kind have the same unknowns and slip, if at all, in the same direction
        cosine = np.einsum("ni,ni->n", along[:, :, 0], along[:, :, 1])
        kind = is_traction @ np.array([1, 2]) + 4 * np.sign(np.where(np.abs(cosine) > _COUPLED, cosine, 0.0))
        self.groups = groups = ElementGroups(mesh, kind.astype(np.intp))
        self.coarse = _coarse(groups.mesh, material, equations, conditions.factors[groups.middle])
        next_element = mesh.node_elements[mesh.elements[:, 1], 1]
        self.tractions = TractionHierarchy(is_traction, next_element, mesh.lengths, equations.constants)
        self.is_traction, self.units = is_traction, np.where(is_traction, traction_unit, 1.0)
        self.inverse = np.linalg.inv(along)

    def unknowns(self, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the element unknowns (n_elements, 2) and border unknowns (n_border,) of an iterate."""
        n = self.units.size
        return self.units * x[:n].reshape(-1, 2), x[n:]

    def apply(self, equations: FloatArray, balances: FloatArray) -> FloatArray:
        """Apply the approximate inverse to residuals (n_elements, 2) and (n_border,); return an iterate."""
        means = self.groups.mean(equations)
        of_groups = self.coarse.solve(np.concatenate([means.ravel(), balances]))
        z = np.einsum("nij,nj->ni", self.inverse, equations - means[self.groups.group])
        of_tractions = self.tractions.apply(z[self.is_traction])
        z *= 2.0
        z[self.is_traction] = -of_tractions
        z += of_groups[: means.size].reshape(-1, 2)[self.groups.group]
        return np.concatenate([(z / self.units).ravel(), of_groups[means.size :]])


def _coarse(mesh: BoundaryMesh, material: Material, fine: CollocationEquations, factors: FloatArray) -> DenseLU:
    """Factor the equations of groups under factors (n_groups, 4, 2) of their local conditions."""
    order, takes_slopes, length = np.arange(n := len(factors)), fine.acted_on.shape[1] > 1, fine.constants.log_length
    border = collocation_border(mesh, material, order, takes_slopes=takes_slopes)
    of_groups = CollocationEquations(mesh, material, order, border, takes_slopes=takes_slopes, log_length=length)
    balances = border.balances.reshape(-1, n, 4)
    # stored by columns: stored by rows, LAPACK would factor the transpose, whose pivots grow on graded groups
    matrix = np.zeros((2 * n + len(balances), 2 * n + len(balances)), order="F")
    for begin in range(0, n, _CHUNK):
        chunk = np.arange(begin, min(begin + _CHUNK, n))
        entries = of_groups.block(np.arange(2 * n), (4 * chunk[:, None] + np.arange(4)).ravel())
        of_unknowns = np.einsum("rnq,nqz->rnz", entries.reshape(2 * n, -1, 4), factors[chunk])
        matrix[: 2 * n, 2 * begin : 2 * begin + 2 * chunk.size] = of_unknowns.reshape(2 * n, -1)
    matrix[2 * n :, : 2 * n] = np.einsum("bnq,nqz->bnz", balances, factors).reshape(len(balances), -1)
    matrix[: 2 * n, 2 * n :] = border.errors
    return DenseLU(matrix, "the system of the body on groups of elements")
