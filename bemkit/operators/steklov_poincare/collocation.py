"""The direct collocation map of the paper, and its mixed equations for unknown tractions and displacements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace
from bemkit.operators.collocation.equations import collocation_equations, displacement_rows
from bemkit.operators.collocation.layers import straight_layer
from bemkit.operators.counts import Entries, Factorisation, FactorKind, OperationCounts
from bemkit.operators.linear_solvers import DenseLU, SingularMatrixError, Tag
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import admissible_modes
from bemkit.operators.steklov_poincare import BoundaryMap, CondensedMap
from bemkit.operators.steklov_poincare.nodal_conditions import SLIDES, GivenData, NodalConditions, turn_columns
from bemkit.stopwatch import assembling
from bemkit.threads import for_each_chunk

_CHUNK_PAIRS = 32768
"""Pairs of a midpoint and an element that each thread evaluates at a time."""


class CollocationElasticity(BoundaryMap):
    """Elasticity of a body by direct collocation, (1/2 + T) u = U t, with tractions in equilibrium.

    Displacements and tractions are constant on elements; the equations hold at their midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    slopes : bool
        Whether the displacements of the double layer vary linearly on each element, with slopes from its neighbours.

    Notes
    -----
    The discretisation of the paper has three additions. With slopes, rotations cause no tractions; constant elements
    represent only translations exactly. Plain collocation fulfils the equilibrium of forces and moments up to the
    discretisation error. Here the resultants of the tractions are set to zero, and a rigid motion c, which vanishes
    with the mesh size, is added to the equations; an exterior has neither. One reciprocity for each loop determines the
    uniform pressure there, which the displacement equation loses as Poisson's ratio approaches 1/2. See
    `bemkit.operators.collocation.corrections` for slopes and reciprocities.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, *, slopes: bool = True) -> None:
        self.mesh = mesh
        self.material = material
        self.slopes = slopes
        self.displacement_space: BoundarySpace = ConstantSpace(mesh)
        self.traction_space: BoundarySpace = self.displacement_space

    @property
    def tags(self) -> frozenset[Tag]:
        """The map of a bounded body vanishes on rigid motions with slopes, and on translations without slopes."""
        if self.mesh.is_exterior:
            return frozenset()
        return frozenset({Tag.KILLS_RIGID_MOTIONS if self.slopes else Tag.KILLS_TRANSLATIONS})

    def counts(self, conditions: NodalConditions, loads: Sequence[GivenData]) -> OperationCounts:
        """Return the operation counts of `condense` and of all load steps; nothing is integrated."""
        mesh, u, r, sweeps = self.mesh, conditions.is_fixed.size, conditions.n_retained, _different(loads)
        n_elements = mesh.n_elements  # the first sweep takes all elements, later ones may take only loaded ones
        for later in sweeps[1:]:
            n_elements += mesh.n_elements if later.n_moved else int(np.count_nonzero(later.force.any(axis=1)))
        n_loaded, n_moved = sum(data.n_loaded for data in sweeps), sum(data.n_moved for data in sweeps)
        order = u + len(admissible_modes(mesh)) + len(mesh.loops)
        return OperationCounts(
            element_pairs=n_elements * mesh.whole.n_elements,
            single_layer=Entries.full(u, conditions.n_fixed + r) + Entries(u * n_loaded),
            double_layer=Entries.full(u, conditions.n_free + r) + Entries(u * n_moved),
            factorisations=(Factorisation(FactorKind.LU, order),),
            right_hand_sides=r + int(is_enclosed(mesh, self.material, conditions)) + len(sweeps),
        )

    def stiffness(self) -> FloatArray:
        """Return S, (n_dofs, n_dofs) [Pa]: the stiffness with all displacements retained.

        Raises
        ------
        SingularMatrixError
            If the body is bounded and incompressible.
        """
        shape = self.mesh.n_elements, 2
        frame = np.broadcast_to(np.eye(2), (*shape, 2))
        retained = NodalConditions(frame, np.zeros(shape, bool), np.zeros(shape), np.ones(shape, bool))
        name = "the single layer operator"
        system = MixedSystem(self.mesh, self.material, retained, name, np.zeros(shape), slopes=self.slopes)
        condensed = system.condensed()
        if condensed.n_pressures:
            raise SingularMatrixError(
                "displacements leave the pressure in an incompressible body (poisson_ratio 0.5) undetermined: give a "
                "smaller poisson_ratio, or condense the map"
            )
        return condensed.stiffness

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Solve for all unknowns under unit displacements of the retained directions and the given load.

        Columns of tractions and displacements that are zero are neither computed nor stored.
        """
        name = "the body held by its supports and its contact boundary"
        return MixedSystem(self.mesh, self.material, conditions, name, force, slopes=self.slopes).condensed()

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the tractions (n_elements, 1, 2) [Pa]: forces per length."""
        return force[:, None] / self.mesh.lengths[:, None, None]


