"""Many members: one sparse system for all displacements and contact forces, factored anew for each response."""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import maximum_bipartite_matching
from scipy.sparse.linalg import splu

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState, SingularResponse
from bemkit.contact.conditions import LinearConditions
from bemkit.contact.joined.coupled_members import CoupledMembers
from bemkit.contact.joined.reduced_members import ReducedMembers

_SMALLEST_RCOND = 1e-15
"""Reciprocal condition number from which on the system counts as singular; free motions are found before."""
_LARGEST_RESIDUAL = 1e-13
"""Residual, relative to its terms, from which on a factorisation counts as failed."""
_LARGE = 0.3
"""Entries of a row of the coupling above this share of its largest may be pivots."""


def sparse_response(joined: CoupledMembers, reduced: ReducedMembers, conditions: LinearConditions) -> ContactState:
    """Return the response of many members; see `LinearBody.respond`.

    Parameters
    ----------
    joined : CoupledMembers
    reduced : ReducedMembers
        The same members as far as contacts feel them.
    conditions : LinearConditions
        That leave no rigid motion free.

    Raises
    ------
    SingularResponse
        If the conditions do not determine the response.

    Notes
    -----
    With tractions that are given by their conditions (open nodes, friction of slipping ones) substituted as
    ``p = T y + p_0``, the unknowns u and y solve ``K u - B^T T y = f + B^T p_0`` and
    ``U B u + X T y = c - U o - X p_0``.
    The second rows have no diagonal. Exchanged with those of the displacement that each of them ties they make a matrix
    like that of the bodies grown together, which a symmetric minimum degree ordering suits: a third of the entries of
    an ordering by columns.
    """
    n, modulus = joined.n_contact, joined.modulus
    given = _Given.by(conditions, joined.weights)
    kept = np.flatnonzero(~given.is_given.ravel())
    on_displacement, on_force = (
        _blocks(array)[kept]
        for array in (conditions.on_displacement, conditions.on_traction / joined.weights[:, None, None])
    )
    ties = sparse.csr_array(on_displacement @ reduced.relative)
    spread = reduced.relative.T @ given.by_kept
    matrix = sparse.block_array(
        [[reduced.stiffness / modulus, -spread], [ties, modulus * (on_force @ given.by_kept)]], format="csr"
    )
    forces = reduced.on_kept @ joined.load + reduced.relative.T @ given.at_rest
    values = conditions.value.ravel()[kept] - on_displacement @ joined.offset - on_force @ given.at_rest
    solution = _solved(matrix, np.concatenate([forces / modulus, values]), ties)
    n_displacements = reduced.relative.shape[1]
    displacement = (reduced.relative @ solution[:n_displacements] + joined.offset).reshape(n, 2)
    force = given.by_kept @ (modulus * solution[n_displacements:]) + given.at_rest
    return _exact(conditions, displacement, force.reshape(n, 2) / joined.weights[:, None])


class _Given:
    """Nodal forces (2 n_contact,) that follow from conditions on tractions: ``by_kept @ y + at_rest``."""

    def __init__(self, is_given: BoolArray, by_kept: sparse.csr_array, at_rest: FloatArray) -> None:
        self.is_given, self.by_kept, self.at_rest = is_given, by_kept, at_rest

    @classmethod
    def by(cls, conditions: LinearConditions, weights: FloatArray) -> _Given:
        is_given = ~np.any(conditions.on_displacement != 0.0, axis=2)
        own = np.einsum("nii->ni", conditions.on_traction)
        other = np.stack([conditions.on_traction[:, 0, 1], conditions.on_traction[:, 1, 0]], axis=1)
        both, alone = is_given.all(axis=1), is_given & ~is_given.all(axis=1, keepdims=True)
        if np.any(alone & (own == 0.0)) or np.any(np.linalg.det(conditions.on_traction[both]) == 0.0):
            raise SingularResponse("a condition at a contact node involves neither displacement nor traction")
        at_rest = np.zeros_like(conditions.value)
        at_rest[alone] = conditions.value[alone] / own[alone]
        at_rest[both] = np.linalg.solve(conditions.on_traction[both], conditions.value[both][:, :, None])[:, :, 0]
        number = (np.cumsum(~is_given) - 1).reshape(is_given.shape)
        node, component = np.nonzero(alone)
        rows = np.append(np.flatnonzero(~is_given), 2 * node + component)
        columns = np.append(number[~is_given], number[node, 1 - component])
        factors = np.append(np.ones(np.count_nonzero(~is_given)), -other[alone] / own[alone])
        shape = (is_given.size, np.count_nonzero(~is_given))
        by_kept = sparse.csr_array((factors, (rows, columns)), shape)
        by_kept.eliminate_zeros()
        return cls(is_given, by_kept, (weights[:, None] * at_rest).ravel())


