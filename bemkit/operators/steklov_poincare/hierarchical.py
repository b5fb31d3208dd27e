"""Direct collocation whose equations are compressed over a tree instead of stored; see `bemkit.operators.hierarchy`."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.counts import OperationCounts
from bemkit.operators.hierarchy.factor import ElementLaws
from bemkit.operators.hierarchy.system import HierarchicalSystem, NodeConditions
from bemkit.operators.linear.solvers import Hierarchical
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes
from bemkit.operators.steklov_poincare.protocol import CondensedMap


class HierarchicalCollocation(CollocationElasticity):
    """The map of `CollocationElasticity` that solves over a tree wherever nothing is to be condensed.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    options : Hierarchical
    slopes : bool
        As of `CollocationElasticity`.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, options: Hierarchical, *, slopes: bool = True) -> None:
        super().__init__(mesh, material, slopes=slopes)
        self.options = options

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for all unknowns if nothing is retained; otherwise condense the dense equations."""
        if conditions.is_retained.any():
            return super().condense(conditions, force)
        return self._condensed(self.loaded(conditions, force))

    def loaded(self, conditions: NodalConditions, force: FloatArray) -> LoadedSystem:
        """Return the compressed equations of the body under supports and given nodal forces (n_elements, 2)."""
        return LoadedSystem.of(self, conditions, force)

    def _condensed(self, loaded: LoadedSystem) -> CondensedMap:
        nothing = np.zeros(0)

        def recover(retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
            loaded.system.state(loaded.known, _NO_ELEMENTS, _NO_CONDITIONS)
            displacement, traction = loaded.everywhere()
            return displacement, traction * self.mesh.lengths[:, None]

        def follow(directions: IntArray) -> tuple[FloatArray, FloatArray]:
            displacement, _ = recover(nothing)
            local = np.einsum("nkc,nc->nk", loaded.conditions.frame, displacement)
            return np.zeros((directions.size, 0)), local.ravel()[directions]

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            return self._condensed(loaded.under(displacement, force))

        return CondensedMap(np.zeros((0, 0)), nothing, recover, under, follow)


_FAR = 10.0
"""A rigid motion so much larger than what is left of the displacements is left out."""
_NO_ELEMENTS = np.zeros(0, np.intp)
_NO_CONDITIONS = NodeConditions(np.zeros((0, 2, 2)), np.zeros((0, 2, 2)), np.zeros((0, 2)))


@dataclass(frozen=True, eq=False)
class LoadedSystem:
    """Compressed equations of a body under given supports and forces.

    Parameters
    ----------
    map : HierarchicalCollocation
    conditions : NodalConditions
        Of the elements.
    system : HierarchicalSystem
    known : ElementLaws
        Of all elements; on elements with retained directions only what holds them fast.
    may_be_loaded : (n_elements,) bool array
        Elements for whose tractions the equations have columns.
    may_move : (n_elements,) bool array
        The same for displacements.
    force : (n_elements, 2) array [N/m]
        Given forces, in x and y.
    motions : (n_elements, 2, n_motions) array
        Rigid motions that no support resists.
    travel : (n_motions,) array
        One of these that is left out of all displacements. The compressed equations would hold it to their tolerance
        only, which counts where a body moves by far more than it strains.
    """

    map: HierarchicalCollocation
    conditions: NodalConditions
    system: HierarchicalSystem
    known: ElementLaws
    may_be_loaded: BoolArray
    may_move: BoolArray
    force: FloatArray
    motions: FloatArray
    travel: FloatArray

    @classmethod
    def of(cls, map: HierarchicalCollocation, conditions: NodalConditions, force: FloatArray) -> LoadedSystem:
        """Compress the equations of a body."""
        is_loaded, is_moved = _loaded(conditions, force)
        may_be_loaded = is_loaded | ~conditions.is_free.all(axis=1)
        may_move = is_moved | ~conditions.is_fixed.all(axis=1)
        system = HierarchicalSystem(
            map.mesh,
            map.material,
            conditions.frame,
            may_be_traction=may_be_loaded,
            may_be_displacement=may_move,
            slopes=map.slopes,
            tolerance=map.options.tolerance,
        )
        motions = np.ascontiguousarray(free_modes(map.displacement_space, conditions).transpose(1, 2, 0))
        at_rest = np.zeros(motions.shape[2])
        nothing = ElementLaws(np.zeros((0, 4, 2)), np.zeros((0, 4)))
        loaded = cls(map, conditions, system, nothing, may_be_loaded, may_move, force, motions, at_rest)
        return loaded.moved(at_rest)

    def under(self, displacement: FloatArray, force: FloatArray) -> LoadedSystem:
        """Return the same body under other given displacements, in the frames, and forces in x and y."""
        conditions = replace(self.conditions, displacement=displacement)
        is_loaded, is_moved = _loaded(conditions, force)
        if np.any(is_loaded & ~self.may_be_loaded) or np.any(is_moved & ~self.may_move):
            return LoadedSystem.of(self.map, conditions, force)
        return replace(self, conditions=conditions, force=force).moved(-self.travel)

    @property
    def work(self) -> OperationCounts:
        """Nothing that is counted: neither whole operators nor their factorisations."""
        return OperationCounts()

    @property
    def motion(self) -> FloatArray:
        """(n_elements, 2) array [m]: the rigid motion that is left out, in x and y."""
        motion: FloatArray = self.motions @ self.travel
        return motion

    def moved(self, travel: FloatArray) -> LoadedSystem:
        """Return the equations of what is left of the displacements beside a further rigid motion (n_motions,)."""
        other = replace(self, travel=self.travel + travel)
        conditions, mesh = self.conditions, self.map.mesh
        motion = np.einsum("nkc,nc->nk", conditions.frame, other.motion)
        traction = np.einsum("nkc,nc->nk", conditions.frame, self.force) / mesh.lengths[:, None]
        given = np.where(conditions.is_fixed, conditions.displacement - motion, 0.0)
        known = self.system.laws(NodeConditions.given(~conditions.is_free, traction, given))
        return replace(other, known=known)

    def travel_of(self, elements: IntArray, displacement: FloatArray) -> FloatArray | None:
        """Return the rigid motion of some elements if it is far larger than what is left of their displacements."""
        motions = self.motions[elements].reshape(2 * elements.size, -1)
        if not motions.size:
            return None
        travel: FloatArray = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0].astype(float)
        moved = motions @ travel
        left = np.abs(displacement.ravel() - moved).max(initial=0.0)
        return travel if np.abs(moved).max(initial=0.0) > _FAR * left else None

    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Return displacements without `motion` and tractions (n_elements, 2), in x and y, of the last response."""
        traction, displacement = self.system.everywhere()
        return displacement, traction


def _loaded(conditions: NodalConditions, force: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return (n_elements,) where a force is given, and where a displacement other than zero is."""
    return np.any(force != 0.0, axis=1), np.any(conditions.displacement != 0.0, axis=1)
