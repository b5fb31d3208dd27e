"""Contact nodes of a body: conditions of supports and obstacles there, and how they follow its displacements."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.dense_body import FollowingTangents
from bemkit.errors import InputError
from bemkit.geometry.spaces import BoundarySpace, element_nodes
from bemkit.geometry.vectors import turned_left
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes

APPROACH_TOLERANCE = 1e-3
"""Least cosine of the angle between the direction in which a supported node can move and the direction of contact.
Below it the node would slide a thousand times as far as it closes the gap, and takes no part in contact."""
_ROUND_OFF = 1e-6
"""Largest share that is round-off and removed; the certificate measures a larger one."""


class NoContactNodesError(InputError):
    """A contact boundary whose nodes are all held by supports."""

    def __init__(self) -> None:
        super().__init__("supports fix every node of the contact boundary: use more elements, or restrict the supports")


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """Displacement nodes that may touch an obstacle.

    A node in a corner between two frictionless obstacles has two rows, one for each direction of contact. Both
    displacements are unknowns; their tangents follow.

    Parameters
    ----------
    nodes : (n_contact,) array
        Scalar dofs of the displacement space, in order along each contact part.
    points : (n_contact, 2) array [m]
    frame : (n_contact, 2, 2) array
        Rows are the direction of contact d (into the obstacle, see `bemkit.contact.obstacle`) and the tangent
        ``(-d_y, d_x)``. Where contact acts along the body's normal these are the outward normal and the tangent.
    weights : (n_contact,) array [m]
        Length of boundary that belongs to each node.
    """

    nodes: IntArray
    points: FloatArray
    frame: FloatArray
    weights: FloatArray

    @property
    def directions(self) -> FloatArray:
        """(n_contact, 2) unit vectors: the directions of contact, of u_n and of sigma_n."""
        return self.frame[:, 0]

    @cached_property
    def is_second(self) -> BoolArray:
        """(n_contact,) bool: the second rows of nodes with two."""
        repeated = np.ones(self.nodes.size, bool)
        repeated[np.unique(self.nodes, return_index=True)[1]] = False
        return repeated

    @cached_property
    def is_shared(self) -> BoolArray:
        """(n_contact,) bool: both rows of nodes with two."""
        return np.isin(self.nodes, self.nodes[self.is_second])

    def forces(self, traction: FloatArray, n_nodes: int) -> FloatArray:
        """Return the forces (n_nodes, 2) [N/m] of tractions (n_contact, 2) [Pa] in (n, t) components, in x and y."""
        forces = np.zeros((n_nodes, 2))
        np.add.at(forces, self.nodes, self.weights[:, None] * np.einsum("nk,nkc->nc", traction, self.frame))
        return forces

    def take(self, rows: IntArray | BoolArray) -> ContactNodes:
        """Return some of the nodes."""
        return ContactNodes(*(getattr(self, column.name)[rows] for column in fields(self)))


def contact_frame(directions: FloatArray) -> FloatArray:
    """Return the frames (n, 2, 2) of directions of contact (n, 2); see `ContactNodes`."""
    return np.stack([directions, turned_left(directions)], axis=1)


def nodes_on(space: BoundarySpace, elements: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the nodes (n,) of some elements (m,) in their order, as scalar dofs, and the outward unit normals (n, 2).

    Normals are averaged over those of the elements that meet at a node.
    """
    dofs = space.element_dofs[elements]
    order = dofs.ravel()[np.sort(np.unique(dofs.ravel(), return_index=True)[1])]
    local_normals = space.mesh.normals_at(elements, element_nodes(space)[elements])
    normals = np.zeros((space.n_dofs // 2, 2))
    np.add.at(normals, dofs, local_normals * space.mesh.lengths[elements][:, None, None])
    normals /= np.maximum(np.hypot(*normals.T), np.finfo(float).tiny)[:, None]
    return order, normals[order]


def approaches(nodes: IntArray, directions: FloatArray, conditions: NodalConditions) -> BoolArray:
    """Return (n,) bool: nodes that their supports let move along directions (n, 2) of contact.

    The others are left to their supports, which let them move neither towards the obstacle nor away from it.
    """
    free = np.where(conditions.is_fixed[nodes][:, :, None], 0.0, conditions.frame[nodes])
    return np.asarray(np.abs(np.einsum("nkc,nc->nk", free, directions)).max(axis=1) > APPROACH_TOLERANCE)


def held_nodes(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: the contact nodes that a support holds in one direction."""
    return np.asarray(np.any(conditions.is_fixed[contact.nodes], axis=1))


def opened(conditions: NodalConditions, contact: ContactNodes) -> NodalConditions:
    """Turn the frames of contact nodes into the directions of contact, and retain what no support fixes there.

    The frame of a node is that of contact, unless a support or the first of two obstacles has given it another one.
    """
    frame, is_retained = conditions.frame.copy(), conditions.is_retained.copy()
    is_own = ~held_nodes(conditions, contact) & ~contact.is_second
    frame[contact.nodes[is_own]] = contact.frame[is_own]
    is_retained[contact.nodes] = ~conditions.is_fixed[contact.nodes]
    return replace(conditions, frame=frame, is_retained=is_retained)


def free_motions(conditions: NodalConditions, contact: ContactNodes, space: BoundarySpace) -> FloatArray:
    """Return the rigid motions (n_motions, n_contact, 2) that no support resists, in (n, t) components.

    An exterior, at rest far away, has none of these motions.
    """
    motions: FloatArray = np.einsum("nkc,jnc->jnk", contact.frame, free_modes(space, conditions)[:, contact.nodes])
    return motions


@dataclass(frozen=True, eq=False)
class NodeCoupling:
    """How retained displacements u move contact nodes that lie at nodes of one body: ``w = B u + offset``.

    Parameters
    ----------
    columns : (n_contact, 2) int array
        The retained directions of the node of the body, the same in both rows of a node between two obstacles; -1 for
        a direction that a support holds.
    blocks : (n_contact, 2, 2) array
        Entries of B, axes (node, component, direction); zero where there is no direction.
    n_pressures : int
        Pressures that are retained; they are the last unknowns on both sides.

    Notes
    -----
    The stiffness of the relative displacements w is ``R^T K R``, without any flexibility; R has two entries in a column
    at most. The unknowns are the normal displacements of all contact nodes, and the tangential ones of nodes that are
    free: not where a support holds one direction, nor between two obstacles, whose normal displacements give both
    tangents.
    """

    columns: IntArray
    blocks: FloatArray
    n_pressures: int = 0

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes, n_pressures: int) -> NodeCoupling:
        """Return the coupling of contact nodes to the retained directions of the conditions."""
        is_retained = conditions.is_retained
        number = np.where(is_retained, np.cumsum(is_retained).reshape(is_retained.shape) - 1, -1)
        columns = number[contact.nodes]
        blocks = np.einsum("nkc,njc->nkj", contact.frame, conditions.frame[contact.nodes])
        return cls(columns, np.where(columns[:, None] >= 0, blocks, 0.0), n_pressures)

    @cached_property
    def partner(self) -> IntArray:
        """(n_contact,) array: the other row of a node between two obstacles; itself elsewhere."""
        key, node = self.columns.max(axis=1), np.arange(len(self.columns))
        first = np.full(int(key.max()) + 1, -1)
        last = first.copy()
        last[key] = node
        first[key[::-1]] = node[::-1]
        return np.asarray(np.where(first[key] == node, last[key], first[key]))

    @cached_property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array."""
        return np.asarray((self.columns < 0).any(axis=1) | (self.partner != np.arange(len(self.columns))))

    @cached_property
    def unknown_dofs(self) -> IntArray:
        """(n_unknowns,) array: the indices ``2 node + component`` of the unknowns, ascending."""
        is_unknown = np.ones((len(self.columns), 2), bool)
        is_unknown[self.tangent_follows, 1] = False
        return np.flatnonzero(is_unknown)

    @cached_property
    def inverse(self) -> tuple[IntArray, FloatArray]:
        """R by columns: the retained directions (n_unknowns, 2) that move with each unknown, and by how much.

        Notes
        -----
        Of each node of the body the rows of its unknowns make a block of 2 x 2: normal and tangent of a free node, both
        normals between two obstacles, one normal and the direction that is held where there is a support.
        """
        node, component = np.divmod(self.unknown_dofs, 2)
        partner, columns = self.partner[node], self.columns[node]
        own = self.blocks[node, component]
        other = np.where((partner == node)[:, None], self.blocks[node, 1 - component], self.blocks[partner, 0])
        is_held = (columns < 0).any(axis=1)
        other[is_held] = np.where(columns[is_held] < 0, 1.0, 0.0)
        # the first column of the inverse of [own, other]
        determinant = own[:, 0] * other[:, 1] - own[:, 1] * other[:, 0]
        values = np.stack([other[:, 1], -other[:, 0]], axis=1) / determinant[:, None]
        return np.maximum(columns, 0), np.where(columns < 0, 0.0, values)

    def on_unknowns(self, forces: FloatArray) -> FloatArray:
        """Return ``R^T f`` (n_unknowns, ...) of forces (n_retained, ...) along the retained directions."""
        index, value = self.inverse
        parts = [(value[:, k] * forces[index[:, k]].T).T for k in (0, 1)]
        return np.concatenate([parts[0] + parts[1], forces[len(value) :]])

    def retained(self, unknowns: FloatArray) -> FloatArray:
        """Return ``R w`` (n_retained,) of the unknown relative displacements (n_unknowns,) without offset."""
        index, value = self.inverse
        displacements, pressures = np.split(unknowns, [len(value)])
        amounts = (value * displacements[:, None]).ravel()
        return np.append(np.bincount(index.ravel(), amounts, minlength=len(value)), pressures)

    def moved(self, retained: FloatArray) -> FloatArray:
        """Return ``B u`` (..., n_contact, 2) of retained displacements (..., n_retained)."""
        moved: FloatArray = np.einsum("nkj,...nj->...nk", self.blocks, retained[..., self.columns])
        return moved

    @cached_property
    def follow(self) -> FloatArray:
        """(n_following, n_unknowns) array: the tangents that follow, by the unknowns."""
        node = np.flatnonzero(self.tangent_follows)
        position = np.full((len(self.columns), 2), -1)
        position.flat[self.unknown_dofs] = np.arange(self.unknown_dofs.size)
        response, each = np.zeros((node.size, self.unknown_dofs.size + self.n_pressures)), np.arange(node.size)
        _, value = self.inverse
        for rows in (node, self.partner[node]):
            unknown = position[rows, 0]
            response[each, unknown] = np.sum(self.blocks[node, 1] * value[unknown], axis=1)
        return response

    def following(self, offset: FloatArray) -> FollowingTangents | None:
        """Return how tangents follow from the unknowns under an offset (2 n_contact,) [m], None if there are none."""
        nodes = np.flatnonzero(self.tangent_follows)
        if not nodes.size:
            return None
        at_rest = offset[2 * nodes + 1] - self.follow[:, : self.unknown_dofs.size] @ offset[self.unknown_dofs]
        return FollowingTangents(nodes, self.follow, at_rest)

    def stiffness(self, of_body: FloatArray, motions: FloatArray) -> FloatArray:
        """Return ``R^T K R`` (n_unknowns, n_unknowns) of the stiffness (n_retained, n_retained) of the body.

        It resists none of the rigid motions (n_motions, n_contact, 2) of the contact nodes; see `resisting_none`.
        """
        of_unknowns = motions.reshape(-1, 2 * len(self.columns))[:, self.unknown_dofs]
        of_unknowns = np.pad(of_unknowns, ((0, 0), (0, self.n_pressures)))
        return resisting_none(self.on_unknowns(self.on_unknowns(of_body.T).T), of_unknowns)

    def load(self, of_body: FloatArray, stiffness: FloatArray, offset: FloatArray) -> FloatArray:
        """Return the load (n_unknowns,) ``K_w o + R^T f`` of that on the body under an offset (2 n_contact,) [m]."""
        return self.on_unknowns(of_body) + stiffness[:, : self.unknown_dofs.size] @ offset[self.unknown_dofs]


def resisting_none(stiffness: FloatArray, motions: FloatArray) -> FloatArray:
    """Return a stiffness (n, n) that maps motions (n_motions, n) to no force, and makes no force that works on them.

    Notes
    -----
    A body that supports leave free to move resists no rigid motion, and its load does on it the work of all given
    forces (`with_work`). Elimination fulfils both only to the round-off of the forces on the whole body. A contact much
    smaller than the body, such as a pin in a plate, has short lever arms, so that the same round-off would be a large
    force that turns the body.
    """
    if not len(motions):
        return stiffness
    basis = np.linalg.qr(motions.T)[0]
    forces, works = stiffness @ basis, basis.T @ stiffness
    if max(np.abs(forces).max(), np.abs(works).max()) > _ROUND_OFF * np.abs(stiffness).max():
        return stiffness
    result: FloatArray = stiffness - forces @ basis.T - basis @ (works - (works @ basis) @ basis.T)
    return result


def with_work(load: FloatArray, motions: FloatArray, work: FloatArray, size: float) -> FloatArray:
    """Return a load (n,) that does a given work (n_motions,) on motions (n_motions, n).

    Parameters
    ----------
    load, motions, work : arrays
        The forces that are added are the least ones.
    size : float [N/m]
        Sum of the sizes of all given forces.
    """
    missing = work - motions @ load
    if not len(missing) or np.abs(missing).max() > _ROUND_OFF * size:
        return load
    return np.asarray(load + np.linalg.lstsq(motions, missing, rcond=None)[0])
