"""The displacement nodes on a contact boundary, and what is known at each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.condensation.tangents import open_tangents
from bemkit.geometry.spaces import BoundarySpace, dof_points, dof_weights
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, Support, supported, unsupported_motions

CAN_TOUCH = 1e-3
"""Cosine of the angle between the one direction in which a supported node can move and the direction of contact below
which contact there is left to the support: it would have to slide a thousand times as far as it closes the gap."""


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """Displacement nodes that may touch an obstacle.

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
    is_frictionless : (n_contact,) bool array
        Nodes whose friction law knows no friction.
    """

    nodes: IntArray
    points: FloatArray
    frame: FloatArray
    weights: FloatArray
    is_frictionless: BoolArray

    @property
    def directions(self) -> FloatArray:
        """(n_contact, 2) unit vectors: the directions of contact, of u_n and of sigma_n."""
        return self.frame[:, 0]

    def take(self, rows: IntArray | BoolArray) -> ContactNodes:
        """Return some of the nodes."""
        return ContactNodes(*(column[rows] for column in vars(self).values()))


def contact_frame(directions: FloatArray) -> FloatArray:
    """Return the frames (n, 2, 2) of directions of contact (n, 2); see `ContactNodes`."""
    return np.stack([directions, np.stack([-directions[:, 1], directions[:, 0]], axis=1)], axis=1)


def nodes_on(space: BoundarySpace, elements: IntArray) -> tuple[IntArray, FloatArray]:
    """Return the nodes of some elements in their order, and the outward normals there.

    Parameters
    ----------
    space : BoundarySpace
    elements : (m,) array

    Returns
    -------
    nodes : (n,) array
        Scalar dofs.
    normals : (n, 2) array
        Unit normals, averaged over those of the elements that meet at a node.
    """
    dofs = space.element_dofs[elements]
    order = dofs.ravel()[np.sort(np.unique(dofs.ravel(), return_index=True)[1])]
    local_normals = space.mesh.normals_at(elements, space.local_nodes)
    normals = np.zeros((space.n_dofs // 2, 2))
    np.add.at(normals, dofs, local_normals * space.mesh.lengths[elements][:, None, None])
    normals /= np.maximum(np.hypot(*normals.T), np.finfo(float).tiny)[:, None]
    return order, normals[order]


def contact_along_normals(space: BoundarySpace, elements: IntArray, *, is_frictionless: bool = False) -> ContactNodes:
    """Return the nodes of some elements, contact acting along the body's normals.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    elements : (m,) array
        Contact elements in order along the boundary.
    is_frictionless : bool
        Of all nodes.

    Returns
    -------
    ContactNodes
    """
    nodes, normals = nodes_on(space, elements)
    weights = dof_weights(space, elements)[nodes]
    law = np.full(nodes.size, is_frictionless)
    return ContactNodes(nodes, dof_points(space)[nodes], contact_frame(normals), weights, law)


def contact_conditions(
    space: BoundarySpace, supports: Sequence[Support], candidates: ContactNodes
) -> tuple[NodalConditions, ContactNodes]:
    """Find what is known at every node of a space: held by a support, open to contact, or free.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    supports : sequence of Support
    candidates : ContactNodes
        Nodes that may touch, whatever holds them.

    Returns
    -------
    conditions : NodalConditions
        Their open directions are the unknowns of the contact system, but for tangents that supports hold.
    contact : ContactNodes
        The candidates that can touch. The others are left to their supports, which let them move neither towards the
        obstacle nor away from it.

    Raises
    ------
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    conditions = supported(space, supports)
    motion = np.where(conditions.is_fixed[candidates.nodes][:, :, None], 0.0, conditions.frame[candidates.nodes])
    can_touch: BoolArray = np.abs(np.einsum("nkc,nc->nk", motion, candidates.directions)).max(axis=1) > CAN_TOUCH
    contact = candidates.take(can_touch)
    is_supported = held_nodes(conditions, contact)
    motions = free_motions(conditions, contact, space)
    has_tangent = open_tangents(motions, contact.is_frictionless, is_supported)
    return _opened(conditions, contact, has_tangent), contact


def held_nodes(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: the contact nodes that a support holds in one direction."""
    return np.asarray(np.any(conditions.is_fixed[contact.nodes], axis=1))


def _opened(conditions: NodalConditions, contact: ContactNodes, has_tangent: BoolArray) -> NodalConditions:
    """Open the directions of contact of the contact nodes, and the tangential ones of some, that no support fixes."""
    frame, is_open = conditions.frame.copy(), conditions.is_open.copy()
    unsupported = ~held_nodes(conditions, contact)
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
    at_contact[:, held_nodes(conditions, contact), 1] = 0.0
    return at_contact
