"""Elastic maps whose equations are compressed over a tree; see `bemkit.operators.hierarchy`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.collocation.equations import collocation_equations
from bemkit.operators.counts import OperationCounts
from bemkit.operators.hierarchy.factor import Factor
from bemkit.operators.hierarchy.system import BodyFactor, HierarchicalSystem, LocalConditions
from bemkit.operators.linear_solvers import Hierarchical, MatrixFree, SingularMatrixError
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare import CondensedMap
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, free_modes, turning

LEAF_SIZE = 88
"""Elements of a leaf: larger leaves cost more to factor, smaller ones have skeletons nearly as large as themselves."""
_LARGEST_RESIDUAL, _SAMPLED = 1e3, 16
"""Largest accepted residual relative to the tolerance of the compression, and number of sampled elements. The ratio is
below one on all bodies that were tried."""
_FAR = 10.0
"""Ratio of a rigid motion to the remaining displacements from which on it is subtracted."""


class InexactEquationsError(SingularMatrixError):
    """Compressed equations are less accurate than their tolerance."""


@dataclass(frozen=True, eq=False, kw_only=True)
class _EquationsMap(CondensedMap):
    """A body under one load, solved for a unit displacement of each retained direction."""

    loaded: LoadedSystem

    @classmethod
    def of(cls, loaded: LoadedSystem, stiffness: FloatArray) -> _EquationsMap:
        """Return the map for a known stiffness."""
        at_rest = cls(stiffness=stiffness, load=np.zeros(0), loaded=loaded)
        if not loaded.retained.size:
            return at_rest
        _, forces = at_rest.recover(np.zeros(loaded.retained.size))
        pressed = loaded.conditions.in_frames(forces - loaded.force).ravel()[loaded.retained]
        return replace(at_rest, load=-pressed)

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        displacement, traction = self.loaded.recovered(retained_displacement)
        return displacement, traction * self.loaded.elastic.mesh.lengths[:, None]

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        displacement, _ = self.recover(np.zeros(self.loaded.retained.size))
        at_rest = self.loaded.conditions.in_frames(displacement).ravel()[directions]
        return self.loaded.responses(directions)[1], at_rest

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return _EquationsMap.of(self.loaded.under(force, displacement), self.stiffness)


class HierarchicalCollocation(CollocationElasticity):
    """The map of `CollocationElasticity` that solves over a tree.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    options : Hierarchical or MatrixFree
    slopes : bool
        See `CollocationElasticity`.
    """

    def __init__(
        self, mesh: BoundaryMesh, material: Material, options: Hierarchical | MatrixFree, *, slopes: bool = True
    ) -> None:
        super().__init__(mesh, material, slopes=slopes)
        self.options = options

    @classmethod
    def of(cls, elastic: CollocationElasticity, options: Hierarchical | MatrixFree) -> HierarchicalCollocation:
        """Return a map with the equations of another one."""
        return cls(elastic.mesh, elastic.material, options, slopes=elastic.slopes)

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return none, because they depend on ranks and numbers of iterations."""
        return OperationCounts()

    def system(self, conditions: NodalConditions, may_be_loaded: BoolArray, may_move: BoolArray) -> HierarchicalSystem:
        """Return the equations in the frames of the elements, compressed or not stored.

        Parameters
        ----------
        conditions : NodalConditions
        may_be_loaded, may_move : (n_elements,) bool arrays
            Elements whose traction, and whose displacement, may ever differ from zero.
        """
        mesh, factor = self.mesh, self._factor(conditions, may_be_loaded, may_move)
        unit = mesh.diameter / mesh.n_elements / self.material.plane_modulus
        return HierarchicalSystem(factor, conditions.frame, unit)

    def _factor(self, conditions: NodalConditions, may_be_loaded: BoolArray, may_move: BoolArray) -> BodyFactor:
        if isinstance(self.options, MatrixFree):
            from bemkit.operators.matrix_free.factor import IterativeFactor

            return IterativeFactor(self.mesh, self.material, self.options, takes_slopes=self.slopes)
        mesh, may_differ = self.mesh, np.repeat(np.stack([may_be_loaded, may_move], axis=1), 2, axis=1)
        tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        return Factor(
            collocation_equations(mesh, self.material, tree.order, takes_slopes=self.slopes),
            tree,
            self.options.tolerance,
            may_differ=may_differ[tree.order],
            may_change=np.any(conditions.is_retained, axis=1)[tree.order],
        )

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for a unit displacement of each retained direction; see `SteklovPoincare.condense`.

        Raises
        ------
        InputError
            If the equations are solved without being stored.
        InexactEquationsError
            If a sampled solution does not fulfil the uncompressed boundary equations.
        """
        loaded = LoadedSystem.of(self, conditions, force)
        condensed = _EquationsMap.of(loaded, loaded.stiffness())
        residual = loaded.residual(np.cos(np.arange(loaded.retained.size)))
        if residual > _LARGEST_RESIDUAL * self.options.tolerance:
            raise InexactEquationsError(
                f"compressed to {self.options.tolerance:g} the boundary equations leave a residual of {residual:.1e} "
                "of the displacements: choose the linear solver 'direct' for this body"
            )
        return condensed


@dataclass(frozen=True, eq=False)
class LoadedSystem:
    """Compressed equations of a body under given supports and forces.

    Parameters
    ----------
    elastic : HierarchicalCollocation
    conditions : NodalConditions
        Conditions of the elements.
    system : HierarchicalSystem
    may_be_loaded, may_move : (n_elements,) bool arrays
        Elements whose traction, and whose displacement, has columns in the equations.
    force : (n_elements, 2) array [N/m]
        Given forces, in x and y.
    motions : (n_elements, 2, n_motions) array
        Rigid motions that no support resists and that cause no tractions.
    amplitudes : (n_motions,) array
        Amplitudes of the rigid motion that is subtracted from all displacements. The compressed equations resolve
        displacements only to their tolerance, which is too coarse if a body moves by far more than it strains.
    """

    elastic: HierarchicalCollocation
    conditions: NodalConditions
    system: HierarchicalSystem
    may_be_loaded: BoolArray
    may_move: BoolArray
    force: FloatArray
    motions: FloatArray
    amplitudes: FloatArray

    @classmethod
    def of(cls, elastic: HierarchicalCollocation, conditions: NodalConditions, force: FloatArray) -> LoadedSystem:
        """Compress the equations of a body for its present and later loads."""
        is_loaded, is_moved = _loaded(conditions, force)
        for given in conditions.later:
            is_loaded |= np.any(given.force != 0.0, axis=1)
            is_moved |= np.any(given.displacement != 0.0, axis=1)
        may_be_loaded = is_loaded | ~conditions.is_free.all(axis=1)
        may_move = is_moved | ~conditions.is_fixed.all(axis=1)
        system = elastic.system(conditions, may_be_loaded, may_move)
        motions = free_modes(elastic.displacement_space, conditions)
        if not elastic.slopes:  # without slopes a rotation causes tractions
            motions = motions[~turning(motions)]
        motions = np.ascontiguousarray(motions.transpose(1, 2, 0))
        at_rest = np.zeros(motions.shape[2])
        loaded = cls(elastic, conditions, system, may_be_loaded, may_move, force, motions, at_rest)
        if conditions.later:
            later = (loaded.under(conditions.in_plane(given.force), given.displacement) for given in conditions.later)
            system.factor.prepare(load.known.given for load in (loaded, *later))
        return loaded

    def under(self, force: FloatArray, displacement: FloatArray) -> LoadedSystem:
        """Return the same body under other forces in x and y, and given displacements in the frames."""
        conditions = replace(self.conditions, displacement=displacement)
        is_loaded, is_moved = _loaded(conditions, force)
        if np.any(is_loaded & ~self.may_be_loaded) or np.any(is_moved & ~self.may_move):
            before = GivenData.of(self.conditions, self.force, self.conditions.displacement)
            return LoadedSystem.of(self.elastic, replace(conditions, later=(*conditions.later, before)), force)
        return replace(self, conditions=conditions, force=force).subtracting(-self.amplitudes)

    @property
    def motion(self) -> FloatArray:
        """(n_elements, 2) array [m]: the rigid motion that is subtracted, in x and y."""
        motion: FloatArray = self.motions @ self.amplitudes
        return motion

    def subtracting(self, amplitudes: FloatArray) -> LoadedSystem:
        """Return the equations after a further rigid motion, amplitudes (n_motions,), is subtracted."""
        return replace(self, amplitudes=self.amplitudes + amplitudes)

    @cached_property
    def known(self) -> LocalConditions:
        """Local conditions of all elements; retained directions are held fast."""
        conditions = self.conditions
        given = np.where(conditions.is_fixed, conditions.displacement - conditions.in_frames(self.motion), 0.0)
        return self.system.local_conditions(self._with_displacements(given))

    def _with_displacements(self, displacement: FloatArray) -> LinearConditions:
        """Return conditions: given tractions on free directions, displacements (n_elements, 2) on the others."""
        traction = self.conditions.in_frames(self.force) / self.elastic.mesh.lengths[:, None]
        return LinearConditions.given(~self.conditions.is_free, traction, displacement)

    def large_motion(self, elements: IntArray, displacement: FloatArray) -> FloatArray | None:
        """Return the amplitudes of the rigid motion of elements (n,) in displacements (n, 2) far above their strain."""
        motions = self.motions[elements].reshape(2 * elements.size, -1)
        if not motions.size:
            return None
        amplitudes: FloatArray = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0].astype(float)
        rigid = motions @ amplitudes
        strain = np.abs(displacement.ravel() - rigid).max(initial=0.0)
        return amplitudes if np.abs(rigid).max(initial=0.0) > _FAR * strain else None

    @property
    def retained(self) -> IntArray:
        """(n_retained,) array: the retained directions 2 * element + direction."""
        return np.flatnonzero(self.conditions.is_retained)

    def responses(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return tractions and displacements (k, n_retained) along directions under unit retained displacements."""
        elements, element_index = np.unique(directions // 2, return_inverse=True)
        states = self.system.responses(self.known, self.retained, elements)
        component = directions % 2
        return states[element_index, component], states[element_index, 2 + component]

    def stiffness(self) -> FloatArray:
        """Return the forces (n_retained, n_retained) under unit displacements of the retained directions [Pa]."""
        retained = self.retained
        if not retained.size:
            return np.zeros((0, 0))
        stiffness = self.elastic.mesh.lengths[retained // 2, None] * self.responses(retained)[0]
        # rigid motions that no support resists take no force; the compressed equations give some
        motions = np.einsum("nkc,ncm->nkm", self.conditions.frame, self.motions).reshape(self.force.size, -1)
        basis = np.linalg.qr(motions[retained])[0]
        return np.asarray(stiffness - (stiffness @ basis) @ basis.T)

    def recovered(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacements and tractions (n_elements, 2) of the whole boundary, in x and y."""
        elements = np.unique(self.retained // 2)
        displacement = self.conditions.displacement.copy()
        displacement.ravel()[self.retained] = retained_displacement
        in_plane = np.einsum("nkc,nk->nc", self.conditions.frame[elements], displacement[elements])
        amplitudes = None if elements.size == 0 else self.large_motion(elements, in_plane)
        loaded = self if amplitudes is None else self.subtracting(amplitudes)
        given = self._with_displacements(displacement - self.conditions.in_frames(loaded.motion)).take(elements)
        self.system.state(loaded.known, elements, given)
        traction, strained = self.system.full_state()
        return strained + loaded.motion, traction

    def residual(self, retained_displacement: FloatArray) -> float:
        """Return the largest residual at some elements, relative to the largest displacement."""
        displacement, traction = self.recovered(retained_displacement)
        n = self.force.shape[0]
        sampled = np.unique(np.linspace(0, n - 1, _SAMPLED).astype(int))
        scale = float(np.abs(displacement).max())
        return float(np.abs(self.system.residual(sampled, traction, displacement)).max()) / scale if scale else 0.0


def _loaded(conditions: NodalConditions, force: FloatArray) -> tuple[BoolArray, BoolArray]:
    """Return two masks (n_elements,): elements with a given force, and with a given displacement, other than zero."""
    return np.any(force != 0.0, axis=1), np.any(conditions.displacement != 0.0, axis=1)
