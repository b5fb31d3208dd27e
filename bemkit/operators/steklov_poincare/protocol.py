"""Protocol of every Steklov-Poincare operator, and of its condensed form."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.counts import OperationCounts
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Tag
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

if TYPE_CHECKING:
    from bemkit.operators.steklov_poincare.needs import BodyCase, BodyNeeds


@dataclass(frozen=True, eq=False, kw_only=True)
class CondensedMap(ABC):
    """A body reduced to its retained directions: force = stiffness @ displacement - load.

    Parameters
    ----------
    stiffness : (n_retained, n_retained) array
        In weak form (forces, not tractions).
    load : (n_retained,) array
        What the given loads and supports press onto the retained directions.
    sensitivity : (n_nodes, 2) array, optional
        Sum of the sizes of all forces that a unit displacement of each node causes. Of thin bodies it is many orders
        above the forces themselves, which then are differences and carry its round-off.
    work : OperationCounts
        Of the call that returned it: by `SteklovPoincare.condense` that includes the operators, by `under` it does not.
    volume_force : (3,) array, optional
        Resultants along x and y, and moment about the origin, of forces inside the body; none by default. Of a
        half-plane, the loads that drive it from far away.
    inner_force : float [N/m]
        Sum of the magnitudes of the forces that body forces and heat exert on the boundary, balanced or not.
    weightless : CondensedMap, optional
        Of a body with forces or heat inside: the same body without; see
        `bemkit.operators.steklov_poincare.forces_inside`.
    """

    stiffness: FloatArray
    load: FloatArray
    sensitivity: FloatArray | None = None
    work: OperationCounts = field(default_factory=OperationCounts)
    volume_force: FloatArray | None = None
    inner_force: float = 0.0
    weightless: CondensedMap | None = None

    @abstractmethod
    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total boundary force (n_nodes, 2) of all nodes, in x and y."""

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
        """Return response (k, n_retained) and at_rest (k,) of displacements of free directions (2 node + component).

        They are ``at_rest + response @ retained_displacement``.
        """


class BoundaryMap:
    """Base of maps whose displacements all come from forces on the boundary of a body that ends somewhere."""

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force."""
        return displacement, force

    def energy_beyond(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return nothing."""
        return np.zeros(0)


class SteklovPoincare(Protocol):
    """The elastic body seen from its boundary: nodal forces that go with displacements.

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
        """Whether the map is symmetric and positive semidefinite, and which motions cause no forces."""

    def needs(self, case: BodyCase) -> BodyNeeds:
        """Return counts, memory and time that `condense` will take, for the plan; ``BodyNeeds()`` predicts none."""

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Eliminate every direction that is not retained, with the given nodal forces (n_nodes, 2) on the free ones."""

    def own_fields(self, displacement: FloatArray, force: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return nodal displacements and forces (n_nodes, 2) less those of what acts inside the body or far away."""

    def energy_beyond(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the parts of the elastic energy [J/m] that what acts inside adds to that of `own_fields`."""

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions [Pa] that belong to what `CondensedMap.recover` gives.

        Returns
        -------
        (n_elements, n_local, 2) array [Pa]
            At the local nodes of the traction space, element by element; a new array.
        """
