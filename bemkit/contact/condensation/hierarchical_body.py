"""An elastic body of many elements as the contact solvers see it: compressed, never condensed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, spread_fractions
from bemkit.contact.body import ContactState, LinearBody, SingularResponse
from bemkit.contact.condensation.held_friction import HeldFriction
from bemkit.contact.condensation.nodes import ContactNodes, NoContactNodesError, free_motions, held_nodes
from bemkit.contact.conditions import LinearConditions, stick
from bemkit.contact.equilibrium import NOISE_FACTOR, Imbalance, resultant_imbalance
from bemkit.geometry.spaces import dof_points
from bemkit.operators.counts import OperationCounts
from bemkit.operators.hierarchy.system import NodeConditions
from bemkit.operators.linear.dense import SingularMatrixError
from bemkit.operators.rigid_modes import admissible_modes, without_motion
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation, LoadedSystem
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

_SAMPLED_PAIRS, _MOST_SAMPLED, _FEWEST_SAMPLED = 250_000, 50, 8
"""Points where a residual is evaluated: so many that their pairs with all elements take about as long as a response."""
_KEPT = 3
"""Responses whose conditions are remembered, so that fields of the whole boundary follow without another one."""
_MOST_SHIFTS = 4
"""Rounds in which the rigid motion of a body is found; each knows it to the tolerance of the compression better."""
_MANY = 4000
"""Contact nodes from which on a response for each of them is too much."""


@dataclass(frozen=True, eq=False)
class ElementConditions:
    """Contact components from tractions and displacements in the frames of elements, and conditions the other way.

    Parameters
    ----------
    of_traction, of_displacement : (n_contact, 2, 2) arrays
        ``sigma = of_traction @ t``, where t is the force of an element or node by its weight, and
        ``u = of_displacement @ u_local``. Where a support holds a node in one direction, sigma_n is the effective
        pressure on the other one, see `bemkit.contact.condensation.held_friction`, and sigma_t is zero.
    is_held : (n_contact,) bool array
        These nodes.
    support : (n_contact, 2) array
        The direction that the support holds in the frame of the element, zero elsewhere.
    given : (n_contact,) array [m]
        The displacement that it prescribes.
    """

    of_traction: FloatArray
    of_displacement: FloatArray
    is_held: BoolArray
    support: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes, weights: FloatArray) -> ElementConditions:
        """Return what conditions and weights of all elements (n_elements,) and the frames of contact make of it."""
        nodes, is_held = contact.nodes, held_nodes(conditions, contact)
        turn = np.einsum("nkc,njc->nkj", contact.frame, conditions.frame[nodes])
        unit = np.broadcast_to(np.eye(2), turn.shape)
        moving = np.where(conditions.is_fixed[nodes], 0.0, 1.0)
        pressure = np.zeros_like(turn)
        pressure[:, 0] = moving / np.where(is_held, np.sum(moving * turn[:, 0], axis=1), 1.0)[:, None]
        support = np.where(is_held[:, None], 1.0 - moving, 0.0)
        return cls(
            of_traction=(weights[nodes] / contact.weights)[:, None, None]
            * np.where(is_held[:, None, None], pressure, unit),
            of_displacement=np.where(is_held[:, None, None], turn, unit),
            is_held=is_held,
            support=support,
            given=np.sum(support * conditions.displacement[nodes], axis=1),
        )

    def at_elements(self, conditions: LinearConditions) -> NodeConditions:
        """Return conditions of contact in the frames of the elements; held tangents follow their support."""
        on_traction = conditions.on_traction @ self.of_traction
        on_displacement = conditions.on_displacement @ self.of_displacement
        value = conditions.value.copy()
        held = self.is_held
        on_traction[held, 1], on_displacement[held, 1], value[held, 1] = 0.0, self.support[held], self.given[held]
        return NodeConditions(on_traction, on_displacement, value)

    def of_contact(self, traction: FloatArray, displacement: FloatArray) -> ContactState:
        """Return what contact sees of tractions and displacements (n_contact, 2) in the frames of the elements."""
        return ContactState(_times(self.of_displacement, displacement), _times(self.of_traction, traction))


def _times(matrices: FloatArray, vectors: FloatArray) -> FloatArray:
    product: FloatArray = np.einsum("nij,nj->ni", matrices, vectors)
    return product


@dataclass(frozen=True, eq=False)
class HierarchicalBody(LinearBody):
    """A body whose boundary equations are compressed over a tree; see `bemkit.operators.hierarchy`.

    Parameters
    ----------
    loaded : LoadedSystem
        The equations under the given supports and forces.
    nodes : ContactNodes
        Elements, or nodes of Galerkin's method, that may touch, along whose frames the equations have theirs.
    conditions : NodalConditions
        Of the elements.
    force : (n_elements, 2) array [N/m]
        Given nodal forces, in x and y.
    inside : ForcesInside, optional
        What acts inside the body; the equations know what its particular solution leaves of everything else.

    Notes
    -----
    A response factors the leaves of the tree whose conditions differ from those of the last one, and what lies above
    them.
    """

    loaded: LoadedSystem
    nodes: ContactNodes
    conditions: NodalConditions
    force: FloatArray
    inside: ForcesInside | None = None
    _responses: list[_Response] = field(default_factory=list, init=False)
    _fields: list[_Fields] = field(default_factory=list, init=False)
    _travelled: list[LoadedSystem] = field(default_factory=list, init=False)

    condensed = None
    """No stiffness is formed."""

    @property
    def weights(self) -> FloatArray:  # type: ignore[override]  # read-only here
        """(n_contact,) array [m]: the lengths of the elements."""
        return self.nodes.weights

    @property
    def accuracy(self) -> float:  # type: ignore[override]
        """Message of the linear solver."""
        return self.loaded.map.options.accuracy

    @property
    def responses_are_expensive(self) -> bool:  # type: ignore[override]
        """Whether there are thousands of nodes."""
        return self.n_contact > _MANY

    @property
    def stiffness_scale(self) -> float:
        """E' by the median length of a node [Pa/m]."""
        return self.loaded.map.material.plane_modulus / float(np.median(self.weights))

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes that a support holds in one direction."""
        return self._elements.is_held

    @cached_property
    def _held_friction(self) -> HeldFriction:
        """How friction acts at these nodes."""
        elements = self._elements
        moving = np.where(elements.support[:, None] == 0.0, elements.of_displacement, 0.0).sum(axis=2)
        slope = np.divide(moving[:, 1], moving[:, 0], out=np.zeros(len(moving)), where=elements.is_held)
        return HeldFriction(elements.is_held, slope)

    @property
    def work(self) -> OperationCounts:
        """The order of the contact system; whole matrices there are none."""
        n_retained = int(np.count_nonzero(self.conditions.is_retained))
        return OperationCounts(contact_unknowns=n_retained)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response; leaves whose conditions are those of the last one are not factored again.

        Notes
        -----
        Prescribed displacements, zero tractions and slip tractions are met exactly, as by `DenseBody`.
        """
        if len(conditions.free_motions(self.rigid_motions())):
            raise SingularResponse("the contact conditions leave a rigid motion free")
        self._fields.clear()
        substituted = self._held_friction.substituted(conditions)
        state = self._held_friction.restored(conditions, self._solved(substituted))
        self._responses.append(_Response(state, substituted, self._moving.system.n_answers))
        del self._responses[:-_KEPT]
        return state

    def rigid_motions(self) -> FloatArray:
        """Return the motions that no support resists, (n_motions, n_contact, 2)."""
        return self._motions

    def rigid_load(self) -> FloatArray:
        """Return the work of the given forces on these motions."""
        load: FloatArray = np.einsum("ncm,nc->m", self.loaded.motions, self.loaded.force)
        return load

    def under(
        self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None
    ) -> HierarchicalBody:
        """Return the same body under other forces in x and y, and displacements in the frames of the elements.

        What acts inside the body stays as it is unless `inside` says otherwise.
        """
        inside = self.inside if inside is None else inside
        conditions = replace(self.conditions, displacement=displacement)
        left, left_force = _left_of(conditions, force, inside)
        loaded = self.loaded.under(left_force, left.displacement)
        return replace(self, loaded=loaded, conditions=conditions, force=force, inside=inside)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_elements, 2) and total force (n_elements, 2) of the boundary, in x and y.

        That is under the conditions which have led to the state or, if it is no late response, with its displacements
        held.
        """
        fields = self._fields_of(state)
        return fields.displacement, fields.force

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return how far the state is from a solution of the boundary equations, and all forces from equilibrium.

        `force` is the largest of three: the resultant of all forces; the residual of the equations at points all over
        the boundary, all integrals in closed form instead of compressed, by the largest displacement beside a rigid
        motion; and what contact tractions differ from those of the whole boundary, by the largest force.
        """
        fields = self._fields_of(state)
        loaded, mesh, inside = fields.loaded, self.loaded.map.mesh, self.inside
        if not (np.isfinite(fields.displacement).all() and np.isfinite(fields.force).all()):
            return Imbalance(np.nan, np.nan)
        points = dof_points(loaded.map.displacement_space)
        size = float(np.abs(without_motion(mesh, points, fields.displacement - loaded.motion)).max())
        of_contact = (fields.force - self.force) / loaded.map.mesh.lengths[:, None]
        at_nodes = self.conditions.in_frames(of_contact)[self.nodes.nodes]
        at_nodes = np.einsum("nij,nj->ni", self._elements.of_traction, at_nodes)
        acting = self._held_friction.effective(state.traction)
        missing = float(np.abs(self.weights[:, None] * (acting - at_nodes)).max())
        largest = max(float(np.abs(fields.force).max()), float((self.weights[:, None] * np.abs(state.traction)).max()))
        terms = loaded.map.material.plane_modulus * float(np.abs(fields.displacement).max())
        if inside is None and not self.force.any() and largest <= self.accuracy * terms:
            return Imbalance(missing / terms, 0.0) if terms else Imbalance(0.0, 0.0)  # it has only been moved
        of_inside = () if inside is None else (inside.volume_force, inside.inner_force)
        result = resultant_imbalance(points, fields.force, admissible_modes(mesh), 0.0, *of_inside)
        noise = NOISE_FACTOR * float(np.finfo(float).eps * np.abs(fields.displacement - loaded.motion).max())
        if size > noise:
            left = loaded.system.residual(self._sampled, fields.traction, fields.strained)
            result = result.joined(Imbalance(float(np.abs(left).max()) / size, 0.0, noise / size))
        return result.joined(Imbalance(missing / largest, 0.0)) if largest else result

    def _fields_of(self, state: ContactState) -> _Fields:
        """Return the fields on the whole boundary that belong to a state."""
        for fields in self._fields:
            if fields.state is state:
                return fields
        response = next((each for each in self._responses if each.state is state), None)
        if response is None or response.answer != self._moving.system.n_answers:
            self._solved(stick(state.u_n, state.u_t) if response is None else response.conditions)
        loaded = self._moving
        traction, strained = loaded.system.everywhere()
        displacement, force = strained + loaded.motion, traction * loaded.map.mesh.lengths[:, None]
        if self.inside is not None:
            displacement, force = displacement + self.inside.displacement, force + self.inside.force
        fields = _Fields(state, loaded, strained, traction, displacement, force)
        self._fields[:] = [fields]
        return fields

    @cached_property
    def _sampled(self) -> IntArray:
        """Elements where residuals are evaluated: half of them in contact, without any pattern."""
        n = len(self.force)
        n_points = min(n, int(np.clip(_SAMPLED_PAIRS // n, _FEWEST_SAMPLED, _MOST_SAMPLED)))
        spread = spread_fractions(n_points)
        in_contact = self.nodes.nodes[(spread[::2] * self.n_contact).astype(int)]
        return np.unique(np.concatenate([in_contact, (spread[1::2] * n).astype(int)]))

    @cached_property
    def _motions(self) -> FloatArray:
        return free_motions(self.conditions, self.nodes, self.loaded.map.displacement_space)

    @property
    def _moving(self) -> LoadedSystem:
        """The equations without the rigid motion of the last response."""
        return self._travelled[-1] if self._travelled else self.loaded

    @cached_property
    def _elements(self) -> ElementConditions:
        return ElementConditions.of(self.conditions, self.nodes, self.loaded.map.mesh.lengths)

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Tractions and displacements (n_contact, 2) in the frames of the elements that the equations do not solve for.

        Those of the particular solution for what acts inside; and given forces, of which contact knows nothing.
        """
        nodes = self.nodes.nodes
        force, displacement = -self.force[nodes], np.zeros((self.n_contact, 2))
        if self.inside is not None:
            force, displacement = force + self.inside.force[nodes], self.inside.displacement[nodes]
        frame, traction = self.conditions.frame[nodes], force / self.loaded.map.mesh.lengths[nodes, None]
        return np.einsum("nkc,nc->nk", frame, traction), np.einsum("nkc,nc->nk", frame, displacement)

    def _solved(self, conditions: LinearConditions) -> ContactState:
        """Return the response; where the contact nodes move rigidly by far more than they strain, solve without that.

        A rigid motion causes no tractions, in the compressed equations none but for their tolerance.
        """
        nodes, asked = self.nodes.nodes, self._elements.at_elements(conditions)
        frame, (traction, displacement) = self.conditions.frame[nodes], self._known
        for _ in range(_MOST_SHIFTS):
            loaded = self._moving
            moved = displacement + np.einsum("nkc,nc->nk", frame, loaded.motion[nodes])
            try:
                state = loaded.system.state(loaded.known, nodes, asked.beside(traction, moved))
            except SingularMatrixError as error:
                raise SingularResponse(str(error)) from error
            strained = np.einsum("nkc,nk->nc", frame, state[:, 2:])
            travel = loaded.travel_of(nodes, strained)
            if travel is None:
                break
            self._travelled[:] = [loaded.moved(travel)]
        response = self._elements.of_contact(state[:, :2] + traction, state[:, 2:] + moved)
        given_tractions = conditions.with_given_tractions(response.traction)
        given_tractions[self.tangent_follows, 1] = 0.0
        return ContactState(conditions.with_given_displacements(response.displacement), given_tractions)


@dataclass(frozen=True, eq=False)
class _Response:
    """A state, the conditions that have led to it, and the number of the answer of the equations to these."""

    state: ContactState
    conditions: LinearConditions
    answer: int


@dataclass(frozen=True, eq=False)
class _Fields:
    """Fields (n_elements, 2) in x and y on the whole boundary: what the equations solve for, and all of it.

    The equations know neither a rigid motion of the body nor the particular solution for what acts inside it.
    """

    state: ContactState
    loaded: LoadedSystem
    strained: FloatArray
    traction: FloatArray
    displacement: FloatArray
    force: FloatArray


def _left_of(
    conditions: NodalConditions, force: FloatArray, inside: ForcesInside | None
) -> tuple[NodalConditions, FloatArray]:
    """Return the given displacements and forces less those of a particular solution."""
    return (conditions, force) if inside is None else inside.left_of(conditions, force)


def hierarchical_body(
    elastic: HierarchicalCollocation,
    conditions: NodalConditions,
    contact: ContactNodes,
    force: FloatArray,
    inside: ForcesInside | None = None,
) -> HierarchicalBody:
    """Return a compressed body as contact sees it.

    Parameters
    ----------
    elastic : HierarchicalCollocation
    conditions : NodalConditions
    contact : ContactNodes
        They may touch, and are retained where no support holds them; see `opened`.
    force : (n_elements, 2) array [N/m]
        Given nodal forces, zero at contact nodes.
    inside : ForcesInside, optional
        What acts inside the body.

    Raises
    ------
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    """
    if not contact.nodes.size:
        raise NoContactNodesError
    loaded = LoadedSystem.of(elastic, *_left_of(conditions, force, inside))
    return HierarchicalBody(loaded, contact, conditions, force, inside)
