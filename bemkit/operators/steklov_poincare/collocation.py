"""The direct collocation map of the paper."""

from __future__ import annotations

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.mixed_system import MixedSystem
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.operators.steklov_poincare.protocol import CondensedMap


class CollocationElasticity:
    """Elasticity of a body by direct collocation, (1/2 + T) u = U t, with tractions in equilibrium.

    Displacements and tractions are constant on elements; the equations hold at their midpoints.

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
        self.displacement_space: BoundarySpace = ConstantSpace(mesh)
        self.traction_space: BoundarySpace = self.displacement_space

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Exchange columns so that all unknowns but the retained displacements stand on the left, and solve once.

        Columns of tractions and displacements that are known to be zero are neither computed nor stored.
        """
        name = "the body held by its supports and its contact boundary"
        return MixedSystem(self.mesh, self.material, conditions, name, force, slopes=self.slopes).condensed()

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 1, 2) tractions: forces over lengths."""
        return force[:, None] / self.mesh.lengths[:, None, None]
