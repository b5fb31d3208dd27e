"""The half-plane as an elastic map with a flexibility in closed form."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.operators.counts import OperationCounts
from bemkit.operators.half_plane.cost import flexibility_work, strip_cost
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.steklov_poincare.cost import BodyCase, BodyCost


@dataclass(frozen=True, eq=False)
class HalfPlaneElasticity(SurfaceElasticity):
    """Elasticity of a half-plane with elements on a strip of its surface; see `SurfaceElasticity`."""

    @cached_property
    def flexibility(self) -> FloatArray:
        """(n_elements, n_elements) array [1/Pa]: displacements along forces; see `mean_logarithms`."""
        return np.asarray(-2.0 / (np.pi * self.material.plane_modulus) * mean_logarithms(self.nodes))

    @cached_property
    def nodes(self) -> FloatArray:
        """(n_elements + 1,) array [m]: ends of the elements along the surface."""
        ends = self.mesh.nodes[np.append(self.mesh.elements[:, 0], self.mesh.elements[-1, 1])]
        return np.asarray((ends - ends[0]) @ self.mesh.tangents[0])

    @property
    def work(self) -> OperationCounts:
        """Operation counts of the flexibility."""
        return flexibility_work(self.mesh.n_elements)

    def cost(self, case: BodyCase) -> BodyCost:
        """Return counts, memory and time of the map."""
        return strip_cost(case, has_tree=False)

    def _displaced(self, traction: ComplexArray) -> ComplexArray:
        force = self.mesh.lengths * traction
        along = self._along(np.stack([force.real, force.imag], axis=1))
        # forces before each element minus those behind it
        sums = np.cumsum(force)
        across = 2.0 * sums - force - sums[-1]
        return np.asarray(along[:, 0] + 1j * along[:, 1] - 0.5j * self.material.plane_compressibility * across)

    def _along(self, force: FloatArray) -> FloatArray:
        """Return the displacements (n_elements, 2) [m] of forces (n_elements, 2) [N/m] along these."""
        return np.asarray(self.flexibility @ force)

    @cached_property
    def full_flexibility(self) -> FloatArray:
        """(n_dofs, n_dofs) array [1/Pa] from forces to displacements, index ``2 element + component`` in x and y."""
        order = np.arange(self.mesh.n_elements)
        across = 0.5 * self.material.plane_compressibility * np.sign(order[:, None] - order)
        local = np.array([[self.flexibility, across], [-across, self.flexibility]])  # components t and n
        return self.full_from_local(local)
