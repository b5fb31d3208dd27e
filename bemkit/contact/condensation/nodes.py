"""The displacement nodes on a contact boundary, what is known at each of them, and which of them keep two unknowns.

Where a law is frictionless no traction acts along the tangent, so that this displacement is eliminated with the rest of
the body and follows the unknowns. A few of these tangents are retained if normals, friction and supports alone would
leave the body free to move, or nearly so: what is eliminated has to be held.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.spaces import BoundarySpace, element_nodes
from bemkit.geometry.vectors import turned_left
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, Support, free_modes, supported

APPROACH_TOLERANCE = 1e-3
"""Cosine of the angle between the one direction in which a supported node can move and the direction of contact below
which contact there is left to the support: it would have to slide a thousand times as far as it closes the gap."""
LEAST_RETAINED_SHARE = 0.03
"""A rigid motion whose share in the retained directions is less than this is held too weakly by them: eliminating the
rest then loses the square of it in digits."""
RANK_TOLERANCE = 1e-9
"""A combination of motions that moves the contact nodes by less than this share of the others moves none of them."""


@dataclass(frozen=True, eq=False)
class ContactNodes:
    """Displacement nodes that may touch an obstacle.

    A node in a corner between two frictionless obstacles stands in two rows, one for each direction of contact. Both
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

    @cached_property
    def is_second(self) -> BoolArray:
        """(n_contact,) bool: the second rows of nodes that stand in two."""
        repeated = np.ones(self.nodes.size, bool)
        repeated[np.unique(self.nodes, return_index=True)[1]] = False
        return repeated

    @cached_property
    def is_shared(self) -> BoolArray:
        """(n_contact,) bool: both rows of nodes that stand in two."""
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


def contact_conditions(
    space: BoundarySpace, supports: Sequence[Support], candidates: ContactNodes, driven: tuple[int, ...] = ()
) -> tuple[NodalConditions, ContactNodes]:
    """Find what is known at every node of a space: held by a support, retained for contact, or free.

    Parameters
    ----------
    space : BoundarySpace
        The displacement space.
    supports : sequence of Support
    candidates : ContactNodes
        Nodes that may touch, whatever holds them.
    driven : tuple of int
        Rigid motions that forces far away drive; see `NodalConditions`.

    Returns
    -------
    conditions : NodalConditions
        Their retained directions are the unknowns of the contact system, but for tangents that supports hold.
    contact : ContactNodes
        The candidates that can touch. The others are left to their supports, which let them move neither towards the
        obstacle nor away from it.

    Raises
    ------
    ConflictingSupportsError
        If supports contradict each other at a node.
    """
    conditions = replace(supported(space, supports), driven=driven)
    motion = np.where(conditions.is_fixed[candidates.nodes][:, :, None], 0.0, conditions.frame[candidates.nodes])
    approach = np.abs(np.einsum("nkc,nc->nk", motion, candidates.directions)).max(axis=1)
    contact = candidates.take(approach > APPROACH_TOLERANCE)
    has_tangent = ~contact.is_frictionless
    if not has_tangent.all():
        motions = free_motions(conditions, contact, space)
        has_tangent = retained_tangents(motions, contact.is_frictionless, bound_tangents(conditions, contact))
    return _opened(conditions, contact, has_tangent), contact


