"""The displacement nodes on a contact boundary, and what is known at each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.tangents import open_tangents
from bemkit.geometry.space import BoundarySpace, dof_points, dof_weights
from bemkit.operators.nodal import NodalConditions, Support, supported, unsupported_motions


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """The displacement nodes on the contact boundary.

    Parameters
    ----------
    nodes : (n_contact,) array
        Scalar dofs of the displacement space, in order along each contact part.
    points : (n_contact, 2) array [m]
    frame : (n_contact, 2, 2) array
        Rows are the outward normal and the tangent.
    weights : (n_contact,) array [m]
        Length of boundary that belongs to each node.
    """

    nodes: IntArray
    points: FloatArray
    frame: FloatArray
    weights: FloatArray

    @property
    def normals(self) -> FloatArray:
        """(n_contact, 2) outward unit normals."""
        return self.frame[:, 0]


def contact_nodes(space: BoundarySpace, elements: IntArray, conditions: NodalConditions) -> ContactNodes:
    """Find the nodes of some contact elements that can move towards the obstacle.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    elements : (m,) array
        Contact elements in order along the boundary.
    conditions : NodalConditions
        The supports; a node whose normal direction is prescribed cannot come into contact and is left to its support.

    Returns
    -------
    ContactNodes
        Normals are averaged over the contact elements that meet at a node.
    """
    dofs = space.element_dofs[elements]
    order = dofs.ravel()[np.sort(np.unique(dofs.ravel(), return_index=True)[1])]
    local_normals = space.mesh.normals_at(elements, space.local_nodes)
    normals = np.zeros((space.n_dofs // 2, 2))
    np.add.at(normals, dofs, local_normals * space.mesh.lengths[elements][:, None, None])
    normals /= np.maximum(np.hypot(*normals.T), np.finfo(float).tiny)[:, None]
    n = normals[order]
    motion = np.where(conditions.is_fixed[order][:, :, None], 0.0, conditions.frame[order])
    can_touch = np.abs(np.einsum("nkc,nc->nk", motion, n)).max(axis=1) > 1e-6
    order, n = order[can_touch], n[can_touch]
    frame = np.stack([n, np.stack([-n[:, 1], n[:, 0]], axis=1)], axis=1)
    return ContactNodes(order, dof_points(space)[order], frame, dof_weights(space, elements)[order])


def contact_conditions(
    space: BoundarySpace,
    supports: Sequence[Support],
    contact_elements: IntArray,
    is_frictionless: BoolArray | None = None,
) -> tuple[NodalConditions, ContactNodes]:
    """Find what is known at every node of a space: held by a support, open to contact, or free.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    supports : sequence of Support
    contact_elements : (m,) array
        Elements that may touch an obstacle, in order.
    is_frictionless : (n_nodes,) bool array, optional
        Nodes whose law is frictionless. None by default.

    Returns
    -------
    conditions : NodalConditions
        Their open directions are the unknowns of the contact system, but for tangents that supports hold.
    nodes : ContactNodes

    Raises
    ------
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    conditions = supported(space, supports)
    contact = contact_nodes(space, contact_elements, conditions)
    has_tangent = np.ones(contact.nodes.size, bool)
    if is_frictionless is not None and contact.nodes.size:
        is_supported: BoolArray = np.any(conditions.is_fixed[contact.nodes], axis=1)
        motions = free_motions(conditions, contact, space)
        has_tangent = open_tangents(motions, is_frictionless[contact.nodes], is_supported)
    return _opened(conditions, contact, has_tangent), contact


def _opened(conditions: NodalConditions, contact: ContactNodes, has_tangent: BoolArray) -> NodalConditions:
    """Open the normal directions of the contact nodes, and the tangential ones of some, that no support fixes."""
    frame, is_open = conditions.frame.copy(), conditions.is_open.copy()
    unsupported = ~conditions.is_fixed[contact.nodes].any(axis=1)
    frame[contact.nodes[unsupported]] = contact.frame[unsupported]
    is_open[contact.nodes] = ~conditions.is_fixed[contact.nodes]
    is_open[contact.nodes[unsupported & ~has_tangent], 1] = False
    return replace(conditions, frame=frame, is_open=is_open)


def free_motions(conditions: NodalConditions, contact: ContactNodes, space: BoundarySpace) -> FloatArray:
    """Return the rigid motions (n_motions, n_contact, 2) that no support resists, in (n, t) components.

    Tangential components that a support holds are zero. An exterior, at rest far away, has none of these motions.
    """
    motions = unsupported_motions(space, conditions)[:, contact.nodes]
    at_contact: FloatArray = np.einsum("nkc,jnc->jnk", contact.frame, motions)
    at_contact[:, conditions.is_fixed[contact.nodes].any(axis=1), 1] = 0.0
    return at_contact
