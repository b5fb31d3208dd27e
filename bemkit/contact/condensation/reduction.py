"""From an elastic body with supports and loads to the `LinearBody` that the contact drivers see."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.condensation.dense_body import DenseBody, EliminatedTangents
from bemkit.contact.condensation.nodes import (
    ContactNodes,
    at_contact,
    bound_tangents,
    find_tangents,
    held_nodes,
    unknown_directions,
)
from bemkit.errors import InputError
from bemkit.geometry.spaces import dof_points
from bemkit.operators.counts import OperationCounts
from bemkit.operators.equilibrium import NOISE_FACTOR, Imbalance, resultant_imbalance, round_off_of
from bemkit.operators.rigid_modes import admissible_modes, rigid_motions
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside, condensed_under
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes

_ROUND_OFF = 1e-6
"""What is off by more than this share is no round-off: it stays, for the certificate to tell."""


def resisting_none(stiffness: FloatArray, motions: FloatArray) -> FloatArray:
    """Return a stiffness (n, n) that maps motions (n_motions, n) to no force, and makes no force that works on them.

    Notes
    -----
    A body that supports leave free to move resists no rigid motion, its load does on it the work of all given forces
    (`with_work`), and what follows the unknowns follows the motion (`following`). Elimination keeps that to the
    round-off of the forces on the whole body. A contact much smaller than the body, such as a pin in a plate, has short
    lever arms: there the same round-off would be forces that turn the body, by far.
    """
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
    if np.abs(missing).max() > _ROUND_OFF * size:
        return load
    return np.asarray(load + np.linalg.lstsq(motions, missing, rcond=None)[0])


def following(response: FloatArray, motions: FloatArray, followed: FloatArray) -> FloatArray:
    """Return a response (k, n) that takes motions (n_motions, n) to (n_motions, k), what they are where it leads."""
    missing = followed - motions @ response.T
    if np.abs(missing).max(initial=0.0) > _ROUND_OFF * np.abs(motions).max():
        return response
    return np.asarray(response + np.linalg.lstsq(motions, missing, rcond=None)[0].T)


class NoContactNodesError(InputError):
    """A contact boundary whose nodes are all held by supports."""


@dataclass(frozen=True, eq=False)
class Unknowns:
    """The displacements of the contact nodes that the contact system solves for, among the directions of a map.

    Each retained direction of the map is one unknown: ``displacement[order] = factor * unknowns + offset``. At a node
    between two obstacles the unknowns are the displacements towards them, which need not be at right angles: to its
    second direction comes ``coupling`` times the unknown of the first.

    Parameters
    ----------
    order : (n_unknowns,) array
        Where each unknown stands among the retained directions.
    factor, offset : (n_unknowns,) arrays [-], [m]
        One and zero, but where a support or a second obstacle takes a direction of the node.
    first, second : (n_shared,) arrays
        The two unknowns of each node between two obstacles.
    coupling : (n_shared,) array [-]
    """

    order: IntArray
    factor: FloatArray
    offset: FloatArray
    first: IntArray
    second: IntArray
    coupling: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes) -> Unknowns:
        """Return the unknowns under the conditions of all displacement nodes, ascending by contact node."""
        row, component = np.nonzero(unknown_directions(conditions, contact))
        node, is_held = contact.nodes[row], held_nodes(conditions, contact)[row]
        position = np.cumsum(conditions.is_retained).reshape(-1, 2) - 1
        along = np.einsum("nkc,nc->nk", conditions.frame[node], contact.directions[row])
        each, is_second = np.arange(row.size), contact.is_second[row]
        factor = 1.0 / np.where(is_held | is_second, along[each, component], 1.0)
        held_part = along[each, 1 - component] * conditions.displacement[node, 1 - component]
        first_of = np.zeros(len(position), np.intp)
        first_of[node[~is_second]] = each[~is_second]
        return cls(
            order=position[node, component],
            factor=factor,
            offset=np.where(is_held, -held_part * factor, 0.0),
            first=first_of[node[is_second]],
            second=each[is_second],
            coupling=-along[is_second, 0] * factor[is_second],
        )

    def directions(self, unknowns: FloatArray) -> FloatArray:
        """Return the displacements of the retained directions (n_retained,)."""
        displacement = np.empty(self.order.size)
        displacement[self.order] = self.factor * unknowns + self.offset
        displacement[self.order[self.second]] += self.coupling * unknowns[self.first]
        return displacement

    def forces(self, forces: FloatArray) -> FloatArray:
        """Return what forces (n_retained, ...) along the retained directions do on the unknowns, (n_unknowns, ...)."""
        ordered = forces[self.order]
        on_unknowns: FloatArray = (self.factor * ordered.T).T
        on_unknowns[self.first] += (self.coupling * ordered[self.second].T).T
        return on_unknowns

    def stiffness(self, condensed: CondensedMap) -> FloatArray:
        """Return the stiffness of a map in the unknowns."""
        return self.forces(self.forces(condensed.stiffness.T).T)

    def load(self, condensed: CondensedMap) -> FloatArray:
        """Return the load of a map on the unknowns."""
        at_zero = self.directions(np.zeros(self.order.size))
        return self.forces(condensed.load - condensed.stiffness @ at_zero)

    def tangents(
        self, condensed: CondensedMap, conditions: NodalConditions, contact: ContactNodes
    ) -> EliminatedTangents | None:
        """Return how the tangential displacements that are no unknowns follow these, None if there are none."""
        chosen = np.flatnonzero(find_tangents(conditions, contact))
        if not chosen.size:
            return None
        nodes, is_held = contact.nodes[chosen], held_nodes(conditions, contact)[chosen]
        response, at_rest = np.zeros((chosen.size, self.order.size)), np.zeros(chosen.size)
        is_free = ~bound_tangents(conditions, contact)[chosen]
        followed, rest = condensed.follow(2 * nodes[is_free] + 1)
        response[is_free] = self.forces(followed.T).T
        at_rest[is_free] = rest + followed @ self.directions(np.zeros(self.order.size))
        # where a support holds the node, its frame leads from the one component that moves to the other
        held = np.flatnonzero(is_held)
        node = nodes[held]
        along = np.einsum("nkc,njc->nkj", conditions.frame[node], contact.frame[chosen[held]])
        free = np.argmax(conditions.is_retained[node], axis=1)
        moving, fixed = along[np.arange(held.size), free], along[np.arange(held.size), 1 - free]
        slope = moving[:, 1] / moving[:, 0]
        n_before = np.cumsum(np.count_nonzero(unknown_directions(conditions, contact), axis=1)) - 1
        response[held, n_before[chosen[held]]] = slope
        given = conditions.displacement[node, 1 - free]
        at_rest[held] = (fixed[:, 1] - slope * fixed[:, 0]) * given
        # between two obstacles both directions of the node are retained
        shared = np.flatnonzero(contact.is_shared[chosen])
        tangent = np.einsum("nkc,nc->kn", conditions.frame[nodes[shared]], contact.frame[chosen[shared], 1])
        position = np.cumsum(conditions.is_retained).reshape(-1, 2) - 1
        on_directions = np.zeros((self.order.size, shared.size))
        on_directions[position[nodes[shared]].T, np.arange(shared.size)] = tangent
        response[shared] = self.forces(on_directions).T
        return EliminatedTangents(chosen, response, at_rest)


@dataclass(frozen=True, eq=False, kw_only=True)
class CondensedBody(DenseBody):
    """An elastic body seen from its contact nodes: the condensed stiffness, and the way back to the whole boundary.

    Parameters
    ----------
    condensed : CondensedMap
        The stiffness in retained directions.
    unknowns : Unknowns
        The displacements of the contact nodes among these.
    points : (n_nodes, 2) array [m]
        Where the nodal forces act.
    force : (n_nodes, 2) array [N/m]
        Given nodal forces, in x and y.
    modes : (n_motions, n_nodes, 2) array
        What `motions` are at all nodes, in x and y.
    conditions : NodalConditions
        Of the displacement nodes; the contact nodes are retained.
    nodes : ContactNodes
    balanced : tuple of int
        Which of the resultants along x and y and the moment (0, 1, 2) vanish: not those of an exterior, which is at
        rest far away, nor those that the images of a symmetric body balance.

    Notes
    -----
    At a node where a support prescribes one direction (a roller meets the contact boundary) only the other one is
    retained. Its displacements and its pressure are true; friction there cannot be told from the reaction of the
    support, so that no friction acts in the contact problem; see `bemkit.model.solved_contact`.
    """

    condensed: CondensedMap
    unknowns: Unknowns
    points: FloatArray
    force: FloatArray
    modes: FloatArray
    conditions: NodalConditions
    nodes: ContactNodes
    balanced: tuple[int, ...] = (0, 1, 2)

    @property
    def moves(self) -> BoolArray:
        """(n_contact, 2) bool array: where `rigid_motions` are known; not along tangents that are bound."""
        is_bound = bound_tangents(self.conditions, self.nodes)
        return np.stack([np.ones_like(is_bound), ~is_bound], axis=1)

    @property
    def is_held(self) -> BoolArray:
        """(n_contact,) bool array: nodes that a support holds in one direction, which have no friction of their own."""
        return held_nodes(self.conditions, self.nodes)

    @property
    def work(self) -> OperationCounts:
        """What it took to come here, from the operators on."""
        return self.condensed.work + OperationCounts(contact_unknowns=self.n_unknowns)

    def under(self, displacement: FloatArray, force: FloatArray, inside: ForcesInside | None = None) -> CondensedBody:
        """Return the same body under another load, without another factorisation.

        Parameters
        ----------
        displacement : (n_nodes, 2) array [m]
            Prescribed displacements in the frames of the nodes, as in `NodalConditions`.
        force : (n_nodes, 2) array [N/m]
            Given nodal forces.
        inside : ForcesInside, optional
            What acts inside the body, if that changes.
        """
        conditions = replace(self.conditions, displacement=displacement)
        condensed = condensed_under(self.condensed, conditions, force, inside)
        condensed = replace(condensed, work=self.condensed.work + condensed.work)
        unknowns = Unknowns.of(conditions, self.nodes)
        body = replace(
            self,
            load=unknowns.load(condensed),
            eliminated_tangents=unknowns.tangents(condensed, conditions, self.nodes),
            condensed=condensed,
            unknowns=unknowns,
            force=force,
            conditions=conditions,
        )
        return body.with_exact_motions()

    def with_exact_motions(self) -> CondensedBody:
        """Return the body with load and tangents that go with its rigid motions to the last digit; see `with_work`."""
        motions, tangents = self.motions_of_unknowns, self.eliminated_tangents
        if not len(motions):
            return self
        if tangents is not None:
            follows = ~bound_tangents(self.conditions, self.nodes)[tangents.nodes]
            response = tangents.response.copy()
            followed = self.rigid_motions()[:, tangents.nodes[follows], 1]
            response[follows] = following(response[follows], motions, followed)
            tangents = replace(tangents, response=response)
        return replace(
            self,
            load=with_work(self.load, motions, *self._given_work()),
            eliminated_tangents=tangents,
        )

    def _given_work(self) -> tuple[FloatArray, float]:
        """Return the work (n_motions,) of all given forces on the rigid motions, and the sum of their sizes [N/m]."""
        work, size = np.einsum("mnc,nc->m", self.modes, self.force), float(np.abs(self.force).sum())
        inside = self.condensed.volume_force
        if inside is not None:
            unit = rigid_motions(self.points, np.zeros(2), 1.0).reshape(-1, 3)
            work += inside @ np.linalg.lstsq(unit, self.modes.reshape(len(self.modes), -1).T, rcond=None)[0]
            size += float(np.abs(inside[:2]).sum()) + self.condensed.inner_force
        return work, size

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_nodes, 2) and total force (n_nodes, 2) of all boundary nodes, in x and y."""
        return self.condensed.recover(self.unknowns.directions(state.displacement.ravel()[self.unknown_dofs]))

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far all forces on the body (loads, contact, reactions) are from equilibrium of forces and moments.

        The numbers also cover the contact nodes themselves; see `DenseBody.unbalanced`. Prescribed displacements would
        cause any forces on a clamped body, so that its condensed load is no measure: those at hand are. Their round-off
        is that of the terms whose differences they are, small ones in thin bodies and in those that move far.
        """
        displacement, force = self.recover(state)
        reach, of_forces = float(np.abs(displacement).max()), round_off_of(displacement, self.condensed.sensitivity)
        round_off = max(of_forces, np.finfo(float).eps * reach * float(self._column_sizes[1].sum()))
        noise = NOISE_FACTOR * round_off
        reaction = float(np.abs(self.conditions.in_frames(force)[self.conditions.is_fixed]).max(initial=0.0))
        of_contact = self.unbalanced(state).beside(self._given_forces, reaction if reaction > noise else 0.0, round_off)
        if not self.balanced or (np.abs(force).sum() <= noise and self._only_moves(displacement)):
            return of_contact
        resultant, inner = self.condensed.volume_force, self.condensed.inner_force
        return of_contact.joined(resultant_imbalance(self.points, force, self.balanced, of_forces, resultant, inner))

    @cached_property
    def _given_forces(self) -> FloatArray:
        """What acts besides contact, in directions that no support holds, and inside [N/m]."""
        given, resultant = self.conditions.in_frames(self.force)[~self.conditions.is_fixed], self.condensed.volume_force
        return given if resultant is None else np.append(given, [*resultant[:2], self.condensed.inner_force])

    def _only_moves(self, displacement: FloatArray) -> bool:
        """Whether the body has moved rigidly."""
        motions = rigid_motions(self.points, self.points.mean(axis=0), float(np.ptp(self.points, axis=0).max()))
        motions = motions.reshape(-1, 3)
        rigid = motions @ np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
        # nearly incompressible bodies recover a rigid motion to 1e-8
        return bool(np.abs(displacement.ravel() - rigid).max() <= 1e-6 * np.abs(displacement).max())


def condensed_body(
    elastic: SteklovPoincare,
    conditions: NodalConditions,
    contact: ContactNodes,
    force: FloatArray,
    modes: FloatArray | None = None,
) -> CondensedBody:
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
    space, condensed = elastic.displacement_space, elastic.condense(conditions, force)
    if not contact.nodes.size:
        raise NoContactNodesError(
            "supports fix every node of the contact boundary: use more elements, or restrict the supports"
        )
    unknowns = Unknowns.of(conditions, contact)
    modes = free_modes(space, conditions) if modes is None else modes
    body = CondensedBody(
        stiffness=unknowns.stiffness(condensed),
        load=unknowns.load(condensed),
        weights=contact.weights,
        motions=at_contact(modes, conditions, contact),
        eliminated_tangents=unknowns.tangents(condensed, conditions, contact),
        modulus=elastic.material.plane_modulus,
        condensed=condensed,
        unknowns=unknowns,
        points=dof_points(space),
        force=force,
        modes=modes,
        conditions=conditions,
        nodes=contact,
        balanced=admissible_modes(space.mesh),
    )
    if len(motions := body.motions_of_unknowns):
        body = replace(body, stiffness=resisting_none(body.stiffness, motions))
    return body.with_exact_motions()