def held_nodes(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: the contact nodes that a support holds in one direction."""
    return np.asarray(np.any(conditions.is_fixed[contact.nodes], axis=1))


def bound_tangents(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: nodes without a tangential displacement of their own.

    A support holds it, or it is given by the displacements towards two obstacles.
    """
    return held_nodes(conditions, contact) | contact.is_shared


def _opened(conditions: NodalConditions, contact: ContactNodes, has_tangent: BoolArray) -> NodalConditions:
    """Open the directions of contact of the contact nodes, and the tangential ones of some, that no support fixes."""
    frame, is_retained = conditions.frame.copy(), conditions.is_retained.copy()
    unsupported = ~held_nodes(conditions, contact)
    is_first = unsupported & ~contact.is_second
    frame[contact.nodes[is_first]] = contact.frame[is_first]
    is_retained[contact.nodes] = ~conditions.is_fixed[contact.nodes]
    is_retained[contact.nodes[unsupported & ~has_tangent & ~contact.is_shared], 1] = False
    return replace(conditions, frame=frame, is_retained=is_retained)


def free_motions(conditions: NodalConditions, contact: ContactNodes, space: BoundarySpace) -> FloatArray:
    """Return the rigid motions (n_motions, n_contact, 2) that no support resists, in (n, t) components.

    Bound tangential components are zero. An exterior, at rest far away, has none of these motions.
    """
    return at_contact(free_modes(space, conditions), conditions, contact)


def at_contact(modes: FloatArray, conditions: NodalConditions, contact: ContactNodes) -> FloatArray:
    """Return motions (n_motions, n_contact, 2) in (n, t) components from those of all nodes; see `free_motions`."""
    motions: FloatArray = np.einsum("nkc,jnc->jnk", contact.frame, modes[:, contact.nodes])
    motions[:, bound_tangents(conditions, contact), 1] = 0.0
    return motions


def find_tangents(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact,) bool: where the tangential displacement is eliminated, and follows the unknowns.

    That is at nodes without friction, but for the few that are retained, wherever a support holds the node (what acts
    there along the tangent cannot be told from the reaction of the support), and between two obstacles.
    """
    return np.asarray(~np.all(conditions.is_retained[contact.nodes], axis=1)) | contact.is_shared


def unknown_directions(conditions: NodalConditions, contact: ContactNodes) -> BoolArray:
    """Return (n_contact, 2) bool: which direction of the frame of its node makes each unknown.

    Of a node that stands in two rows the first direction belongs to the first row, the second one to the other.
    """
    is_unknown = conditions.is_retained[contact.nodes]
    is_unknown[contact.is_shared, 1] = False
    is_unknown[contact.is_second] = (False, True)
    return is_unknown


def retained_tangents(motions: FloatArray, is_frictionless: BoolArray, is_bound: BoolArray) -> BoolArray:
    """Return (n_contact,) bool: the contact nodes whose tangential displacement is an unknown.

    These are all nodes with friction, and at most as many others as there are `motions` (n_motions, n_contact, 2) that
    no support holds, in (n, t) components of any size. Nodes that a support holds have no tangent of their own.
    """
    is_retained = ~is_frictionless
    if not motions.size or is_retained.all():
        return is_retained
    motions = _of_unit_size(motions)
    normal, tangential = motions[:, :, 0].T, motions[:, :, 1].T  # (n_contact, n_motions)
    held = np.concatenate([normal, tangential[is_retained & ~is_bound]])
    _, singular, directions = np.linalg.svd(np.linalg.qr(held, mode="r"), full_matrices=True)
    sizes = np.zeros(len(motions))
    sizes[: singular.size] = singular
    weak = directions[sizes < LEAST_RETAINED_SHARE * np.sqrt(len(held))]
    along = np.where((is_frictionless & ~is_bound)[:, None], tangential @ weak.T, 0.0)
    for _ in weak:  # the tangents that feel most of what is still free
        sizes = np.linalg.norm(along, axis=1)
        if sizes.max(initial=0.0) < LEAST_RETAINED_SHARE:
            break
        node = int(np.argmax(sizes))
        is_retained[node] = True
        unit = along[node] / sizes[node]
        along = along - np.outer(along @ unit, unit)
    return is_retained


def _of_unit_size(motions: FloatArray) -> FloatArray:
    """Return motions that span the same, orthogonal and of mean size one at the contact nodes.

    Of a body that touches along a small part of its boundary all rotations are nearly translations there.
    """
    columns = motions.reshape(len(motions), -1).T
    basis, sizes, _ = np.linalg.svd(columns, full_matrices=False)
    basis = basis[:, sizes > RANK_TOLERANCE * sizes[0]]
    return np.asarray(np.sqrt(motions.shape[1]) * basis.T.reshape(-1, *motions.shape[1:]))
