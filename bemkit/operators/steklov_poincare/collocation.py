"""The direct collocation map of the paper, and its equations with one unknown a dof: traction or displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace
from bemkit.operators.collocation.images import collocation_equations, displacement_rows
from bemkit.operators.collocation.layers import straight_layer
from bemkit.operators.counts import Entries, OperationCounts
from bemkit.operators.linear.dense import DenseLU
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Tag
from bemkit.operators.steklov_poincare.cost import CHUNK_PAIRS, BodyCase, BodyCost, collocation_cost
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, turn_columns
from bemkit.operators.steklov_poincare.protocol import BoundaryMap, CondensedMap
from bemkit.stopwatch import assembling


class CollocationElasticity(BoundaryMap):
    """Elasticity of a body by direct collocation, (1/2 + T) u = U t, with tractions in equilibrium.

    Displacements and tractions are constant on elements; the equations hold at their midpoints.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    slopes : bool
        Whether the double layer takes slopes between neighbouring elements
        (`bemkit.operators.collocation.gradient_reconstruction`).

    Notes
    -----
    The paper's discretisation, with three additions. With slopes, rotations cause no tractions, as translations do not
    in any case; constant elements do not hold them by themselves. Plain collocation satisfies the equilibrium of
    forces and moments only up to the discretisation error: here a rigid motion c is added to the equations and the
    resultants of the tractions are set to zero; c vanishes with the mesh size. On an exterior neither c nor the
    condition on the resultants is there. Likewise one reciprocity for each loop gives the pressure there, which the
    displacement equation loses as Poisson's ratio approaches 1/2 (`bemkit.operators.collocation.reciprocity`).
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, *, slopes: bool = True) -> None:
        self.mesh = mesh
        self.material = material
        self.slopes = slopes
        self.displacement_space: BoundarySpace = ConstantSpace(mesh)
        self.traction_space: BoundarySpace = self.displacement_space

    @property
    def tags(self) -> frozenset[Tag]:
        """Zero on rigid motions of a bounded body, with slopes; without them on translations only."""
        if self.mesh.is_exterior:
            return frozenset()
        return frozenset({Tag.KILLS_RIGID_MOTIONS if self.slopes else Tag.KILLS_TRANSLATIONS})

    def cost(self, case: BodyCase) -> BodyCost:
        """Return counts, memory and time of the map."""
        return collocation_cost(case, takes_slopes=self.slopes)

    def stiffness(self) -> FloatArray:
        """Return S, (n_dofs, n_dofs) [Pa]: the stiffness when all displacements are retained."""
        shape = self.mesh.n_elements, 2
        frame = np.broadcast_to(np.eye(2), (*shape, 2))
        retained = NodalConditions(frame, np.zeros(shape, bool), np.zeros(shape), np.ones(shape, bool))
        name = "the single layer operator"
        system = MixedSystem(self.mesh, self.material, retained, name, np.zeros(shape), slopes=self.slopes)
        return system.condensed().stiffness

    def condense(self, conditions: NodalConditions, force: FloatArray) -> CondensedMap:
        """Exchange columns so that all unknowns but the retained displacements are on the left, and solve once.

        Columns of tractions and displacements that are known to be zero are neither computed nor stored.
        """
        name = "the body held by its supports and its contact boundary"
        return MixedSystem(self.mesh, self.material, conditions, name, force, slopes=self.slopes).condensed()

    def element_tractions(self, displacement: FloatArray, force: FloatArray) -> FloatArray:
        """Return the (n_elements, 1, 2) tractions: forces over lengths."""
        return force[:, None] / self.mesh.lengths[:, None, None]


@dataclass(frozen=True, eq=False)
class _Solved:
    """Given data, and the unknowns (n_dofs,) under them with the retained displacements at rest."""

    data: GivenData
    at_rest: FloatArray


