"""What the elastic maps of all half-planes have in common."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Self

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.half_plane.far_drive import FarDrive
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.operators.steklov_poincare.protocol import CondensedMap


@dataclass(frozen=True, eq=False)
class SurfaceElasticity(ABC):
    """Elasticity of a half-plane seen from elements of its surface; fulfils `SteklovPoincare`.

    Parameters
    ----------
    mesh : BoundaryMesh
        The surface, in units of its length.
    material : Material
    drive : FarDrive
        How the half-plane moves far away; it rests unless given.
    """

    mesh: BoundaryMesh
    material: Material
    drive: FarDrive = field(default_factory=FarDrive)

    @cached_property
    def displacement_space(self) -> ConstantSpace:
        """Means over elements."""
        return ConstantSpace(self.mesh)

    @property
    def traction_space(self) -> ConstantSpace:
        """Constants on elements."""
        return self.displacement_space

    @property
    @abstractmethod
    def flexibility(self) -> FloatArray:
        """What tractions displace, without the motion far away; computed once."""

    def driven_by(self, drive: FarDrive) -> Self:
        """Return the same half-plane under another drive; nothing is integrated again."""
        other = replace(self, drive=drive)
        if "flexibility" in self.__dict__:
            other.__dict__["flexibility"] = self.flexibility
        return other

    @abstractmethod
    def strain_displacement(self, force: FloatArray) -> FloatArray:
        """Return the displacements (n_nodes, 2) that nodal forces (n_nodes, 2) cause, without those of the drive."""

    @abstractmethod
    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not retained; see `SteklovPoincare.condense`."""

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions (n_elements, 1, 2) [Pa], which are the forces per length."""
        return np.asarray(force / self.mesh.lengths[:, None])[:, None, :]
