"""From an elastic body with supports and loads to the `LinearBody` that the contact drivers see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.conditions import LinearConditions
from bemkit.contact.dense import FORGIVEN, DenseBody
from bemkit.geometry.space import dof_points, dof_weights
from bemkit.operators.nodal import NodalConditions, Support, supported
from bemkit.operators.rigid import rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare

HELD = 1e-9
"""A rigid motion that moves the supports by less than this, relative to its size, is free of them."""


class NoContactNodesError(ValueError):
    """A contact boundary whose nodes are all held by supports."""


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


def contact_nodes(elastic: SteklovPoincare, elements: IntArray, conditions: NodalConditions) -> ContactNodes:
    """Find the nodes of some contact elements that can move towards the obstacle.

    Parameters
    ----------
    elastic : SteklovPoincare
    elements : (m,) array
        Contact elements in order along the boundary.
    conditions : NodalConditions
        The supports; a node whose normal direction is prescribed cannot come into contact and is left to its support.

    Returns
    -------
    ContactNodes
        Normals are averaged over the contact elements that meet at a node.
    """
    space = elastic.displacement_space
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


@dataclass(frozen=True, eq=False)
class CondensedBody:
    """An elastic body seen from its contact nodes; fulfils `LinearBody`.

    Parameters
    ----------
    dense : DenseBody
        The condensed stiffness in (n, t) components.
    condensed : CondensedMap
        The same in open directions, with the way back to the whole boundary.
    to_open, offset : (n_open, 2 n_contact) array [-], (n_open,) array [m]
        Displacements of the open directions from those of the contact nodes.
    points : (n_nodes, 2) array [m]
        Where the nodal forces act.
    conditions : NodalConditions
        Of the displacement nodes, the contact nodes open.
    nodes : ContactNodes
    is_exterior : bool
        Whether the body is infinite: it is at rest far away, so that its boundary may carry a resultant.

    Notes
    -----
    At a node where a support prescribes one direction (a roller meets the contact boundary) only the other one is
    open. Its normal motion and pressure are true; the friction there is left to the support, and the tangential
    component is a decoupled spring without load, which rests.
    """

    dense: DenseBody
    condensed: CondensedMap
    to_open: FloatArray
    offset: FloatArray
    points: FloatArray
    conditions: NodalConditions
    nodes: ContactNodes
    is_exterior: bool = False

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return self.dense.n_contact

    @property
    def weights(self) -> FloatArray:
        """(n_contact,) array [m]."""
        return self.dense.weights

    @property
    def stiffness_scale(self) -> float:
        """Typical traction per displacement of one contact node [Pa/m]."""
        return self.dense.stiffness_scale

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return displacement and traction under two conditions per contact node."""
        return self.dense.respond(conditions)

    def rigid_motions(self) -> FloatArray:
        """Return the motions that only contact can hold."""
        return self.dense.rigid_motions()

    def rigid_load(self) -> FloatArray:
        """Return the work of the load on each of these motions."""
        return self.dense.rigid_load()

    def under(self, displacement: FloatArray, force: FloatArray) -> CondensedBody:
        """Return the same body under another load, without another factorisation.

        Parameters
        ----------
        displacement : (n_nodes, 2) array [m]
            Prescribed displacements in the frames of the nodes, as in `NodalConditions`.
        force : (n_nodes, 2) array [N/m]
            Given nodal forces.

        Returns
        -------
        CondensedBody
        """
        conditions = replace(self.conditions, displacement=displacement)
        condensed = self.condensed.under(force, displacement)
        _, offset = _open_directions(conditions, self.nodes)
        load = self.to_open.T @ (condensed.load - condensed.stiffness @ offset)
        dense = replace(self.dense, load=load)
        return replace(self, dense=dense, condensed=condensed, offset=offset, conditions=conditions)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.condensed.recover(self.to_open @ state.displacement.ravel() + self.offset)

    def imbalance(self, state: ContactState) -> tuple[float, float]:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium of forces and moments.

        The first number also covers the residual of the contact nodes themselves; see `DenseBody.imbalance`. What may
        be round-off of the forces, which in thin bodies are small differences of large terms, does not count.
        """
        displacement, force = self.recover(state)
        residual, work = self.dense.imbalance(state)
        total = float(np.abs(force).sum())
        if self.is_exterior or total == 0.0:
            return residual, work
        centre = self.points.mean(axis=0)
        arm = self.points - centre
        size = float(np.abs(arm).max())
        moment = abs(float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0])))
        resultant = float(np.abs(force.sum(axis=0)).max())
        round_off = min(self._round_off(displacement), FORGIVEN * total)
        force_imbalance, moment_imbalance = resultant - round_off, moment / size - round_off
        return max(residual, force_imbalance / total), max(work, moment_imbalance / total)

    def _round_off(self, displacement: FloatArray) -> float:
        sensitivity = self.condensed.sensitivity
        if sensitivity is None:
            return 0.0
        return float(np.finfo(float).eps * np.sum(sensitivity * np.abs(displacement)))


def condense(
    elastic: SteklovPoincare, supports: Sequence[Support], contact_elements: IntArray, force: FloatArray
) -> tuple[CondensedBody, ContactNodes]:
    """Reduce a body to its contact boundary.

    Parameters
    ----------
    elastic : SteklovPoincare
    supports : sequence of Support
    contact_elements : (m,) array
        Elements that may touch an obstacle, in order.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces.

    Returns
    -------
    body : CondensedBody
    nodes : ContactNodes

    Raises
    ------
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    ConflictingSupportsError
        If supports contradict each other at a node.
    SingularMatrixError
        If even glued contact does not hold the body.
    """
    space = elastic.displacement_space
    conditions = supported(space, supports)
    contact = contact_nodes(elastic, contact_elements, conditions)
    conditions = _opened(conditions, contact)
    condensed = elastic.condense(conditions, force)
    if not contact.nodes.size:
        raise NoContactNodesError(
            "supports fix every node of the contact boundary: use more elements, or restrict the supports"
        )
    to_open, offset = _open_directions(conditions, contact)
    stiffness = to_open.T @ condensed.stiffness @ to_open
    load = to_open.T @ (condensed.load - condensed.stiffness @ offset)
    idle = np.flatnonzero(~to_open.any(axis=0))
    diagonal = np.diagonal(stiffness)
    is_stiff = diagonal > 0.0
    stiffness[idle, idle] = np.median(diagonal[is_stiff]) if is_stiff.any() else 1.0
    points = dof_points(space)
    motions = _free_motions(conditions, contact, points)[: 0 if space.mesh.is_exterior else None]
    motions.reshape(len(motions), 2 * contact.nodes.size)[:, idle] = 0.0
    dense = DenseBody(stiffness, load, contact.weights, motions)
    body = CondensedBody(dense, condensed, to_open, offset, points, conditions, contact, space.mesh.is_exterior)
    return body, contact


def _opened(conditions: NodalConditions, contact: ContactNodes) -> NodalConditions:
    """Open the directions of the contact nodes that no support fixes."""
    frame, is_open = conditions.frame.copy(), conditions.is_open.copy()
    unsupported = ~conditions.is_fixed[contact.nodes].any(axis=1)
    frame[contact.nodes[unsupported]] = contact.frame[unsupported]
    is_open[contact.nodes] = ~conditions.is_fixed[contact.nodes]
    return replace(conditions, frame=frame, is_open=is_open)


def _open_directions(conditions: NodalConditions, contact: ContactNodes) -> tuple[FloatArray, FloatArray]:
    """Return the map from (n, t) displacements of the contact nodes to the open directions, and its constant part."""
    number = np.full(conditions.is_open.size, -1)
    number[np.flatnonzero(conditions.is_open)] = np.arange(int(conditions.is_open.sum()))
    number = number.reshape(-1, 2)[contact.nodes]
    matrix, offset = (
        np.zeros((int(conditions.is_open.sum()), 2 * contact.nodes.size)),
        np.zeros(int(conditions.is_open.sum())),
    )
    whole = np.flatnonzero(np.all(number >= 0, axis=1))
    for component in range(2):
        matrix[number[whole, component], 2 * whole + component] = 1.0
    for k in np.flatnonzero(np.any(number < 0, axis=1)):  # a handful: nodes where a support meets the contact boundary
        node = contact.nodes[k]
        free = int(np.argmax(number[k]))
        along = conditions.frame[node] @ contact.normals[k]
        matrix[number[k, free], 2 * k] = 1.0 / along[free]
        offset[number[k, free]] = -along[1 - free] * conditions.displacement[node, 1 - free] / along[free]
    return matrix, offset


def _free_motions(conditions: NodalConditions, contact: ContactNodes, points: FloatArray) -> FloatArray:
    """Return the rigid motions (n_motions, n_contact, 2) that no support resists, in (n, t) components."""
    centre = 0.5 * (points.min(axis=0) + points.max(axis=0))
    size = float(np.ptp(points, axis=0).max())
    motions = rigid_motions(points, centre, size)
    fixed = np.einsum("nkc,ncm->nkm", conditions.frame, motions)[conditions.is_fixed]
    if fixed.shape[0]:
        _, singular, directions = np.linalg.svd(fixed, full_matrices=True)
        size_of = np.zeros(3)
        size_of[: singular.size] = singular
        free = directions[size_of < HELD * np.sqrt(fixed.shape[0])]
    else:
        free = np.eye(3)
    at_contact: FloatArray = np.einsum("nkc,ncm,jm->jnk", contact.frame, motions[contact.nodes], free)
    return at_contact
