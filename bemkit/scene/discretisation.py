"""How displacements and tractions are discretised: by symmetric Galerkin or by collocation, with which elements."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace


@dataclass(frozen=True)
class LinearGalerkin:
    """Symmetric Galerkin: displacements continuous and linear, tractions constant on each element."""

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the displacements; its nodes carry the contact conditions."""
        return LinearSpace(mesh)


@dataclass(frozen=True)
class QuadraticGalerkin:
    """Symmetric Galerkin: displacements continuous and quadratic, tractions linear on each element.

    Tractions are continuous except at corners and at ends of boundary parts. Contact conditions hold at the ends and
    the middles of elements.
    """

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the displacements; the nodes of the mesh are its first dofs."""
        return QuadraticSpace(mesh)


@dataclass(frozen=True)
class ConstantCollocation:
    """Direct collocation with displacements and tractions constant on each element.

    Parameters
    ----------
    slopes : bool
        Whether the double layer takes the slope of the displacement between neighbouring elements, which keeps
        rotations and makes displacements and energies converge with the second order. Without, this is the method of
        the source paper, of the first order.
    """

    slopes: bool = True

    def displacement_space(self, mesh: BoundaryMesh) -> BoundarySpace:
        """Return the space of the displacements; its nodes are the centres of elements."""
        return ConstantSpace(mesh)


Discretisation: TypeAlias = LinearGalerkin | QuadraticGalerkin | ConstantCollocation
