"""The displacement nodes on a contact boundary, with the conditions of supports and obstacles at each."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.geometry.spaces import BoundarySpace, element_nodes
from bemkit.geometry.vectors import turned_left
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes

APPROACH_TOLERANCE = 1e-3
"""Least cosine of the angle between the direction in which a supported node can move and the direction of contact.
Below it the node would slide a thousand times as far as it closes the gap, and takes no part in contact."""


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
