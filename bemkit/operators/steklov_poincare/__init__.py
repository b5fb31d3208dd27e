"""Protocol of the maps of an elastic body from boundary displacements to tractions, and of their condensed form.

Scenes use `galerkin.GalerkinElasticity` or `collocation.CollocationElasticity`; `bemkit.operators.boundary` makes scipy
linear operators of them.

On bounded bodies the tractions of both maps are in exact equilibrium of forces and moments, as those of the continuous
map. A plain discretisation would violate equilibrium slightly, and results would depend on the arbitrary constant in
the logarithm of the single layer.

On the exterior of a body (`BoundaryMesh.is_exterior`) every rigid motion causes tractions, and tractions may have a
resultant F. The displacement then grows like F log(r / r0) with the distance r; its constant depends on the choice of
r0, the diameter of the mesh. Without a resultant, displacement and rotation vanish at infinity.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions


@dataclass(frozen=True, eq=False, kw_only=True)
class CondensedMap(ABC):
    """A body reduced to its retained directions: force = stiffness @ displacement - load.

    If only retained directions can change the volume of a nearly incompressible body, its uniform pressure is one more
    unknown, the last one, whose "force" is the change of volume less that by the pressure, which must vanish.

    Parameters
    ----------
    stiffness : (n_retained, n_retained) array
        In weak form: forces, not tractions.
    load : (n_retained,) array
        Forces that given loads and supports exert on the retained directions.
    n_pressures : int
        Number of retained pressures, 0 or 1.
    sensitivity : (n_nodes, 2) array, optional
        Sum of the magnitudes of all forces that a unit displacement of each node causes. For thin bodies it is many
        orders larger than the resulting forces, which then contain its round-off.
    work : OperationCounts
        Operations of the call that returned the map; `SteklovPoincare.condense` includes the operators, `under` does
        not.
    volume_force : (3,) array, optional
        Resultants along x and y, and moment about the origin, of body forces; none by default. For a half-plane, the
        loads that act far away.
    inner_force : float [N/m]
        Sum of the magnitudes of the boundary forces of body forces and heat, balanced or not.
    without_body_forces : CondensedMap, optional
        The same body without body forces and heat, if it has any; see
        `bemkit.operators.steklov_poincare.forces_inside`.
    """

    stiffness: FloatArray
    load: FloatArray
    n_pressures: int = 0
    sensitivity: FloatArray | None = None
    work: OperationCounts = field(default_factory=OperationCounts)
    volume_force: FloatArray | None = None
    inner_force: float = 0.0
    without_body_forces: CondensedMap | None = None

    @property
    def at_constant_volume(self) -> FloatArray:
        """The stiffness (n, n) of the displacements, if a pressure is unknown, of their parts that keep the volume."""
        n = len(self.stiffness) - self.n_pressures
        stiffness, change = self.stiffness[:n, :n], np.linalg.qr(self.stiffness[n:, :n].T)[0]
        left = stiffness - change @ (change.T @ stiffness)
        return np.asarray(left - (left @ change) @ change.T)

    @abstractmethod
    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and total boundary force of all nodes, (n_nodes, 2) each, in x and y."""

    @abstractmethod
    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the same body under other loads, without another factorisation.

        Parameters
        ----------
        force : (n_nodes, 2) array [N/m]
            In x and y.
        displacement : (n_nodes, 2) array [m]
            Prescribed displacements in the frames of the nodes.
        """

    @abstractmethod
    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response (k, n_retained) and at_rest (k,) for free directions 2 node + component.

        Their displacements are ``at_rest + response @ retained_displacement``.
        """


class BoundaryMap:
    """Base of maps without body forces and without loads far away."""

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force."""
        return displacement, force

    def further_energy(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return no further parts."""
        return np.zeros(0)


@dataclass(frozen=True, eq=False)
class WrappedMap(BoundaryMap):
    """Base of maps that solve with another map.

    Parameters
    ----------
    elastic : SteklovPoincare
        The other map.
    """

    elastic: SteklovPoincare

    @property
    def material(self) -> Material:
        """The material of the body."""
        return self.elastic.material

    @property
    def displacement_space(self) -> BoundarySpace:
        """The space of the displacements."""
        return self.elastic.displacement_space

    @property
    def traction_space(self) -> BoundarySpace:
        """The space of the tractions."""
        return self.elastic.traction_space

    @property
    def tags(self) -> frozenset[Tag]:
        """Tags of the other map."""
        return self.elastic.tags

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the operation counts of the other map."""
        return self.elastic.counts(conditions, loads)


class SteklovPoincare(Protocol):
    """Map of an elastic body from boundary displacements to nodal forces.

    Nothing is assembled before `condense`.
    """

    @property
    def material(self) -> Material:
        """The material of the body."""

    @property
    def displacement_space(self) -> BoundarySpace:
        """The space of the displacements; its nodes carry the forces."""

    @property
    def traction_space(self) -> BoundarySpace:
        """The space of the tractions."""

    @property
    def tags(self) -> frozenset[Tag]:
        """Properties of the map: symmetric, positive semidefinite, motions without forces."""

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the operation counts of `condense` and of all load steps, from which plans predict memory and time."""

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate all directions that are not retained, under nodal forces (n_nodes, 2) on the free ones."""

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return nodal displacements and forces (n_nodes, 2) minus those of body forces and of loads far away."""

    def further_energy(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the parts of the elastic energy [J/m] that body forces and far loads add to that of `own_fields`."""

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions [Pa] of displacements and forces from `CondensedMap.recover`.

        Returns
        -------
        (n_elements, n_local, 2) array [Pa]
            At the local nodes of the traction space; a new array.
        """
