"""The elastic maps of half-planes: a flexibility in closed form, or equations compressed over a tree."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.counts import Entries, OperationCounts
from bemkit.operators.half_plane.equations import HalfPlaneEquations, StripView, potential_of
from bemkit.operators.half_plane.far_motion import FarMotion
from bemkit.operators.half_plane.flexibility import mean_logarithms
from bemkit.operators.half_plane.periodic import PeriodicElasticity
from bemkit.operators.half_plane.surface import SurfaceElasticity
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.material import Material

LARGEST_DENSE = 1500
"""Largest number of elements of a half-plane whose flexibility is stored as a matrix."""
_LEAF = 96
"""Elements of a leaf."""


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
        n = self.mesh.n_elements
        return OperationCounts(element_pairs=n**2, single_layer=Entries.full(n, n))

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


@dataclass(frozen=True, eq=False)
class LargeHalfPlane(HalfPlaneElasticity):
    """Elasticity of a half-plane with thousands of elements on its surface; see `SurfaceElasticity`.

    Parameters
    ----------
    tolerance : float
        Relative tolerance of the compression.
    """

    tolerance: float = 2e-11

    @property
    def work(self) -> OperationCounts:
        """Return no counts, because no matrix is formed."""
        return OperationCounts()

    @cached_property
    def factor(self) -> Factor:
        """The compressed equations with the load-controlled motions as their border."""
        far_motion = self.far_motion
        at_elements = far_motion.motions_at(self.mesh.centres)[:, :, list(far_motion.load_controlled)]
        motions = np.einsum("c,ncm->mn", self.axes, at_elements)
        equations = HalfPlaneEquations(self.nodes, self.material, motions)
        points = np.stack([equations.points.real, np.zeros(self.mesh.n_elements)], axis=1)
        return Factor(equations, ClusterTree.of(points, _LEAF), self.tolerance, level_view=StripView)

    def with_far_motion(self, far_motion: FarMotion) -> Self:
        """Return the half-plane under another far motion; keep the factor if the same motions are load-controlled."""
        other, before = super().with_far_motion(far_motion), self.far_motion
        is_same_border = (far_motion.load_controlled, far_motion.centre) == (before.load_controlled, before.centre)
        if is_same_border and "factor" in self.__dict__:
            other.__dict__["factor"] = self.factor
        return other

    def _along(self, force: FloatArray) -> FloatArray:
        equations = self.factor.equations
        assert isinstance(equations, HalfPlaneEquations)
        return np.asarray(equations.along * potential_of(self.factor.compression, force))


def half_plane_map(mesh: BoundaryMesh, material: Material) -> HalfPlaneElasticity | PeriodicElasticity:
    """Return the map of a half-plane with a meshed surface."""
    if mesh.surface is not None and mesh.surface.is_periodic:
        return PeriodicElasticity(mesh, material)
    return (HalfPlaneElasticity if mesh.n_elements <= LARGEST_DENSE else LargeHalfPlane)(mesh, material)