def _blocks(blocks: FloatArray) -> sparse.csr_array:
    """Return the sparse array with 2 x 2 blocks (n, 2, 2) on its diagonal."""
    n = len(blocks)
    array = sparse.csr_array(sparse.bsr_array((np.ascontiguousarray(blocks), np.arange(n), np.arange(n + 1))))
    array.eliminate_zeros()
    return array


def _solved(matrix: sparse.csr_array, right_side: FloatArray, ties: sparse.csr_array) -> FloatArray:
    """Return the solution, with every row scaled to a largest entry of one and its residual checked."""
    sizes = abs(matrix).max(axis=1).toarray().ravel()
    if not sizes.all():
        raise SingularResponse("a condition at a contact node involves neither displacement nor stiffness")
    order = _exchanged(ties)
    scaled = sparse.csc_array((sparse.diags_array(1.0 / sizes) @ matrix)[order])
    right_side = (right_side / sizes)[order]
    probe = 0.5 + np.modf(np.arange(1, len(right_side) + 1) * 0.6180339887498949)[0]
    trials = (
        {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.01, "options": {"SymmetricMode": True}},
        {"permc_spec": "COLAMD"},
    )
    terms = abs(scaled)
    for options in trials:
        try:
            factors = splu(scaled, **options)
        except RuntimeError as error:
            raise SingularResponse(f"the contact conditions do not hold the bodies ({error})") from error
        solution, probed = factors.solve(np.stack([right_side, probe], axis=1)).T
        rcond = 1.0 / (float(terms.sum(axis=1).max()) * float(np.abs(probed).max()))
        solution = solution + factors.solve(right_side - scaled @ solution)
        residual = np.abs(right_side - scaled @ solution)
        if residual.max() <= _LARGEST_RESIDUAL * (terms @ np.abs(solution) + np.abs(right_side)).max():
            if rcond > _SMALLEST_RCOND:
                return np.asarray(solution)
            break
    raise SingularResponse(f"the contact conditions do not hold the bodies (reciprocal condition {rcond:.1e})")


def _exchanged(ties: sparse.csr_array) -> IntArray:
    """Return the order of rows in which each tie has changed places with a displacement of its own."""
    n_ties, n = ties.shape
    largest = abs(ties).max(axis=1).toarray().ravel()
    is_large = ties.copy()
    is_large.data = (np.abs(ties.data) >= _LARGE * np.repeat(largest, np.diff(ties.indptr))).astype(float)
    is_large.eliminate_zeros()
    partner = maximum_bipartite_matching(sparse.csr_matrix(is_large), perm_type="column")
    tie = np.flatnonzero(partner >= 0)
    order: IntArray = np.arange(n + n_ties, dtype=np.intp)
    order[partner[tie]], order[n + tie] = n + tie, partner[tie]
    return order


def _exact(conditions: LinearConditions, displacement: FloatArray, traction: FloatArray) -> ContactState:
    """Return the state with prescribed displacements and tractions met exactly, so that ties are decided alike."""
    on_displacement, on_traction = conditions.on_displacement, conditions.on_traction
    for row in (0, 1):
        own, other = on_displacement[:, row, row], on_displacement[:, row, 1 - row]
        is_met = (own != 0.0) & (other == 0.0) & ~np.any(on_traction[:, row] != 0.0, axis=1)
        displacement[is_met, row] = conditions.value[is_met, row] / own[is_met]
    for row in (0, 1):
        own = on_traction[:, row, row]
        is_met = (own != 0.0) & ~np.any(on_displacement[:, row] != 0.0, axis=1)
        rest = conditions.value[:, row] - on_traction[:, row, 1 - row] * traction[:, 1 - row]
        traction[is_met, row] = rest[is_met] / own[is_met]
    return ContactState(displacement, traction)
