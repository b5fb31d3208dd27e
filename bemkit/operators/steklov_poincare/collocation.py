"""The direct collocation map of the paper."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.mixed_system import MixedSystem
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, TractionField, integrate_traction
from bemkit.operators.steklov_poincare.protocol import CondensedMap


class CollocationMap:
    """Direct collocation with constant elements, (1/2 + T) u = U t at their midpoints, with tractions in equilibrium.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    slopes : bool
        Whether the double layer takes slopes between neighbouring elements
        (`bemkit.operators.collocation.gradient_reconstruction`).

    Notes
    -----
    The paper's discretisation, with three additions. With slopes, rotations cause no tractions, as translations do not
    in any case; constant elements do not hold them by themselves. Plain collocation satisfies the equilibrium of
    forces and moments only up to the discretisation error: here a rigid motion c is added to the equations and the
    resultants of the tractions are set to zero; c vanishes with the mesh size. On an exterior neither c nor the
    condition on the resultants is there. Likewise one reciprocity for each loop tells the pressure there, which the
    displacement equation loses as Poisson's ratio approaches 1/2 (`bemkit.operators.collocation.reciprocity`).
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, *, slopes: bool = True) -> None:
        self.mesh = mesh
        self.material = material
        self.slopes = slopes
        self.displacement_space = ConstantSpace(mesh)

    @cached_property
    def _matrix(self) -> FloatArray:
        n = self.mesh.n_elements
        frame = np.broadcast_to(np.eye(2), (n, 2, 2))
        everything_open = NodalConditions(frame, np.zeros((n, 2), bool), np.zeros((n, 2)), np.ones((n, 2), bool))
        name = "the single layer operator"
        exchange = MixedSystem(self.mesh, self.material, everything_open, name, np.zeros((n, 2)), slopes=self.slopes)
        matrix = exchange.condensed().stiffness
        read_only(matrix)
        return matrix

    def matrix(self) -> FloatArray:
        """Return the weak (n_dofs, n_dofs) matrix [Pa]; it is not symmetric."""
        return self._matrix

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the resultants of a traction field on the elements."""
        return integrate_traction(self.displacement_space, elements, traction)

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Exchange columns so that all unknowns but the open displacements stand on the left, and solve once.

        Columns of tractions and displacements that are known to be zero are neither computed nor stored.
        """
        name = "the body held by its supports and its contact boundary"
        return MixedSystem(self.mesh, self.material, conditions, name, force, slopes=self.slopes).condensed()

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 2) tractions."""
        return force / self.mesh.lengths[:, None]
