"""The direct collocation map of the paper, and its equations with one unknown a dof: traction or displacement."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray, IntArray, consecutive_runs
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace
from bemkit.operators.collocation.assembly import sweep_rows, write_columns
from bemkit.operators.collocation.collocation_points import Coefficients
from bemkit.operators.collocation.reciprocity import Reciprocity
from bemkit.operators.counts import Entries, OperationCounts
from bemkit.operators.linear.dense import DenseLU
from bemkit.operators.material import Material
from bemkit.operators.pair_form import Tag
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare.nodal_conditions import GivenData, NodalConditions, rotate_columns
from bemkit.operators.steklov_poincare.protocol import CondensedMap


class CollocationElasticity:
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
    that are no multiple of the one before take another sweep over the pairs.

    The equations along x come first, then those along y, then the resultants of the tractions and the reciprocities;
    for each of these there is one more unknown, an error of the displacement equations.
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
        motions = traction_free_modes(mesh, mesh.centres)
        reciprocity = Reciprocity.of(mesh, material, takes_slopes=slopes)
        self._find_balances(motions, reciprocity)

        # the displacement equations with the columns of their errors, and the balances below them
        errors = np.column_stack([motions, reciprocity.fields])
        n_rows, order = self._weights.size, self._weights.size + errors.shape[1]
        matrix, right = np.zeros((order, order)), np.zeros((order, self._retained.size), order="F")
        data = GivenData.of(conditions, force, conditions.displacement)
        n_elements = mesh.n_elements
        equations = matrix[:n_rows, :n_rows].reshape(2, n_elements, n_rows)
        known, work = self._sweep(data, equations, right[:n_rows].reshape(2, n_elements, self._retained.size))
        matrix[:n_rows, n_rows:] = np.concatenate([errors[0::2], errors[1::2]])
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

    def _find_balances(self, motions: FloatArray, reciprocity: Reciprocity) -> None:
        """Find on_traction @ t == on_displacement @ u for resultants and reciprocities, (n_balances, n_dofs) each.

        Resultants are of the size of the displacements that they cause: equations of one size are all solved to
        round-off; larger ones would gather that of their pivots.
        """
        material, frame = self._material, self._conditions.frame
        compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
        resultants = motions.T * (compliance * self._weights)
        on_traction = np.concatenate([resultants, reciprocity.on_traction])
        on_displacement = np.concatenate([np.zeros(resultants.shape), reciprocity.on_displacement])
        self._on_traction, self._on_displacement = (rotate_columns(x, frame) for x in (on_traction, on_displacement))

    def _sweep(
        self, data: GivenData, matrix: FloatArray | None = None, right: FloatArray | None = None
    ) -> tuple[FloatArray, OperationCounts]:
        """Return what data contribute to the equations (n_rows,), and fill the columns of what is not given.

        The matrix (2, n_elements, n_dofs) takes the columns of unknowns, `right` (2, n_elements, n_retained) those of
        the retained displacements.
        """
        n, n_rows, frame = self._mesh.n_elements, self._weights.size, self._conditions.frame
        loaded, moved = (np.flatnonzero(x) for x in (data.force, data.displacement))
        traction, displacement = data.force.ravel()[loaded] / self._weights[loaded], data.displacement.ravel()[moved]
        unknown = np.zeros(0, np.intp) if matrix is None else np.flatnonzero(~self._conditions.is_free)
        # elements with tractions, and the numbers of their dofs among those of all of them
        loaded_elements = np.unique(np.concatenate([unknown, loaded]) // 2)
        number = np.zeros(n_rows, np.intp)
        number[_dofs(loaded_elements)] = np.arange(2 * loaded_elements.size)
        retained_runs = consecutive_runs(self._retained)
        # the columns of consecutive unknowns are consecutive among those of the single layer, too
        unknown_runs = [
            (dofs, number[dofs])
            if isinstance(dofs, np.ndarray) or dofs.step
            else (dofs, slice(number[dofs.start], number[dofs.stop - 1] + 1))
            for _, dofs in consecutive_runs(unknown)
        ]
        known = np.zeros((2, n))

        def store(rows: slice, block: Coefficients) -> None:
            n_chunk = rows.stop - rows.start
            single = np.empty((2, n_chunk, 2 * loaded_elements.size))
            on, on_conjugate = block.on_traction[:, loaded_elements], block.on_conjugate_traction[:, loaded_elements]
            _write(on, on_conjugate, frame[loaded_elements], single)
            known[:, rows] += _product(single[:, :, number[loaded]], traction)
            if not needs_double:
                return
            block.on_displacement[np.arange(n_chunk), np.arange(rows.start, rows.stop)] += 0.5
            double = np.empty((2, n_chunk, n_rows)) if matrix is None else matrix[:, rows]
            _write(block.on_displacement, block.on_conjugate_displacement, frame, double)
            known[:, rows] -= _product(double[:, :, moved], displacement)
            if right is not None:
                for positions, dofs in retained_runs:
                    right[:, rows, positions] = double[:, :, dofs]
                for dofs, in_single in unknown_runs:
                    double[:, :, dofs] = -single[:, :, in_single]

        needs_double, needs_single = matrix is not None or moved.size > 0, np.zeros(n, bool)
        needs_single[loaded_elements] = True
        n_pairs = sweep_rows(
            self._mesh,
            self._material,
            store,
            needs_single=needs_single,
            needs_double=needs_double,
            takes_slopes=self._slopes,
        )
        of_loads, of_motions = Entries(n_rows * loaded.size), Entries(n_rows * moved.size)
        return known.ravel(), OperationCounts(element_pairs=n_pairs, single_layer=of_loads, double_layer=of_motions)

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


def _dofs(elements: IntArray) -> IntArray:
    return (2 * elements[:, None] + np.arange(2)).ravel()


def _write(on: FloatArray | ComplexArray, on_conjugate: ComplexArray, frame: FloatArray, columns: FloatArray) -> None:
    """Write v -> on v + on_conjugate conj(v) into columns (2, n_rows, n_dofs), v in the frames of the elements."""
    x, y = columns.reshape(2, len(on), -1, 2)
    write_columns(on, on_conjugate, x, y)
    turned = np.flatnonzero(np.any(frame != np.eye(2), axis=(1, 2)))
    for component in (x, y) if turned.size else ():
        along_x, along_y = component[:, turned, 0], component[:, turned, 1]
        for k in range(2):
            component[:, turned, k] = along_x * frame[turned, k, 0] + along_y * frame[turned, k, 1]


def _product(columns: FloatArray, values: FloatArray) -> FloatArray:
    """Return columns (2, n_rows, n) times values, without BLAS, whose threads would wait for those of the sweep."""
    product: FloatArray = np.einsum("crn,n->cr", columns, values)
    return product
