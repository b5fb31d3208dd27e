"""The relative displacements of contact nodes as a matrix times the displacements of bodies, plus a vector."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray
from bemkit.contact.joined.member import diagonal_blocks
from bemkit.model.prepared import Prepared, PreparedBody
from bemkit.model.units import Units, motion_units
from bemkit.scene.plane_motion import RigidBody


def _nodal(body: PreparedBody, n_pressures: int) -> sparse.csr_array:
    """Return how retained unknowns move nodes in the axes of the scene, sparse (2 n_nodes, n_retained)."""
    conditions = body.conditions
    directions = body.turn.turned(conditions.frame)  # (n_nodes, 2, 2): rows are vectors
    node, k = np.nonzero(conditions.is_retained)
    vectors = directions[node, k]
    rows = 2 * node[:, None] + np.arange(2)
    columns = np.broadcast_to(np.arange(node.size)[:, None], rows.shape)
    shape = (2 * len(directions), node.size + n_pressures)
    return sparse.csr_array((vectors.ravel(), (rows.ravel(), columns.ravel())), shape)


def _prescribed(body: PreparedBody) -> FloatArray:
    """Return the displacements (2 n_nodes,) that supports prescribe, in the axes of the scene."""
    conditions = body.conditions
    fixed = np.where(conditions.is_fixed, conditions.displacement, 0.0)
    return np.asarray(np.einsum("nkc,nk->nc", body.turn.turned(conditions.frame), fixed)).ravel()


def _frames(prepared: Prepared) -> sparse.csr_array:
    """Return the matrix from displacements in x and y at the contact nodes to (n, t) components.

    On a symmetry line the images of both bodies cancel what is left of the tangential component.
    """
    n, frame = prepared.n_contact, prepared.frame.copy()
    frame[prepared.is_on_line, 1] = 0.0
    return sparse.csr_array(sparse.bsr_array((frame, np.arange(n), np.arange(n + 1)), shape=(2 * n, 2 * n)))


def coupling(prepared: Prepared) -> sparse.csr_array:
    """Return how the nodes of all bodies move the contact nodes, (2 n_contact, 2 n_nodes), in (n, t) components."""
    n_nodes = [body.space.n_dofs // 2 for body in prepared.bodies]
    first = np.concatenate([[0], np.cumsum(n_nodes)])
    data, row, column, begin = [np.zeros(0)], [np.zeros(0, np.intp)], [np.zeros(0, np.intp)], 0
    for rows in prepared.rows:
        if rows.couplings is None:
            data.append(np.ones(rows.n_contact))
            row.append(begin + np.arange(rows.n_contact))
            column.append(first[rows.body] + rows.nodes)
        for sign, number, on_nodes in zip((1.0, -1.0), rows.sides, rows.couplings or (), strict=False):
            data.append(sign * on_nodes.data)
            row.append(begin + np.repeat(np.arange(rows.n_contact), np.diff(on_nodes.indptr)))
            column.append(first[number] + on_nodes.indices)
        begin += rows.n_contact
    entries = np.concatenate(data), (np.concatenate(row), np.concatenate(column))
    difference = sparse.csr_array(entries, (begin, int(first[-1])))
    return sparse.csr_array(_frames(prepared) @ sparse.kron(difference, sparse.eye_array(2), format="csr"))


def _rigid_coupling(prepared: Prepared) -> sparse.csr_array:
    """Return how the motions of all rigid bodies move the contact nodes, (2 n_contact, 3 n_rigid)."""
    n_elastic, n_rigid = len(prepared.bodies), len(prepared.scene.rigid)
    by_motions = np.zeros((prepared.n_contact, 2, n_rigid, 3))
    for rows, motions in prepared.by_contact(by_motions):
        if rows.motions is not None:
            motions[:, :, rows.other - n_elastic] = -rows.motions / motion_units(prepared.units)
    shape = 2 * prepared.n_contact, 3 * n_rigid
    return sparse.csr_array(_frames(prepared) @ sparse.csr_array(by_motions.reshape(shape)))


def rigid_motions(body: RigidBody, units: Units) -> tuple[sparse.csr_array, FloatArray]:
    """Return how the unknown motions (n_driven,) move a rigid body.

    Returns
    -------
    sparse (3, n_driven) array, (3,) array
        Dimensionless motions x, y, turn are the product, and the array what is given.
    """
    chosen = sparse.csr_array(np.eye(3)[:, body.is_load_controlled])
    return chosen, body.motion * motion_units(units) / units.displacement


def gap_operator(prepared: Prepared, n_pressures: Sequence[int]) -> sparse.csr_array:
    """Return how the retained unknowns of all bodies move the contact nodes, (2 n_contact, n_retained).

    Parameters
    ----------
    prepared : Prepared
    n_pressures : sequence of int
        Number of retained pressures of each body, its last unknowns, which move nothing.
    """
    nodal = [_nodal(body, n) for body, n in zip(prepared.bodies, n_pressures, strict=True)]
    result = sparse.csr_array(coupling(prepared) @ diagonal_blocks(nodal))
    if prepared.scene.rigid:
        chosen = [rigid_motions(body, prepared.units)[0] for body in prepared.scene.rigid]
        driven = _rigid_coupling(prepared) @ diagonal_blocks(chosen)
        result = sparse.csr_array(sparse.hstack([result, driven], format="csr"))
    result.eliminate_zeros()
    return result


def prescribed(prepared: Prepared) -> FloatArray:
    """Return the relative displacements (2 n_contact,) that supports and motions of rigid bodies prescribe."""
    result = np.zeros(2 * prepared.n_contact)
    prescribed = [_prescribed(body) for body in prepared.bodies]
    if any(displacement.any() for displacement in prescribed):
        result += coupling(prepared) @ np.concatenate(prescribed)
    if prepared.scene.rigid:
        motions = [rigid_motions(body, prepared.units)[1] for body in prepared.scene.rigid]
        result += _rigid_coupling(prepared) @ np.concatenate(motions)
    return result
