"""From an elastic body with supports and loads to the `LinearBody` that the contact drivers see."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.body import ContactState
from bemkit.contact.conditions import LinearConditions
from bemkit.contact.dense import DenseBody
from bemkit.contact.nodes import ContactNodes as ContactNodes
from bemkit.contact.nodes import contact_conditions as contact_conditions
from bemkit.contact.nodes import free_motions, held_nodes
from bemkit.contact.unknowns import Unknowns, find_free_tangents, find_tangents, find_unknowns
from bemkit.errors import InputError
from bemkit.geometry.space import dof_points
from bemkit.operators.balance import NOISE, Imbalance, resultant_imbalance, round_off_of
from bemkit.operators.nodal import NodalConditions, Support
from bemkit.operators.rigid import possible_motions, rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.work import Work


class NoContactNodesError(InputError):
    """A contact boundary whose nodes are all held by supports."""


@dataclass(frozen=True, eq=False)
class CondensedBody:
    """An elastic body seen from its contact nodes; fulfils `LinearBody`.

    Parameters
    ----------
    dense : DenseBody
        The condensed stiffness in (n, t) components.
    condensed : CondensedMap
        The same in open directions, with the way back to the whole boundary.
    unknowns : Unknowns
        The displacements of the contact nodes that `dense` solves for.
    points : (n_nodes, 2) array [m]
        Where the nodal forces act.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces, in x and y.
    conditions : NodalConditions
        Of the displacement nodes, the contact nodes open.
    nodes : ContactNodes
    balanced : tuple of int
        Which of the resultants along x and y and the moment (0, 1, 2) vanish: not those of an exterior, which is at
        rest far away, nor those that the images of a symmetric body balance.

    Notes
    -----
    At a node where a support prescribes one direction (a roller meets the contact boundary) only the other one is
    open. Its displacements and its pressure are true; friction there cannot be told from the reaction of the support,
    so that no friction acts in the contact problem; see `bemkit.contact.held_friction`.
    """

    dense: DenseBody
    condensed: CondensedMap
    unknowns: Unknowns
    points: FloatArray
    force: FloatArray
    conditions: NodalConditions
    nodes: ContactNodes
    balanced: tuple[int, ...] = (0, 1, 2)

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

    @property
    def tangent_is_free(self) -> BoolArray:
        """(n_contact,) bool array: nodes without friction, whose tangential displacement is no unknown."""
        return self.dense.tangent_is_free

    @property
    def moves(self) -> BoolArray:
        """(n_contact, 2) bool array: where `rigid_motions` are known; not along tangents that supports hold."""
        return np.stack([np.ones_like(self.is_held), ~self.is_held], axis=1)

    @property
    def is_held(self) -> BoolArray:
        """(n_contact,) bool array: nodes that a support holds in one direction, which have no friction of their own."""
        return held_nodes(self.conditions, self.nodes)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return displacement and traction under two conditions per contact node."""
        return self.dense.respond(conditions)

    def rigid_motions(self) -> FloatArray:
        """Return the motions that only contact can hold."""
        return self.dense.rigid_motions()

    def rigid_load(self) -> FloatArray:
        """Return the work of the load on each of these motions."""
        return self.dense.rigid_load()

    @property
    def work(self) -> Work:
        """What it took to come here, from the operators on."""
        return self.condensed.work + Work(contact_unknowns=self.dense.n_unknowns)

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
        condensed = replace(condensed, work=self.condensed.work + condensed.work)
        unknowns = find_unknowns(conditions, self.nodes, self.tangent_is_free)
        free = find_free_tangents(conditions, self.nodes, self.tangent_is_free, unknowns, condensed)
        dense = replace(self.dense, load=unknowns.load(condensed), free_tangents=free)
        return replace(self, dense=dense, condensed=condensed, unknowns=unknowns, force=force, conditions=conditions)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.condensed.recover(self.unknowns.opened(state.displacement.ravel()[self.unknowns.numbers]))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium of forces and moments.

        The numbers also cover the contact nodes themselves; see `DenseBody.unbalanced`. Prescribed displacements would
        cause any forces on a clamped body, so that its condensed load is no measure: those at hand are. Their round-off
        is that of the terms whose differences they are, small ones in thin bodies and in those that move far.
        """
        displacement, force = self.recover(state)
        reach, of_forces = float(np.abs(displacement).max()), round_off_of(displacement, self.condensed.sensitivity)
        round_off = max(of_forces, np.finfo(float).eps * reach * float(np.abs(self.dense.stiffness).sum()))
        noise = NOISE * round_off
        reaction = float(np.abs(self._in_frames(force)[self.conditions.is_fixed]).max(initial=0.0))
        given = self._in_frames(self.force)[~self.conditions.is_fixed]
        of_contact = self.dense.unbalanced(state).beside(given, reaction if reaction > noise else 0.0, round_off)
        if not self.balanced or (np.abs(force).sum() <= noise and self._only_moves(displacement)):
            return of_contact
        return of_contact.joined(resultant_imbalance(self.points, force, self.balanced, of_forces))

    def _in_frames(self, force: FloatArray) -> FloatArray:
        """Return forces (n_nodes, 2) in the frames of the nodes."""
        return np.asarray(np.einsum("nkc,nc->nk", self.conditions.frame, force))

    def _only_moves(self, displacement: FloatArray) -> bool:
        """Whether the body has moved rigidly."""
        motions = rigid_motions(self.points, self.points.mean(axis=0), float(np.ptp(self.points, axis=0).max()))
        motions = motions.reshape(-1, 3)
        rigid = motions @ np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
        # nearly incompressible bodies recover a rigid motion to 1e-8
        return bool(np.abs(displacement.ravel() - rigid).max() <= 1e-6 * np.abs(displacement).max())


def condense(
    elastic: SteklovPoincare, supports: Sequence[Support], candidates: ContactNodes, force: FloatArray
) -> CondensedBody:
    """Reduce a body to its contact boundary.

    Parameters
    ----------
    elastic : SteklovPoincare
    supports : sequence of Support
    candidates : ContactNodes
        Nodes that may touch an obstacle, whatever holds them.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces.

    Returns
    -------
    CondensedBody
        Its `nodes` are the candidates that can touch; the others are left to their supports.

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
    conditions, contact = contact_conditions(space, supports, candidates)
    condensed = elastic.condense(conditions, force)
    if not contact.nodes.size:
        raise NoContactNodesError(
            "supports fix every node of the contact boundary: use more elements, or restrict the supports"
        )
    is_free = find_tangents(conditions, contact)
    unknowns = find_unknowns(conditions, contact, is_free)
    stiffness = unknowns.to_open.T @ condensed.stiffness @ unknowns.to_open
    free = find_free_tangents(conditions, contact, is_free, unknowns, condensed)
    motions = free_motions(conditions, contact, space)
    modulus = elastic.material.plane_modulus
    dense = DenseBody(stiffness, unknowns.load(condensed), contact.weights, motions, free, modulus)
    points, balanced = dof_points(space), possible_motions(space.mesh)
    return CondensedBody(dense, condensed, unknowns, points, force, conditions, contact, balanced)