def is_enclosed(mesh: BoundaryMesh, material: Material, conditions: NodalConditions) -> bool:
    """Whether only contact determines the pressure in a nearly incompressible body; see `Volume.retained_pressure`."""
    if mesh.is_exterior or not material.is_nearly_incompressible:
        return False
    is_changing = np.abs(conditions.in_frames(mesh.normals)) > SLIDES
    return not bool(np.any(is_changing & conditions.is_free))


def _different(loads: Sequence[GivenData]) -> list[GivenData]:
    """Return the given data of the load steps that are no multiples of the data before."""
    different: list[GivenData] = []
    for data in loads:
        if not different or data.factor_of(different[-1]) is None:
            different.append(data)
    return different


@dataclass(frozen=True, eq=False)
class _Solved:
    """Given data, and the unknowns (n_dofs,) under them while the retained directions are at rest."""

    data: GivenData
    at_rest: FloatArray


class MixedSystem:
    """(1/2 + T) u = U t solved for all unknowns except the retained displacements.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    conditions : NodalConditions
        Conditions of the elements.
    name : str
        Name of the equations in error messages.
    force : (n_elements, 2) array [N/m]
        First load, in x and y; `condensed` returns the map under it.
    slopes : bool
        See `CollocationElasticity`.

    Raises
    ------
    SingularMatrixError
        If the body can move while its supports and its retained directions are held, or if supports leave an
        incompressible body no free boundary.

    Notes
    -----
    The unknown of a dof is its displacement if the force is given, otherwise its traction. Its column is that of the
    double layer, or that of the single layer with opposite sign. Columns of quantities that are zero are neither
    computed nor stored: tractions on free directions without a load, displacements of fixed directions at rest. Columns
    of other given data are multiplied by the data when they are computed, and not stored. A load that is no multiple of
    the last one takes another sweep over the element pairs.

    The equations for resultants and reciprocities follow the displacement equations; each adds an unknown, an error of
    the displacement equations. The reciprocity of the outer curve of an incompressible body is its change of volume.
    If the pressure is retained (`Volume.retained_pressure`), the mean normal traction where the boundary is not free
    takes the place of this equation, which then follows the retained displacements.
    """

    def __init__(
        self,
        mesh: BoundaryMesh,
        material: Material,
        conditions: NodalConditions,
        name: str,
        force: FloatArray,
        *,
        slopes: bool = True,
    ) -> None:
        self._mesh, self._material, self._conditions, self._slopes = mesh, material, conditions, slopes
        self._weights, self._force = np.repeat(mesh.lengths, 2), force
        self._free, self._fixed, self._retained = (
            np.flatnonzero(x) for x in (conditions.is_free, conditions.is_fixed, conditions.is_retained)
        )
        elements = np.arange(mesh.n_elements)
        self._equations = collocation_equations(mesh, material, elements, takes_slopes=slopes, layer=straight_layer)
        border, frame = self._equations.border, conditions.frame
        balances = border.balances.reshape(-1, mesh.n_elements, 2, 2)
        self._on_traction, self._on_displacement = (
            columns.reshape(len(balances), -1).copy() for columns in (balances[:, :, 0], -balances[:, :, 1])
        )
        for columns in (self._on_traction, self._on_displacement):
            turn_columns(columns, frame)
        pressures = self._retain_pressure()

        # displacement equations with the columns of their errors, then the balances
        n_rows, order = self._weights.size, self._weights.size + len(balances)
        matrix, right = np.zeros((order, order), order="F"), np.zeros((order, self._retained.size), order="F")
        data = GivenData.of(conditions, force, conditions.displacement)
        known, work = self._sweep(data, matrix[:n_rows, :n_rows], right[:n_rows])
        matrix[:n_rows, n_rows:] = border.errors
        matrix[n_rows:, :n_rows] = np.where(conditions.is_free.ravel(), self._on_displacement, -self._on_traction)
        right[n_rows:] = self._on_displacement[:, self._retained]
        right = np.hstack([right, np.pad(pressures, ((n_rows, 0), (0, 0)))]) if pressures.size else right

        self._factor = DenseLU(matrix, name)
        self._response = -self._factor.solve(right)[:n_rows]
        work += OperationCounts(
            single_layer=Entries.full(n_rows, n_rows - self._free.size),
            double_layer=Entries.full(n_rows, self._free.size + self._retained.size),
            factorisations=self._factor.factorisations,
            right_hand_sides=right.shape[1] + 1,
        )
        self._work, self._base = work, _Solved(data, self._solution(data, known))

    def condensed(self) -> CondensedMap:
        """Return the condensed map under the first load."""
        return self._condensed(self._force, self._base.data, self._base, 1.0, self._work)

    def _retain_pressure(self) -> FloatArray:
        """Replace the change of volume by the mean normal traction if the pressure is retained.

        Returns
        -------
        (n_balances, n_pressures) array [Pa]
            The pressure in each of the balances.
        """
        n_balances = len(self._on_traction)
        self._volume, self._by_tractions = np.zeros((2, self._weights.size, 0))
        if not self._material.is_nearly_incompressible or self._mesh.is_exterior:
            return np.zeros((n_balances, 0))
        from bemkit.operators.steklov_poincare.volume_constraint import Volume

        is_volume = np.zeros(n_balances, bool)  # the reciprocities of all loops come last
        is_volume[-len(self._mesh.loops) :] = np.asarray(self._mesh.loop_areas) > 0.0
        normal = self._conditions.in_frames(self._mesh.normals).ravel()
        compliance = 0.0 if self._material.is_incompressible else (self._on_traction[is_volume] @ normal).item()
        volume = Volume(self._on_displacement[is_volume].T.copy(), compliance, is_stiff=True)
        unit = volume.retained_pressure(self._conditions, self._material.plane_modulus)
        self._volume, self._by_tractions = volume.change @ unit, self._on_traction[is_volume].T @ unit
        if unit.size:
            held = np.where(self._conditions.is_free.ravel(), 0.0, normal * self._weights)
            self._on_traction[is_volume], self._on_displacement[is_volume] = held / np.abs(held).sum(), 0.0
        pressures = np.zeros((n_balances, unit.shape[1]))
        pressures[is_volume] = unit
        return pressures

    @assembling()
    def _sweep(
        self, data: GivenData, matrix: FloatArray | None = None, right: FloatArray | None = None
    ) -> tuple[FloatArray, OperationCounts]:
        """Return the contribution of given data to the equations (n_rows,), and fill the columns of unknowns.

        `matrix` (n_rows, n_rows) receives the columns of the unknowns, `right` (n_rows, n_retained) those of the
        retained displacements.
        """
        n, n_rows, conditions = self._mesh.n_elements, self._weights.size, self._conditions
        loaded, moved = (np.flatnonzero(x) for x in (data.force, data.displacement))
        traction, displacement = data.force.ravel()[loaded] / self._weights[loaded], data.displacement.ravel()[moved]
        unknown = np.zeros(0, np.intp) if matrix is None else np.flatnonzero(~conditions.is_free)
        # elements with tractions, and the index of each of their dofs among the computed columns
        elements = np.unique(np.concatenate([unknown, loaded]) // 2)
        of_traction = (4 * elements[:, None] + np.arange(2)).ravel()
        index = np.zeros(n_rows, np.intp)
        index[(2 * elements[:, None] + np.arange(2)).ravel()] = np.arange(2 * elements.size)
        known, value_of_one = np.zeros(n_rows), 1.0 if self._mesh.is_exterior else 0.0
        needs_double = matrix is not None or moved.size > 0

        def fill(nodes: slice) -> None:
            rows, targets = slice(2 * nodes.start, 2 * nodes.stop), np.arange(nodes.start, nodes.stop)
            single = self._equations.block(np.arange(rows.start, rows.stop), of_traction)  # minus the single layer
            turn_columns(single, conditions.frame[elements])
            known[rows] -= _product(single[:, index[loaded]], traction)
            if not needs_double:
                return
            double = displacement_rows(self._equations, targets, value_of_one)
            turn_columns(double, conditions.frame)
            known[rows] -= _product(double[:, moved], displacement)
            if matrix is not None and right is not None:
                matrix[rows], right[rows] = double, double[:, self._retained]
                matrix[rows, unknown] = single[:, index[unknown]]

        n_sources = self._mesh.whole.n_elements
        step = max(1, _CHUNK_PAIRS // n_sources)
        chunks = (slice(first, min(first + step, n)) for first in range(0, n, step))
        for_each_chunk(fill, chunks, n_integrals=n * n_sources)
        of_loads, of_motions = Entries(n_rows * loaded.size), Entries(n_rows * moved.size)
        n_pairs = n * n_sources * (n if needs_double else elements.size) // n
        return known, OperationCounts(element_pairs=n_pairs, single_layer=of_loads, double_layer=of_motions)

    def _solution(self, data: GivenData, known: FloatArray) -> FloatArray:
        """Return the unknowns (n_dofs,) while the retained directions are at rest."""
        traction, displacement = data.force.ravel() / self._weights, data.displacement.ravel()
        balances = self._on_traction @ traction - self._on_displacement @ displacement
        return self._factor.solve(np.concatenate([known, balances]))[: traction.size]

    def _condensed(
        self, force: FloatArray, data: GivenData, base: _Solved, factor: float, work: OperationCounts
    ) -> CondensedMap:
        """Return the condensed map under forces (n_elements, 2) and data that are `factor` times those of `base`."""
        traction = self._conditions.in_frames(force).ravel() / self._weights
        at_rest, given, retained = factor * base.at_rest, data.displacement.ravel(), self._retained
        weights = self._weights[retained]
        stiffness, load = (
            weights[:, None] * self._response[retained],
            weights * (traction[retained] - at_rest[retained]),
        )
        if self._volume.size:
            free, fixed = self._free, self._fixed
            of_unknowns = -self._by_tractions.T
            of_unknowns[:, free] = self._volume[free].T
            change = of_unknowns @ self._response
            change[:, : retained.size] += self._volume[retained].T
            stiffness = np.vstack([stiffness, change])
            of_given = self._volume[fixed].T @ given[fixed] - self._by_tractions[free].T @ traction[free]
            load = np.append(load, -of_given - of_unknowns @ at_rest)
        return _MixedMap(
            stiffness=stiffness,
            load=load,
            n_pressures=self._volume.shape[1],
            work=work,
            system=self,
            at_rest=at_rest,
            traction=traction,
            given=given,
            base=base,
        )

    def under(self, base: _Solved, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the condensed map under other data; a multiple of the last data takes no other solution."""
        data, work = GivenData.of(self._conditions, force, displacement), OperationCounts()
        factor = data.factor_of(base.data)
        if factor is None:
            known, of_sweep = self._sweep(data)
            base, factor = _Solved(data, self._solution(data, known)), 1.0
            work = of_sweep + OperationCounts(right_hand_sides=1)
        return self._condensed(force, data, base, factor, work)


@dataclass(frozen=True, eq=False, kw_only=True)
class _MixedMap(CondensedMap):
    """The body under one load."""

    system: MixedSystem
    at_rest: FloatArray  # (n_dofs,): the unknowns while the retained directions are at rest
    traction: FloatArray  # (n_dofs,) [Pa], given, in the frames
    given: FloatArray  # (n_dofs,) [m], given displacements in the frames
    base: _Solved  # solved data of which the given data are a multiple

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        system, conditions = self.system, self.system._conditions
        is_free = conditions.is_free.ravel()
        unknowns = self.at_rest + system._response @ retained_displacement
        local = np.where(is_free, unknowns, self.given)
        local[system._retained] = retained_displacement[: system._retained.size]
        force = system._weights * np.where(is_free, self.traction, unknowns)
        return conditions.in_plane(local), conditions.in_plane(force)

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.system.under(self.base, force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return response and displacement at rest of free directions."""
        return self.system._response[directions], self.at_rest[directions]


def _product(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return columns (n_rows, n) times values (n,), without BLAS, whose threads would wait for those of the sweep."""
    product: FloatArray = np.einsum("rn,n->r", columns, values)
    return product
