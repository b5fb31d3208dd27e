"""The boundary equations of collocation, their columns exchanged so that all unknowns stand on the left."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.assembly import BoundaryData, fill_columns
from bemkit.operators.collocation.columns import ColumnRun, column_runs
from bemkit.operators.collocation.reciprocity import Reciprocity
from bemkit.operators.counts import Entries, Work
from bemkit.operators.linear.dense import DenseLU
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import resting_motions
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.operators.steklov_poincare.nodes import rotate_columns
from bemkit.operators.steklov_poincare.prescribed import GivenData, in_plane
from bemkit.operators.steklov_poincare.protocol import CondensedMap


@dataclass(frozen=True, eq=False)
class _Solved:
    """Given data, and tractions and displacements by dof under them with the open displacements at rest."""

    data: GivenData
    at_rest: FloatArray


class ColumnExchange:
    """(1/2 + T) u = U t solved for every unknown but the open displacements.

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
        If the supports, and the open directions held fast, leave the body free.

    Notes
    -----
    Columns that are multiplied by zero are neither computed nor stored: those of tractions on free directions without
    a load, and of displacements in directions that are held at rest. Columns of given data are multiplied by them at
    once and not stored either; loads that are no multiple of the one before take another sweep over the pairs.

    The equations along x come first, then those along y, so that columns are written without gaps; likewise the
    unknowns: minus tractions where the displacement is given or open, then displacements where the traction is given.
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
        self._weights = np.repeat(mesh.lengths, 2)
        motions = resting_motions(mesh, mesh.centres)
        self._local_motions = rotate_columns(motions.T, conditions.frame).T
        self._tractions, self._displacements = _in_two(~conditions.is_free), _in_two(conditions.is_free)
        n_rows, n_tractions, opened = self._weights.size, self._tractions.size, _in_two(conditions.is_open)

        reciprocity = Reciprocity.of(mesh, material, takes_slopes=slopes)
        self._on_traction = rotate_columns(reciprocity.on_traction, conditions.frame)
        self._on_displacement = rotate_columns(reciprocity.on_displacement, conditions.frame)
        errors = np.column_stack([motions, reciprocity.fields])
        order = n_rows + errors.shape[1]
        matrix, right = np.zeros((order, order)), np.zeros((order, opened.size), order="F")
        frame = conditions.frame
        single = column_runs(matrix[:n_rows, :n_tractions], self._tractions, frame)
        double = column_runs(matrix[:n_rows, n_tractions:n_rows], self._displacements, frame)
        data = GivenData.of(conditions, force, conditions.displacement)
        known, work = self._sweep(data, single, [*double, *column_runs(right[:n_rows], opened, frame)])
        matrix[:n_rows, n_rows:] = np.concatenate([errors[0::2], errors[1::2]])
        matrix[n_rows:, :n_tractions] = self._of_tractions(self._tractions)
        matrix[n_rows:, n_tractions:n_rows] = self._of_displacements(self._displacements)
        right[n_rows:] = self._of_displacements(opened)
        self._factor = DenseLU(matrix, name)
        self._response = -self._by_dof(self._factor.solve(right)[:, np.argsort(opened)])
        work += Work(
            single_layer=Entries.full(n_rows, n_tractions),
            double_layer=Entries.full(n_rows, n_rows - n_tractions + opened.size),
            factorisations=(self._factor.factorisation,),
            right_hand_sides=opened.size,
        )
        self._force, self._base = force, _Solved(data, self._solution(data, known))
        self._work = work + Work(right_hand_sides=1)

    def condensed(self) -> CondensedMap:
        """Return the condensed map under the first load."""
        return self._condensed(self._force, self._base.data, self._base, 1.0, self._work)

    def _sweep(
        self, data: GivenData, single: Sequence[ColumnRun] = (), double: Sequence[ColumnRun] = ()
    ) -> tuple[FloatArray, Work]:
        """Compute columns of unknowns, and what the given data contribute to the equations."""
        frame, weights = self._conditions.frame, self._mesh.lengths
        boundary_data = BoundaryData(in_plane(frame, data.force) / weights, in_plane(frame, data.displacement))
        filled = fill_columns(self._mesh, self._material, single, double, takes_slopes=self._slopes, data=boundary_data)
        own = np.arange(self._mesh.n_elements)
        for run in double:
            run.add(own, own, np.full(own.size, 0.5 + 0j), 0.0)
        known = filled.known - 0.5 * boundary_data.displacement
        n_rows = 2 * known.size
        of_tractions, of_displacements = (Entries(n_rows * n) for n in (data.n_loaded, data.n_moved))
        work = Work(element_pairs=filled.n_pairs, single_layer=of_tractions, double_layer=of_displacements)
        return np.concatenate([known.real, known.imag]), work

    def _solution(self, data: GivenData, known: FloatArray) -> FloatArray:
        """Return the unknowns by dof, the open displacements at rest."""
        free, fixed = (np.flatnonzero(x) for x in (self._conditions.is_free, self._conditions.is_fixed))
        traction, displacement = data.force.ravel()[free] / self._weights[free], data.displacement.ravel()[fixed]
        balances = self._of_tractions(free) @ traction - self._of_displacements(fixed) @ displacement
        return self._by_dof(self._factor.solve(np.concatenate([known, balances])))

    def _of_tractions(self, dofs: IntArray) -> FloatArray:
        """Return the resultants of tractions, and their part in the reciprocities: (n_balances, n_dofs).

        Resultants are of the size of the displacements that they cause: equations of one size are all solved to
        round-off; larger ones would gather that of their pivots.
        """
        material = self._material
        compliance = 1.0 / (8.0 * np.pi * material.shear_modulus * (1.0 - material.effective_poisson_ratio))
        resultants = (self._local_motions[dofs] * (compliance * self._weights)[dofs, None]).T
        return np.concatenate([resultants, self._on_traction[:, dofs]])

    def _of_displacements(self, dofs: IntArray) -> FloatArray:
        """Return the part of displacements in the same equations, (n_balances, n_dofs); resultants have none."""
        none = np.zeros((self._local_motions.shape[1], dofs.size))
        return np.concatenate([none, self._on_displacement[:, dofs]])

    def _by_dof(self, unknowns: FloatArray) -> FloatArray:
        """Sort the unknowns by dof: tractions where the displacement is given or open, else displacements."""
        result: FloatArray = np.empty((self._weights.size, *unknowns.shape[1:]))
        n_tractions = self._tractions.size
        result[self._tractions] = -unknowns[:n_tractions]
        result[self._displacements] = unknowns[n_tractions : self._weights.size]
        return result

    def _condensed(self, force: FloatArray, data: GivenData, base: _Solved, factor: float, work: Work) -> CondensedMap:
        """Return the condensed map under data that are a multiple of others, for which the equations are solved."""
        at_rest = factor * base.at_rest
        conditions, weights, response = self._conditions, self._weights, self._response
        is_open, fixed = np.flatnonzero(conditions.is_open), np.flatnonzero(conditions.is_fixed)
        traction = np.einsum("nkc,nc->nk", conditions.frame, force).ravel() / weights
        is_traction, given = ~conditions.is_free.ravel(), data.displacement.ravel()

        def recover(open_displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
            unknowns = at_rest + response @ open_displacement
            local = np.where(is_traction, 0.0, unknowns)
            local[fixed] = given[fixed]
            local[is_open] = open_displacement
            local_force = weights * np.where(is_traction, unknowns, traction)
            displacement = np.einsum("nkc,nk->nc", conditions.frame, local.reshape(-1, 2))
            return displacement, np.einsum("nkc,nk->nc", conditions.frame, local_force.reshape(-1, 2))

        def follow(directions: IntArray) -> tuple[FloatArray, FloatArray]:
            return response[directions], at_rest[directions]

        def under(force: FloatArray, displacement: FloatArray) -> CondensedMap:
            other = GivenData.of(conditions, force, displacement)
            factor = other.factor_of(base.data)
            if factor is not None:  # the usual case of load factors
                return self._condensed(force, other, base, factor, Work())
            known, work = self._sweep(other)
            solved = _Solved(other, self._solution(other, known))
            return self._condensed(force, other, solved, 1.0, work + Work(right_hand_sides=1))

        own = weights[is_open]
        load = own * (traction[is_open] - at_rest[is_open])
        return CondensedMap(own[:, None] * response[is_open], load, recover, under, follow, work=work)


def _in_two(chosen: BoolArray) -> IntArray:
    """Return the dofs of some directions (n_elements, 2): the first directions first, then the others."""
    return np.concatenate([2 * np.flatnonzero(chosen[:, 0]), 2 * np.flatnonzero(chosen[:, 1]) + 1])
