"""One body between obstacles: relative displacements of its contact nodes determine its retained displacements.

The stiffness of the relative displacements w is then ``R^T K R``, without any flexibility, and R has two entries in a
column at most. See `bemkit.contact.joined` for bodies that touch each other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation.dense_body import DenseBody, FollowingTangents
from bemkit.contact.condensation.exact_motions import resisting_none
from bemkit.contact.condensation.nodes import ContactNodes, NoContactNodesError
from bemkit.contact.condensation.whole_body import WholeBody
from bemkit.operators.counts import OperationCounts
from bemkit.operators.equilibrium import Imbalance
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions


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

    Notes
    -----
    The unknowns are the normal displacements of all contact nodes, and the tangential ones of nodes that are free: not
    where a support holds one direction, nor between two obstacles, whose normal displacements give both tangents.
    """

    columns: IntArray
    blocks: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes) -> NodeCoupling:
        """Return the coupling of contact nodes to the retained directions of the conditions."""
        is_retained = conditions.is_retained
        number = np.where(is_retained, np.cumsum(is_retained).reshape(is_retained.shape) - 1, -1)
        columns = number[contact.nodes]
        blocks = np.einsum("nkc,njc->nkj", contact.frame, conditions.frame[contact.nodes])
        return cls(columns, np.where(columns[:, None] >= 0, blocks, 0.0))

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
        return np.asarray(parts[0] + parts[1])

    def retained(self, unknowns: FloatArray) -> FloatArray:
        """Return ``R w`` (n_retained,) of the unknown relative displacements (n_unknowns,) without offset."""
        index, value = self.inverse
        amounts = (value * unknowns[:, None]).ravel()
        return np.asarray(np.bincount(index.ravel(), amounts, minlength=unknowns.size), dtype=float)

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
        response, each = np.zeros((node.size, self.unknown_dofs.size)), np.arange(node.size)
        _, value = self.inverse
        for rows in (node, self.partner[node]):
            unknown = position[rows, 0]
            response[each, unknown] = np.sum(self.blocks[node, 1] * value[unknown], axis=1)
        return response


@dataclass(frozen=True, eq=False, kw_only=True)
class DirectBody(DenseBody):
    """An elastic body seen from its contact nodes, and the way back to its whole boundary.

    Parameters
    ----------
    whole : WholeBody
    coupling : NodeCoupling
    nodes : ContactNodes
    offset : (2 n_contact,) array [m]
        Relative displacements that supports prescribe.
    """

    whole: WholeBody
    coupling: NodeCoupling
    nodes: ContactNodes
    offset: FloatArray

    @classmethod
    def of(cls, whole: WholeBody, nodes: ContactNodes, modulus: float) -> DirectBody:
        """Return a body whose contact nodes are retained."""
        coupling = NodeCoupling.of(whole.conditions, nodes)
        motions = coupling.moved(whole.motions)
        of_unknowns = motions.reshape(len(motions), 2 * len(nodes.nodes))[:, coupling.unknown_dofs]
        stiffness = coupling.on_unknowns(coupling.on_unknowns(whole.stiffness.T).T)
        stiffness = resisting_none(stiffness, of_unknowns)
        offset = _prescribed(whole.conditions, nodes)
        return cls(
            stiffness=stiffness,
            load=_load(whole, coupling, stiffness, offset),
            weights=nodes.weights,
            motions=motions,
            following_tangents=_following(coupling, offset),
            modulus=modulus,
            whole=whole,
            coupling=coupling,
            nodes=nodes,
            offset=offset,
        )

    @property
    def condensed(self) -> CondensedMap:
        """The condensed map of the body."""
        return self.whole.condensed

    @property
    def conditions(self) -> NodalConditions:
        """Of the displacement nodes."""
        return self.whole.conditions

    @property
    def work(self) -> OperationCounts:
        """Operation counts from the operators on."""
        return self.whole.condensed.work + OperationCounts(contact_unknowns=self.n_unknowns)

    def under(self, displacement: FloatArray, force: FloatArray, inside: ForcesInside | None = None) -> DirectBody:
        """Return the same body under another load, without another factorisation; see `WholeBody.under`."""
        whole = self.whole.under(displacement, force, inside)
        offset = _prescribed(whole.conditions, self.nodes)
        return replace(
            self,
            whole=whole,
            offset=offset,
            load=_load(whole, self.coupling, self.stiffness, offset),
            following_tangents=_following(self.coupling, offset),
        )

    def retained(self, state: ContactState) -> FloatArray:
        """Return the retained displacements (n_retained,) [m] of a state."""
        return self.coupling.retained((state.displacement.ravel() - self.offset)[self.unknown_dofs])

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.whole.fields(self.retained(state))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium.

        The numbers also cover the contact nodes themselves; see `DenseBody.unbalanced`, `WholeBody.imbalance`.
        """
        return self.whole.imbalance(self.unbalanced(state), self.retained(state), self._column_sizes[1])


def _prescribed(conditions: NodalConditions, nodes: ContactNodes) -> FloatArray:
    """Return the relative displacements (2 n_contact,) that supports prescribe."""
    fixed = np.where(conditions.is_fixed, conditions.displacement, 0.0)[nodes.nodes]
    given = np.einsum("nkc,nk->nc", conditions.frame[nodes.nodes], fixed)
    return np.asarray(np.einsum("nkc,nc->nk", nodes.frame, given)).ravel()


def _load(whole: WholeBody, coupling: NodeCoupling, stiffness: FloatArray, offset: FloatArray) -> FloatArray:
    """Return the load (n_unknowns,) on the unknowns: ``K_w o + R^T f``."""
    return coupling.on_unknowns(whole.load) + stiffness @ offset[coupling.unknown_dofs]


def _following(coupling: NodeCoupling, offset: FloatArray) -> FollowingTangents | None:
    nodes = np.flatnonzero(coupling.tangent_follows)
    if not nodes.size:
        return None
    at_rest = offset[2 * nodes + 1] - coupling.follow @ offset[coupling.unknown_dofs]
    return FollowingTangents(nodes, coupling.follow, at_rest)


def condensed_body(
    elastic: SteklovPoincare,
    conditions: NodalConditions,
    contact: ContactNodes,
    force: FloatArray,
    modes: FloatArray | None = None,
) -> DirectBody:
    """Reduce a body to its contact boundary.

    Parameters
    ----------
    elastic : SteklovPoincare
    conditions : NodalConditions
    contact : ContactNodes
        Both as `contact_conditions` has found them.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces.
    modes : (n_motions, n_nodes, 2) array, optional
        The `free_modes` of the conditions, where they are known.

    Raises
    ------
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    SingularMatrixError
        If even tied contact does not hold the body.
    """
    condensed = elastic.condense(conditions, force)
    if not contact.nodes.size:
        raise NoContactNodesError(
            "supports fix every node of the contact boundary: use more elements, or restrict the supports"
        )
    whole = WholeBody.of(elastic.displacement_space, condensed, conditions, force, modes)
    return DirectBody.of(whole, contact, elastic.material.plane_modulus)
