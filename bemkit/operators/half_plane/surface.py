"""Base class of the elastic maps of half-planes.

Tractions and displacements are complex numbers: the real part is the component along the tangent, the imaginary part
that along the normal.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import ConstantSpace, dof_points
from bemkit.operators.counts import Factorisation, FactorKind, OperationCounts
from bemkit.operators.half_plane.far_motion import FarMotion
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import BoundaryMap, CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions


@dataclass(frozen=True, eq=False)
class SurfaceElasticity(BoundaryMap, ABC):
    """Elasticity of a half-plane with elements on its surface; fulfils `SteklovPoincare`.

    Parameters
    ----------
    mesh : BoundaryMesh
        The surface, in units of its length.
    material : Material
    far_motion : FarMotion
        Motion far away; by default the half-plane is at rest there.
    last : list
        The last tractions and their displacements, which a response, its certificate and its fields share.
    """

    mesh: BoundaryMesh
    material: Material
    far_motion: FarMotion = field(default_factory=FarMotion)
    last: list[tuple[ComplexArray, ComplexArray]] = field(default_factory=list, repr=False)

    @cached_property
    def displacement_space(self) -> ConstantSpace:
        """The space of mean displacements of elements."""
        return ConstantSpace(self.mesh)

    @property
    def traction_space(self) -> ConstantSpace:
        """The space of tractions constant on elements."""
        return self.displacement_space

    @property
    @abstractmethod
    def flexibility(self) -> FloatArray:
        """Displacements per traction without the far motion; computed once."""

    @property
    def tags(self) -> frozenset[Tag]:
        """The map is symmetric."""
        return frozenset({Tag.SYMMETRIC})

    @property
    def work(self) -> OperationCounts:
        """Operation counts of the flexibility."""
        return OperationCounts()

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the operation counts of `condense`, which inverts the flexibility on retained and fixed directions."""
        n_acting = conditions.n_retained + conditions.n_fixed
        factorisations = (Factorisation(FactorKind.CHOLESKY, n_acting),) if n_acting else ()
        return self.work + OperationCounts(factorisations=factorisations, right_hand_sides=n_acting)

    def with_far_motion(self, far_motion: FarMotion) -> Self:
        """Return the same half-plane under another far motion; nothing is integrated again."""
        other = replace(self, far_motion=far_motion)
        if "flexibility" in self.__dict__:
            other.__dict__["flexibility"] = self.flexibility
        return other

    def displaced(self, traction: ComplexArray) -> ComplexArray:
        """Return the displacements (n_elements,) [m] that tractions (n_elements,) [Pa] cause."""
        if not traction.any():
            return np.zeros(traction.shape, complex)
        if not self.last or not np.array_equal(self.last[0][0], traction):
            self.last[:] = [(traction, self._displaced(traction))]
        return self.last[0][1]

    @abstractmethod
    def _displaced(self, traction: ComplexArray) -> ComplexArray:
        """Return the displacements of tractions that are not zero."""

    @cached_property
    def axes(self) -> ComplexArray:
        """(2,) array: the directions x and y as complex numbers."""
        return np.asarray(self.mesh.tangents[0] + 1j * self.mesh.normals[0])

    def to_complex(self, vectors: FloatArray) -> ComplexArray:
        """Return vectors (..., 2) in x and y as complex numbers (...)."""
        return np.asarray(vectors @ self.axes)

    def to_vectors(self, numbers: ComplexArray) -> FloatArray:
        """Return complex numbers (n,) as vectors (n, 2) in x and y."""
        return np.asarray((numbers[:, None] * self.axes.conj()).real)

    def strain_displacement(self, force: FloatArray) -> FloatArray:
        """Return the displacements (n_nodes, 2) that nodal forces (n_nodes, 2) cause, without the far motion."""
        return self.to_vectors(self.displaced(self.to_complex(force / self.mesh.lengths[:, None])))

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the displacement without the far motion, and the force."""
        return self.strain_displacement(force), force

    @property
    @abstractmethod
    def full_flexibility(self) -> FloatArray:
        """(n_dofs, n_dofs) array [1/Pa] from forces to displacements, index ``2 element + component`` in x and y."""

    def full_from_local(self, local: FloatArray) -> FloatArray:
        """Return the full flexibility from that of tangential and normal components, (2, 2, n, n)."""
        axes = np.stack([self.mesh.tangents[0], self.mesh.normals[0]])
        full = np.einsum("ka,klij,lb->iajb", axes, local, axes, optimize=True).reshape(2 * local.shape[2], -1)
        return np.asarray(0.5 * (full + full.T))

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for the forces on retained and fixed directions; see `SteklovPoincare.condense`."""
        from bemkit.operators.half_plane.condensed import CondensedHalfPlane  # only where there are other bodies

        points, flexibility = dof_points(self.displacement_space), self.full_flexibility
        body = CondensedHalfPlane(conditions, self.far_motion, flexibility, points, self.mesh.tangents[0])
        condensed = body.under(force, conditions.displacement)
        return replace(condensed, work=self.counts(conditions, ()))

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions (n_elements, 1, 2) [Pa]: forces per length."""
        return np.asarray(force / self.mesh.lengths[:, None])[:, None, :]
