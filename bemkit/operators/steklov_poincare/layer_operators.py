"""The boundary operators of a Galerkin map."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, read_only
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.operators.assembly import assemble_together
from bemkit.operators.counts import Entries, OperationCounts
from bemkit.operators.forms import double_layer_form, hypersingular_form, mass_matrix, single_layer_form
from bemkit.operators.linear_solvers import Cholesky, multiply, subtract_product
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes

_MIRRORED = 128
"""Rows that are mirrored at a time, to stay in the cache."""


@dataclass(frozen=True, eq=False)
class GalerkinFactors:
    """The matrices that a Galerkin map computes once.

    Parameters
    ----------
    matrix : (n_dofs, n_dofs) array [Pa]
        Symmetric S = W + B^T V^-1 B without the uniform pressure.
    single_layer : Cholesky
        V = L L^T.
    whitened_trace : (n_traction_dofs, n_dofs) array
        L^-1 B with B = 1/2 M + K, projected on tractions without a resultant.
    work : OperationCounts
        Operations of assembly and factorisation.
    """

    matrix: FloatArray
    single_layer: Cholesky
    whitened_trace: FloatArray
    work: OperationCounts


def galerkin_factors(
    displacements: BoundarySpace, tractions: BoundarySpace, material: Material, pressures: FloatArray
) -> GalerkinFactors:
    """Assemble V, K and W of a map, factor V and form S.

    Parameters
    ----------
    displacements, tractions : BoundarySpace
    material : Material
    pressures : (n_traction_dofs, n_pressures) array
        Traction dofs of uniform pressures; V is not inverted on those of an incompressible body.

    Returns
    -------
    GalerkinFactors
        V is inverted on tractions t without a resultant or a uniform pressure, and with <V n, t> = 0 for a compressible
        body with normals n; n are the tractions of its dilatation.
    """
    u, t, mesh = displacements, tractions, displacements.mesh
    single = single_layer_form(t, t, material)
    (v, k, w), n_pairs = assemble_together(
        [single, double_layer_form(u, t, material), hypersingular_form(u, u, material)]
    )
    work = OperationCounts(
        element_pairs=n_pairs,
        single_layer=Entries.full(t.n_dofs, t.n_dofs),
        double_layer=Entries.full(t.n_dofs, u.n_dofs),
        hypersingular=Entries.full(u.n_dofs, u.n_dofs),
    )
    is_compressible = not (material.is_incompressible or mesh.is_exterior)
    annihilated = np.zeros((t.n_dofs, 0)) if is_compressible else mass_matrix(t, t) @ pressures
    kernel = np.column_stack([annihilated, _unit_vectors(antisymmetric_dofs(t))])
    factor = Cholesky(_without_kernel(v, kernel), "the single layer operator", overwrite=True)
    del v  # free each matrix after its last use: memory holds few of them
    motions = traction_free_modes(mesh, dof_points(u))
    mass = mass_matrix(u, t).tocoo()
    resultants = mass @ motions
    k[mass.row, mass.col] += 0.5 * mass.data
    # polynomials do not represent a rotation of curved elements exactly: treat its interpolant as a rigid motion
    at_rest, _ = np.linalg.qr(motions[:, : 0 if mesh.is_straight.all() else 3])
    trace = _without(k, at_rest)
    del k
    hyper = _without(_without(w, at_rest).T, at_rest).T
    del w
    dilatation = dilatation_of(u)[:, None][:, : int(is_compressible)]
    excluded = np.column_stack([resultants, annihilated, trace @ dilatation])
    # L^-T maps the orthogonal complement of this basis to the tractions without a resultant
    basis, _ = np.linalg.qr(factor.solve_lower(excluded))
    whitened = factor.solve_lower(trace, overwrite=True)
    if basis.shape[1]:
        subtract_product(whitened.T, multiply(whitened.T, basis), basis)
    n_solved = excluded.shape[1] + whitened.shape[1]
    work += OperationCounts(factorisations=factor.factorisations, right_hand_sides=n_solved)
    return GalerkinFactors(_symmetric_sum(hyper, whitened), factor, whitened, work)


def _symmetric_sum(hyper: FloatArray, whitened_trace: FloatArray) -> FloatArray:
    """Return the symmetric `hyper` plus whitened_trace^T whitened_trace, read-only; `hyper` is overwritten."""
    from scipy.linalg.blas import dsyrk

    # BLAS computes one triangle (above the diagonal in row-major order), which is then mirrored
    column_major = hyper.T if hyper.flags.c_contiguous else hyper
    matrix: FloatArray = dsyrk(1.0, whitened_trace.T, beta=1.0, c=column_major, lower=1, overwrite_c=1).T
    for begin in range(0, len(matrix), _MIRRORED):
        block, after = slice(begin, begin + _MIRRORED), slice(begin + _MIRRORED, None)
        matrix[after, block] = matrix[block, after].T
        matrix[block, block] = np.triu(matrix[block, block]) + np.triu(matrix[block, block], 1).T
    return read_only(matrix)


def dilatation_of(space: BoundarySpace) -> FloatArray:
    """Return the dofs (n_dofs,) of the dilatation x - centre of the body."""
    return np.where(antisymmetric_dofs(space), 0.0, (dof_points(space) - space.mesh.centre).ravel())


def _without(matrix: FloatArray, motions: FloatArray) -> FloatArray:
    """Return the matrix projected so that it vanishes on some orthonormal motions (n_dofs, n_motions)."""
    if not motions.shape[1]:
        return matrix
    return matrix - multiply(multiply(matrix, motions), np.ascontiguousarray(motions.T))


def _unit_vectors(chosen: BoolArray) -> FloatArray:
    """Return the unit vectors (n, n_chosen) of the chosen dofs."""
    rows = np.flatnonzero(chosen)
    vectors = np.zeros((chosen.size, rows.size))
    vectors[rows, np.arange(rows.size)] = 1.0
    return vectors


def _without_kernel(matrix: FloatArray, directions: FloatArray) -> FloatArray:
    """Add the mean eigenvalue along directions that the matrix may annihilate; they are projected out later."""
    if not directions.shape[1]:
        return matrix
    unit, _ = np.linalg.qr(directions)
    raised: FloatArray = matrix + np.trace(matrix) / len(matrix) * unit @ unit.T
    return raised
