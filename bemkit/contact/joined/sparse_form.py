"""Many members: one sparse system for all contact forces and rigid motions, factored anew for each response."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from copy import copy
from functools import cache
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from bemkit.arrays import ComplexArray, FloatArray, IntArray, spread_fractions
from bemkit.contact.body import ContactState, SingularResponse
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.contact.reduced_conditions import ReducedConditions, as_pairs
from bemkit.errors import printable
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.linear_solvers import SingularMatrixError

_MISSING = "SuperLU (pip install 'bemkit[pardiso]' brings PARDISO, which is faster)"
_OPTIONS = {1: 1, 2: 2, 8: 0, 10: 13, 11: 0, 13: 0}
"""Nested dissection, tiny pivots enlarged by 1e-13, neither scaling nor matching: these would spoil the order, and the
rows are scaled before. The caller refines the solution, because it knows the matrix without its penalty."""

Solve = Callable[[FloatArray], FloatArray]
_SMALLEST_RCOND = 1e-15
"""Reciprocal condition number of a singular system; free motions are found before."""
_LARGEST_RESIDUAL = 1e-13
"""Residual of a failed factorisation, relative to its terms."""
_POOR_RCOND = 1e-9
"""Reciprocal condition number below which residuals are computed with more digits: bodies that are 1e7 times stiffer
than their neighbours move by that much more than they deform."""
_ATTEMPTS = ((1e-8, np.double), (1e-12, np.double), (1e-12, np.longdouble))
"""Diagonal entries of the motions in the factored matrix, and the precision of residuals. Refinement removes the
influence of these entries: large ones take more rounds, small ones cost more digits in each round."""
_MOST_ROUNDS = 12
"""Rounds of refinement; three are usual."""
_TINY = float(np.finfo(float).tiny)


@contextmanager
def factored(matrix: sparse.csr_array) -> Iterator[Solve]:
    """Factor a matrix with pivots on its diagonal; yields the function that solves with it.

    Parameters
    ----------
    matrix : (n, n) sparse array
        With a diagonal that may serve as pivots, and rows of size about one.

    Raises
    ------
    SingularMatrixError
        If a pivot vanishes.
    """
    if sparse_solver_name() == "PARDISO":
        with _factored_by_pardiso(matrix) as solve:
            yield solve
        return
    try:
        factors = splu(
            sparse.csc_array(matrix),
            permc_spec="MMD_AT_PLUS_A",
            diag_pivot_thresh=0.0,
            options={"SymmetricMode": True},
        )
    except RuntimeError as error:
        raise SingularMatrixError(str(error)) from error
    yield factors.solve


@contextmanager
def _factored_by_pardiso(matrix: sparse.csr_array) -> Iterator[Solve]:
    import pypardiso

    solver, plain = copy(_solver_without_matrix()), sparse.csr_matrix(matrix)
    solver.pt, solver.iparm = np.zeros_like(solver.pt), np.zeros_like(solver.iparm)
    for number, value in _OPTIONS.items():
        solver.set_iparm(number, value)
    try:
        solver.factorize(plain)
        yield lambda right_side: np.asarray(solver.solve(plain, right_side))
    except pypardiso.pardiso_wrapper.PyPardisoError as error:
        raise SingularMatrixError(str(error)) from error
    finally:
        solver.free_memory(everything=True)


@cache
def _solver_without_matrix() -> Any:
    """Return a solver that has searched the installation for the library, which takes as long as a factorisation."""
    import pypardiso

    return pypardiso.PyPardisoSolver()


@cache
def sparse_solver_name() -> str:
    """Return the name of the solver that factors sparse contact systems, and of a faster one that is not installed."""
    if importlib.util.find_spec("pypardiso") is None:
        return _MISSING
    try:
        with _factored_by_pardiso(sparse.csr_array(np.array([[2.0, 1.0], [0.0, 4.0]]))) as solve:
            if not np.allclose(solve(np.array([4.0, 8.0])), [1.0, 2.0]):
                return "SuperLU (PARDISO computes wrong numbers here)"
    except Exception as error:  # a broken installation raises anything
        return f"SuperLU (PARDISO does not work here: {printable(f'{type(error).__name__}: {error}')[:120]})"
    return "PARDISO"


def sparse_response(joined: CoupledMembers, conditions: LinearConditions) -> ContactState:
    """Return the response of many members; see `LinearBody.respond`.

    Parameters
    ----------
    joined : CoupledMembers
    conditions : LinearConditions
        That leave no rigid motion free.

    Raises
    ------
    SingularResponse
        If the conditions do not determine the response.

    Notes
    -----
    With tractions that are given by their conditions (open nodes, friction of slipping ones) substituted as
    ``p = T y + p_0``, the unknown forces y and motions a of the members solve ``U (w_0 + C p + M a) + X p = c`` and
    ``M^T p = -l``, the balance of each member under the work l of its load on its motions. The second rows have no
    diagonal. A small penalty there lets the motions be eliminated first, which couples no more forces than the
    compliance C of their member does: half of the entries of a system of forces and displacements. Deformation C p and
    motion M a are separate terms: a body of large modulus between soft ones moves far and hardly deforms, and a
    stiffness would lose the deformation in the round-off of the motion.
    """
    n, reduced = joined.n_contact, ReducedConditions.of(conditions)
    node, weights, by_force, motions = reduced.node, joined.weights, joined.compliance, joined.relative_motions
    on_displacement, on_force = (
        _rows(node, numbers, n) for numbers in (reduced.on_displacement, reduced.on_traction / weights[node])
    )
    by_unknown = sparse.csr_array(_rows(node, reduced.direction, n).T)
    given = (weights[:, None] * as_pairs(reduced.given)).ravel()
    at_rest = joined.prescribed + joined.gap_operator @ joined.deformation(joined.load) + by_force @ given
    # forces by the square root of the modulus on both sides, motions by its inverse: entries of size one
    is_tangential = np.abs(reduced.direction.real) > np.abs(reduced.direction.imag)
    row = np.sqrt(joined.moduli[2 * node + is_tangential])
    motion = 1.0 / np.sqrt(np.array([member.modulus for member in joined.members])[joined.motion_owner])
    scaled = sparse.diags_array(row)
    ties = scaled @ (on_displacement @ by_force + on_force) @ by_unknown @ scaled
    moved = scaled @ on_displacement @ motions.T @ sparse.diags_array(motion)
    balance = sparse.diags_array(motion) @ motions @ by_unknown @ scaled
    # all blocks in one format, also the empty one, are put together without sorting their entries anew
    blocks = [[ties, moved], [balance, sparse.csr_array((motion.size, motion.size))]]
    matrix = sparse.block_array([[sparse.csr_array(block) for block in row] for row in blocks], format="csr")
    values = row * (reduced.value - on_displacement @ at_rest - on_force @ given)
    work = motion * -(joined.motions.T @ joined.load + motions @ given)
    solution = _solved(matrix, np.append(values, work), n_motions=motion.size)
    force = by_unknown @ (row * solution[: node.size])
    displacement = at_rest + by_force @ force + motions.T @ (motion * solution[node.size :])
    traction = (force + given).reshape(n, 2) / joined.weights[:, None]
    displacement, traction = displacement.reshape(n, 2), conditions.with_given_tractions(traction)
    return ContactState(conditions.with_given_displacements(displacement), traction)


def _rows(node: IntArray, numbers: ComplexArray, n_contact: int) -> sparse.csr_array:
    """Return rows (n_unknowns, 2 n_contact); products with pairs (n, t) are the real parts of ``conj(number) pair``."""
    data, columns = as_pairs(numbers).ravel(), (2 * node[:, None] + np.arange(2)).ravel()
    rows = sparse.csr_array((data, columns, np.arange(0, data.size + 1, 2)), (node.size, 2 * n_contact))
    rows.eliminate_zeros()
    return rows


def _solved(matrix: sparse.csr_array, right_side: FloatArray, n_motions: int) -> FloatArray:
    """Return the solution, with every row scaled to a largest entry of one and its residual checked."""
    if not right_side.size:  # all forces are given, and supports hold all members
        return right_side
    terms = abs(matrix)
    sizes = terms.max(axis=1).toarray().ravel()
    if not sizes.all():
        raise SingularResponse("a condition at a contact node involves neither displacement nor stiffness")
    by_row = np.repeat(1.0 / sizes, np.diff(matrix.indptr))
    scaled = sparse.csr_array((matrix.data * by_row, matrix.indices, matrix.indptr), matrix.shape)
    terms.data *= by_row
    right_side = right_side / sizes
    probe = 0.5 + spread_fractions(len(right_side))
    right_sides, is_motion = np.stack([right_side, probe], axis=1), np.arange(len(right_side)) >= len(probe) - n_motions
    rcond = 0.0
    for penalty, precision in _ATTEMPTS:
        solutions, residual = _refined(scaled, terms, right_sides, np.where(is_motion, -penalty, 0.0), precision)
        if residual <= _LARGEST_RESIDUAL:
            rcond = 1.0 / (float(terms.sum(axis=1).max()) * float(np.abs(solutions[:, 1]).max()))
            if rcond > _POOR_RCOND or (rcond > _SMALLEST_RCOND and precision is np.longdouble):
                return np.asarray(solutions[:, 0], dtype=float)
            if rcond <= _SMALLEST_RCOND:
                break
    raise SingularResponse(f"the contact conditions do not hold the bodies (reciprocal condition {rcond:.1e})")


def _refined(
    matrix: sparse.csr_array,
    terms: sparse.csr_array,
    right_sides: FloatArray,
    penalty: FloatArray,
    precision: type[np.floating[Any]],
) -> tuple[FloatArray, float]:
    """Solve by iterative refinement with the factors of a matrix with a penalty; return also the largest residual.

    `terms` are the absolute values of the entries; residuals are relative to them.
    """
    exact, right_sides = matrix.astype(precision, copy=False), right_sides.astype(precision, copy=False)
    solutions, before = np.zeros_like(right_sides), np.inf
    try:
        with factored(sparse.csr_array(matrix + sparse.diags_array(penalty))) as solve:
            for _ in range(_MOST_ROUNDS):
                following = solutions + solve((right_sides - exact @ solutions).astype(float, copy=False))
                if not np.isfinite(following).all():
                    break
                sizes = (terms @ np.abs(following) + np.abs(right_sides)).max(axis=0)
                residuals = np.abs(right_sides - exact @ following).max(axis=0)
                residual = float((residuals / np.maximum(sizes, _TINY)).max())
                if residual < before:
                    solutions = following
                if residual > 0.5 * before or residual == 0.0:
                    break
                before = residual
    except SingularMatrixError as error:
        raise SingularResponse(f"the contact conditions do not hold the bodies ({error})") from error
    return solutions, before
