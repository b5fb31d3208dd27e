"""The Steklov-Poincare operator of an elastic map, from displacements of the boundary to consistent nodal forces.

Bodies are solved without this module, which loads `scipy.sparse.linalg`.
"""

from __future__ import annotations

from bemkit.arrays import FloatArray, IntArray
from bemkit.operators.boundary import BoundaryOperator
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import TractionField, integrate_traction


class SteklovPoincareOperator(BoundaryOperator):
    """S: displacement dofs [m] -> nodal forces [N/m], both (n_dofs,), dof = 2 * node + component.

    Parameters
    ----------
    elastic : GalerkinElasticity or CollocationElasticity
        Map whose stiffness is the matrix. Rigid motions of a bounded body are its kernel. S contains an inverse, so
        that each block requires the whole matrix.
    """

    def __init__(self, elastic: GalerkinElasticity | CollocationElasticity) -> None:
        super().__init__(elastic.displacement_space, elastic.displacement_space, elastic.tags)
        self.elastic = elastic

    def _build(self) -> FloatArray:
        return self.elastic.stiffness()

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the consistent nodal forces (n_nodes, 2) [N/m] of a traction field [Pa] on some elements."""
        return integrate_traction(self.trial, elements, traction)
