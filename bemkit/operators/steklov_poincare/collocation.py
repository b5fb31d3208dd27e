"""The direct collocation map of the paper."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.space import ConstantSpace
from bemkit.operators.collocation import collocation_matrices
from bemkit.operators.dense import DenseLU, SingularMatrixError
from bemkit.operators.material import Material
from bemkit.operators.nodal import NodalConditions
from bemkit.operators.rigid import resting_motions
from bemkit.operators.steklov_poincare.nodes import integrate_traction, rotate_columns
from bemkit.operators.steklov_poincare.protocol import CondensedMap, TractionField


class CollocationMap:
    """Direct collocation with constant elements, (1/2 + T) u = U t at their midpoints, with tractions in equilibrium.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material

    Notes
    -----
    The paper's discretisation. Plain collocation satisfies the equilibrium of forces and moments only up to the
    discretisation error. Here a rigid motion c is added to the equations and the resultants of the tractions are set
    to zero; c vanishes with the mesh size. Translations cause no tractions at all; a rotation, which constant
    elements cannot represent, causes some of the order of the discretisation error. On an exterior neither c nor the
    condition on the resultants is there.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material) -> None:
        self.mesh = mesh
        self.material = material
        self.displacement_space = ConstantSpace(mesh)

    @cached_property
    def _weights(self) -> FloatArray:
        """Length of the element of each dof."""
        return np.repeat(self.mesh.lengths, 2)

    @cached_property
    def _motions(self) -> FloatArray:
        return resting_motions(self.mesh, self.mesh.centres)

    @cached_property
    def _matrices(self) -> tuple[FloatArray, FloatArray]:
        """The single layer U and 1/2 + T."""
        single, double = collocation_matrices(self.mesh, self.material)
        double[np.diag_indices_from(double)] += 0.5
        return single, double

    @cached_property
    def _matrix(self) -> FloatArray:
        single, double = self._matrices
        factor = DenseLU(
            self._bordered(single, np.ones(single.shape[1], bool), self._motions), "the single layer operator"
        )
        tractions = factor.solve(np.vstack([double, np.zeros((self._motions.shape[1], double.shape[1]))]))[
            : len(double)
        ]
        matrix: FloatArray = self._weights[:, None] * tractions
        read_only(matrix)
        return matrix

    def matrix(self) -> FloatArray:
        """Return the weak (n_dofs, n_dofs) matrix [Pa]; it is not symmetric."""
        self._check_holes(np.ones((self.mesh.n_elements, 2), bool))
        return self._matrix

    def _check_holes(self, is_free: BoolArray) -> None:
        """Refuse what the displacement equation cannot tell: the pressure in a hole of an incompressible body."""
        if not self.material.is_incompressible:
            return
        for loop, area in zip(self.mesh.loops, self.mesh.loop_areas, strict=True):
            if area < 0.0 and is_free[loop].any():
                raise SingularMatrixError(
                    "collocation cannot find the pressure in a hole of an incompressible body (poisson_ratio 0.5): "
                    "use linear or quadratic Galerkin elements, or a ratio below 0.5"
                )

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the resultants of a traction field on the elements."""
        return integrate_traction(self.displacement_space, elements, traction)

    def _bordered(self, columns: FloatArray, is_traction: BoolArray, motions: FloatArray) -> FloatArray:
        """Border a system with the rigid motion c and the resultants of its traction unknowns, by the mean length."""
        n = columns.shape[0]
        order = n + self._motions.shape[1]
        bordered = np.zeros((order, order), order="F")
        bordered[:n, :n] = columns
        bordered[:n, n:] = self._motions
        scale = self._weights / self._weights.mean()
        bordered[n:, :n] = np.where(is_traction, (scale[:, None] * motions).T, 0.0)
        return bordered

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Exchange columns so that all unknowns but the open displacements stand on the left, and solve once."""
        self._check_holes(conditions.is_free)
        n = force.shape[0]
        single, double = (rotate_columns(matrix, conditions.frame) for matrix in self._matrices)
        motions = rotate_columns(self._motions.T, conditions.frame).T
        free, is_open, fixed = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_open, conditions.is_fixed)
        )
        is_traction = ~conditions.is_free.ravel()
        factor = DenseLU(
            self._bordered(np.where(is_traction, -single, double), is_traction, motions),
            "the body held by its supports and its contact boundary",
        )
        right = np.zeros((2 * n + motions.shape[1], is_open.size), order="F")
        right[: 2 * n] = -double[:, is_open]
        response = factor.solve(right)[: 2 * n]
        of_traction, of_fixed, resting = single[:, free], double[:, fixed], motions[free]
        scale = (self._weights / self._weights.mean())[free]
        weights = self._weights[is_open]

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            traction = np.einsum("nkc,nc->nk", conditions.frame, force).ravel() / self._weights
            prescribed = displacement.ravel()[fixed]
            known = of_traction @ traction[free] - of_fixed @ prescribed
            at_rest = factor.solve(np.concatenate([known, -(scale * traction[free]) @ resting]))[: 2 * n]
            load = weights * (traction[is_open] - at_rest[is_open])

            def recover(open_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
                unknowns = at_rest + response @ open_displacement
                local = np.where(is_traction, 0.0, unknowns)
                local[fixed] = prescribed
                local[is_open] = open_displacement
                local_force = self._weights * np.where(is_traction, unknowns, traction)
                displacement = np.einsum("nkc,nk->nc", conditions.frame, local.reshape(n, 2))
                return displacement, np.einsum("nkc,nk->nc", conditions.frame, local_force.reshape(n, 2))

            return CondensedMap(weights[:, None] * response[is_open], load, recover, under)

        return under(force, conditions.displacement)

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 2) tractions."""
        return force / self.mesh.lengths[:, None]