class MixedSystem:
    """(1/2 + T) u = U t solved for every unknown but the retained displacements.

    Parameters
    ----------
    mesh : BoundaryMesh
    material : Material
    conditions : NodalConditions
        Of the elements.
    name : str
        What is singular if the equations are.
    force : (n_elements, 2) array [N/m]
        In x and y: the first load, under which `condensed` is given.
    slopes : bool
        Whether the double layer takes the slopes of displacements; see
        `bemkit.operators.collocation.gradient_reconstruction`.

    Raises
    ------
    SingularMatrixError
        If the supports, and the retained directions held fast, leave the body free.

    Notes
    -----
    The unknown of a dof is its displacement where the force is known, else its traction; the columns of the matrix are
    those of the double layer there, else those of the single layer with the other sign. Columns that are multiplied by
    zero are neither computed nor stored: those of tractions on free directions without a load, and of displacements in
    directions that are held at rest. Columns of given data are multiplied by them at once and not stored either; loads
    that are not multiples of the one before take another sweep over the pairs.

    Resultants of the tractions and reciprocities come after the displacement equations, which have one more unknown for
    each of these: an error.
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
        every = np.arange(mesh.n_elements)
        self._equations = collocation_equations(mesh, material, every, takes_slopes=slopes, layer=straight_layer)
        border, frame = self._equations.border, conditions.frame
        balances = border.balances.reshape(-1, mesh.n_elements, 2, 2)
        self._on_traction, self._on_displacement = (
            each.reshape(len(balances), -1).copy() for each in (balances[:, :, 0], -balances[:, :, 1])
        )
        for each in (self._on_traction, self._on_displacement):
            turn_columns(each, frame)

        # the displacement equations with the columns of their errors, and the balances below them
        n_rows, order = self._weights.size, self._weights.size + len(balances)
        matrix, right = np.zeros((order, order), order="F"), np.zeros((order, self._retained.size), order="F")
        data = GivenData.of(conditions, force, conditions.displacement)
        known, work = self._sweep(data, matrix[:n_rows, :n_rows], right[:n_rows])
        matrix[:n_rows, n_rows:] = border.errors
        matrix[n_rows:, :n_rows] = np.where(conditions.is_free.ravel(), self._on_displacement, -self._on_traction)
        right[n_rows:] = self._on_displacement[:, self._retained]

        self._factor = DenseLU(matrix, name)
        self._response = -self._factor.solve(right)[:n_rows]
        work += OperationCounts(
            single_layer=Entries.full(n_rows, n_rows - self._free.size),
            double_layer=Entries.full(n_rows, self._free.size + self._retained.size),
            factorisations=(self._factor.factorisation,),
            right_hand_sides=self._retained.size + 1,
        )
        self._work, self._base = work, _Solved(data, self._solution(data, known))

    def condensed(self) -> CondensedMap:
        """Return the condensed map under the first load."""
        return self._condensed(self._force, self._base.data, self._base, 1.0, self._work)

    @assembling()
    def _sweep(
        self, data: GivenData, matrix: FloatArray | None = None, right: FloatArray | None = None
    ) -> tuple[FloatArray, OperationCounts]:
        """Return what data contribute to the equations (n_rows,), and fill the columns of what is not given.

        The matrix (n_rows, n_rows) takes the columns of unknowns, `right` (n_rows, n_retained) those of the retained
        displacements.
        """
        n, n_rows, conditions = self._mesh.n_elements, self._weights.size, self._conditions
        loaded, moved = (np.flatnonzero(x) for x in (data.force, data.displacement))
        traction, displacement = data.force.ravel()[loaded] / self._weights[loaded], data.displacement.ravel()[moved]
        unknown = np.zeros(0, np.intp) if matrix is None else np.flatnonzero(~conditions.is_free)
        # elements with tractions, and the indices of their dofs among those of all of them
        elements = np.unique(np.concatenate([unknown, loaded]) // 2)
        of_traction = (4 * elements[:, None] + np.arange(2)).ravel()
        index = np.zeros(n_rows, np.intp)
        index[(2 * elements[:, None] + np.arange(2)).ravel()] = np.arange(2 * elements.size)
        known, value_of_one = np.zeros(n_rows), 1.0 if self._mesh.is_exterior else 0.0
        needs_double = matrix is not None or moved.size > 0

        def fill(nodes: slice) -> None:
            rows, own = slice(2 * nodes.start, 2 * nodes.stop), np.arange(nodes.start, nodes.stop)
            single = self._equations.block(np.arange(rows.start, rows.stop), of_traction)  # minus the single layer
            turn_columns(single, conditions.frame[elements])
            known[rows] -= _product(single[:, index[loaded]], traction)
            if not needs_double:
                return
            double = displacement_rows(self._equations, own, value_of_one)
            turn_columns(double, conditions.frame)
            known[rows] -= _product(double[:, moved], displacement)
            if matrix is not None and right is not None:
                matrix[rows], right[rows] = double, double[:, self._retained]
                matrix[rows, unknown] = single[:, index[unknown]]

        n_sources = self._mesh.whole.n_elements
        step = max(1, CHUNK_PAIRS // n_sources)
        chunks = (slice(first, min(first + step, n)) for first in range(0, n, step))
        for_each_chunk(fill, chunks, n_integrals=n * n_sources)
        of_loads, of_motions = Entries(n_rows * loaded.size), Entries(n_rows * moved.size)
        n_pairs = n * n_sources * (n if needs_double else elements.size) // n
        return known, OperationCounts(element_pairs=n_pairs, single_layer=of_loads, double_layer=of_motions)

    def _solution(self, data: GivenData, known: FloatArray) -> FloatArray:
        """Return the unknowns (n_dofs,), the retained displacements at rest."""
        traction, displacement = data.force.ravel() / self._weights, data.displacement.ravel()
        balances = self._on_traction @ traction - self._on_displacement @ displacement
        return self._factor.solve(np.concatenate([known, balances]))[: traction.size]

    def _condensed(
        self, force: FloatArray, data: GivenData, base: _Solved, factor: float, work: OperationCounts
    ) -> CondensedMap:
        """Return the condensed map under forces (n_elements, 2) and data that are a multiple of others."""
        traction = self._conditions.in_frames(force).ravel() / self._weights
        at_rest = factor * base.at_rest
        own, retained = self._weights[self._retained], self._retained
        return _MixedMap(
            stiffness=own[:, None] * self._response[retained],
            load=own * (traction[retained] - at_rest[retained]),
            work=work,
            system=self,
            at_rest=at_rest,
            traction=traction,
            given=data.displacement.ravel(),
            base=base,
        )

    def recovered(self, loaded: _MixedMap, retained: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements of a map under retained displacements (n_retained,)."""
        is_free = self._conditions.is_free.ravel()
        unknowns = loaded.at_rest + self._response @ retained
        local = np.where(is_free, unknowns, loaded.given)
        local[self._retained] = retained
        force = self._weights * np.where(is_free, loaded.traction, unknowns)
        return self._conditions.in_plane(local), self._conditions.in_plane(force)

    def followed(self, loaded: _MixedMap, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what free directions of a map do; see `CondensedMap.follow`."""
        return self._response[directions], loaded.at_rest[directions]

    def under(self, base: _Solved, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the condensed map under other data; load factors, the usual case, take no other solution."""
        data, work = GivenData.of(self._conditions, force, displacement), OperationCounts()
        factor = data.factor_of(base.data)
        if factor is None:
            known, of_sweep = self._sweep(data)
            base, factor = _Solved(data, self._solution(data, known)), 1.0
            work = of_sweep + OperationCounts(right_hand_sides=1)
        return self._condensed(force, data, base, factor, work)


@dataclass(frozen=True, eq=False, kw_only=True)
class _MixedMap(CondensedMap):
    """The body under one load.

    Parameters
    ----------
    system : MixedSystem
    at_rest : (n_dofs,) array
        The unknowns with the retained displacements at rest.
    traction, given : (n_dofs,) arrays [Pa], [m]
        Given tractions and displacements in the frames.
    base : _Solved
        A load of which this one is a multiple.
    """

    system: MixedSystem
    at_rest: FloatArray
    traction: FloatArray
    given: FloatArray
    base: _Solved

    def recover(self, retained_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return displacement and force of all elements."""
        return self.system.recovered(self, retained_displacement)

    def under(self, force: FloatArray, displacement: FloatArray) -> CondensedMap:
        """Return the map under other loads."""
        return self.system.under(self.base, force, displacement)

    def follow(self, directions: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return what free directions do."""
        return self.system.followed(self, directions)


def _product(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return columns (2, n_rows, n) times values, without BLAS, whose threads would wait for those of the sweep."""
    product: FloatArray = np.einsum("rn,n->r", columns, values)
    return product
