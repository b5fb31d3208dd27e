"""A body with compressed boundary equations for the contact solvers."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, spread_fractions
from bemkit.contact.body import ContactState, FreeMotion, LinearBody, SingularResponse, stick
from bemkit.contact.contact_nodes import ContactNodes, NoContactNodesError, free_motions, held_nodes
from bemkit.contact.equilibrium import NOISE_FACTOR, Imbalance, resultant_imbalance
from bemkit.contact.held_friction import HeldFriction
from bemkit.geometry.spaces import dof_points
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.counts import OperationCounts
from bemkit.operators.linear_solvers import SingularMatrixError
from bemkit.operators.rigid_modes import admissible_modes, without_motion
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.operators.steklov_poincare.hierarchical import HierarchicalCollocation, LoadedSystem
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions

_SAMPLED_PAIRS, _MOST_SAMPLED, _FEWEST_SAMPLED = 250_000, 50, 8
"""Pairs of a sampled point and an element, and limits of the number of points. Their residuals then take about as long
as a response."""
_KEPT = 3
"""Responses whose conditions are kept, so that the fields of the whole boundary need no other response."""
_MOST_SHIFTS = 4
"""Largest number of rounds that find the rigid motion of a body; each gains a factor of the compression's tolerance."""
_MANY = 4000
"""Number of contact nodes above which one response for each node is too expensive."""


@dataclass(frozen=True, eq=False)
class ElementConditions:
    """Maps between contact components and components in the frames of elements.

    Parameters
    ----------
    of_traction, of_displacement : (n_contact, 2, 2) arrays
        ``sigma = of_traction @ t``, where t is the force of an element divided by its weight, and
        ``u = of_displacement @ u_local``. If a support holds a node in one direction, sigma_n is the effective
        pressure in the other direction, see `bemkit.contact.held_friction`, and sigma_t is zero.
    is_held : (n_contact,) bool array
        Nodes that a support holds in one direction.
    support : (n_contact, 2) array
        The held direction in the frame of the element, zero elsewhere.
    given : (n_contact,) array [m]
        The displacement prescribed there.
    """

    of_traction: FloatArray
    of_displacement: FloatArray
    is_held: BoolArray
    support: FloatArray
    given: FloatArray

    @classmethod
    def of(cls, conditions: NodalConditions, contact: ContactNodes, weights: FloatArray) -> ElementConditions:
        """Return the maps for the conditions and weights (n_elements,) of all elements and the contact frames."""
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

    def at_elements(self, conditions: LinearConditions) -> LinearConditions:
        """Return contact conditions in the frames of the elements; a support replaces those of held directions."""
        on_traction = conditions.on_traction @ self.of_traction
        on_displacement = conditions.on_displacement @ self.of_displacement
        value, is_held = conditions.value.copy(), self.is_held
        on_traction[is_held, 1], on_displacement[is_held, 1] = 0.0, self.support[is_held]
        value[is_held, 1] = self.given[is_held]
        return LinearConditions(on_displacement, on_traction, value)

    def of_contact(self, traction: FloatArray, displacement: FloatArray) -> ContactState:
        """Return the contact state of tractions and displacements (n_contact, 2) in the frames of the elements."""
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
        Elements that may touch; the frames of their equations are the contact frames.
    conditions : NodalConditions
        Conditions of the elements.
    force : (n_elements, 2) array [N/m]
        Given nodal forces, in x and y.
    inside : ForcesInside, optional
        Body forces and heat. The equations are solved for the difference from their particular solution.

    Notes
    -----
    A response factors the leaves whose conditions differ from those of the last response, and the clusters above them.
    """

    loaded: LoadedSystem
    nodes: ContactNodes
    conditions: NodalConditions
    force: FloatArray
    inside: ForcesInside | None = None
    _responses: list[_Response] = field(default_factory=list, init=False)
    _fields: list[_Fields] = field(default_factory=list, init=False)
    _shifted: list[LoadedSystem] = field(default_factory=list, init=False)

    condensed = None
    """No stiffness is formed."""

    @property
    def weights(self) -> FloatArray:  # type: ignore[override]  # read-only here
        """(n_contact,) array [m]: the lengths of the elements."""
        return self.nodes.weights

    @property
    def accuracy(self) -> float:  # type: ignore[override]
        """Relative accuracy of the linear solver."""
        return self.loaded.elastic.options.accuracy

    @property
    def responses_are_expensive(self) -> bool:  # type: ignore[override]
        """Whether there are thousands of nodes."""
        return self.n_contact > _MANY

    @property
    def stiffness_scale(self) -> float:
        """E' divided by the median length of a node [Pa/m]."""
        return self.loaded.elastic.material.plane_modulus / float(np.median(self.weights))

    @property
    def tangent_follows(self) -> BoolArray:
        """(n_contact,) bool array: nodes that a support holds in one direction."""
        return self._elements.is_held

    @cached_property
    def _held_friction(self) -> HeldFriction:
        """Friction at nodes that a support holds in one direction."""
        elements = self._elements
        moving = np.where(elements.support[:, None] == 0.0, elements.of_displacement, 0.0).sum(axis=2)
        slope = np.divide(moving[:, 1], moving[:, 0], out=np.zeros(len(moving)), where=elements.is_held)
        return HeldFriction(elements.is_held, slope)

    @property
    def work(self) -> OperationCounts:
        """Order of the contact system; no matrix of it is formed."""
        n_retained = int(np.count_nonzero(self.conditions.is_retained))
        return OperationCounts(contact_unknowns=n_retained)

    def respond(self, conditions: LinearConditions) -> ContactState:
        """Return the response; leaves whose conditions are unchanged since the last response are not factored again.

        Notes
        -----
        Prescribed displacements, zero tractions and slip tractions are fulfilled exactly, as by `DenseBody`.
        """
        if len(conditions.free_motions(self.rigid_motions())):
            raise FreeMotion
        self._fields.clear()
        substituted = self._held_friction.substituted(conditions)
        state = self._held_friction.restored(conditions, self._solved(substituted))
        self._responses.append(_Response(state, substituted, self._current.system.factor.n_updates))
        del self._responses[:-_KEPT]
        return state

    def rigid_motions(self) -> FloatArray:
        """Return the rigid motions that no support resists, (n_motions, n_contact, 2)."""
        return self._motions

    def rigid_load(self) -> FloatArray:
        """Return the work of the given forces on these motions."""
        load: FloatArray = np.einsum("ncm,nc->m", self.loaded.motions, self.loaded.force)
        return load

    def under(
        self, force: FloatArray, displacement: FloatArray, inside: ForcesInside | None = None
    ) -> HierarchicalBody:
        """Return the same body under other forces in x and y, and displacements in the frames of the elements.

        Body forces stay the same unless `inside` is given.
        """
        inside = self.inside if inside is None else inside
        conditions = replace(self.conditions, displacement=displacement)
        left, left_force = _left_of(conditions, force, inside)
        loaded = self.loaded.under(left_force, left.displacement)
        return replace(self, loaded=loaded, conditions=conditions, force=force, inside=inside)

    def recover(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return displacement (n_elements, 2) and total force (n_elements, 2) of the boundary, in x and y.

        The fields are those under the conditions of a recent response or, for any other state, those under its
        displacements.
        """
        fields = self._fields_of(state)
        return fields.displacement, fields.force

    def imbalance(self, state: ContactState) -> Imbalance:
        """Return the residual of the boundary equations and of the equilibrium of all forces.

        `force` is the largest of three numbers: the relative resultant of all forces; the residual of the uncompressed
        equations at sampled points, relative to the largest displacement without its rigid part; and the difference
        of the contact tractions from those of the whole boundary, relative to the largest force.
        """
        fields = self._fields_of(state)
        loaded, mesh, inside = fields.loaded, self.loaded.elastic.mesh, self.inside
        if not (np.isfinite(fields.displacement).all() and np.isfinite(fields.force).all()):
            return Imbalance(np.nan, np.nan)
        points = dof_points(loaded.elastic.displacement_space)
        # contact tractions of the state against those of the whole boundary
        of_contact = (fields.force - self.force) / loaded.elastic.mesh.lengths[:, None]
        at_nodes = self.conditions.in_frames(of_contact)[self.nodes.nodes]
        at_nodes = np.einsum("nij,nj->ni", self._elements.of_traction, at_nodes)
        acting = self._held_friction.effective(state.traction)
        missing = float(np.abs(self.weights[:, None] * (acting - at_nodes)).max())
        largest = max(float(np.abs(fields.force).max()), float((self.weights[:, None] * np.abs(state.traction)).max()))
        terms = loaded.elastic.material.plane_modulus * float(np.abs(fields.displacement).max())
        if inside is None and not self.force.any() and largest <= self.accuracy * terms:
            return Imbalance(missing / terms, 0.0) if terms else Imbalance(0.0, 0.0)  # a pure rigid motion
        # resultant of all forces
        of_inside = () if inside is None else (inside.volume_force, inside.inner_force)
        result = resultant_imbalance(points, fields.force, admissible_modes(mesh), 0.0, *of_inside)
        # residual of the uncompressed equations, unless the body hardly strains
        strained = float(np.abs(without_motion(mesh, points, fields.displacement - loaded.motion)).max())
        noise = NOISE_FACTOR * float(np.finfo(float).eps * np.abs(fields.displacement - loaded.motion).max())
        if strained > noise:
            residual = loaded.system.residual(self._sampled, fields.traction, fields.strained)
            result = result.joined(Imbalance(float(np.abs(residual).max()) / strained, 0.0, noise / strained))
        return result.joined(Imbalance(missing / largest, 0.0)) if largest else result

    def _fields_of(self, state: ContactState) -> _Fields:
        """Return the fields of a state on the whole boundary."""
        for fields in self._fields:
            if fields.state is state:
                return fields
        response = next((response for response in self._responses if response.state is state), None)
        if response is None or response.answer != self._current.system.factor.n_updates:
            self._solved(stick(state.u_n, state.u_t) if response is None else response.conditions)
        loaded = self._current
        traction, strained = loaded.system.full_state()
        displacement, force = strained + loaded.motion, traction * loaded.elastic.mesh.lengths[:, None]
        if self.inside is not None:
            displacement, force = displacement + self.inside.displacement, force + self.inside.force
        fields = _Fields(state, loaded, strained, traction, displacement, force)
        self._fields[:] = [fields]
        return fields

    @cached_property
    def _sampled(self) -> IntArray:
        """Elements where residuals are evaluated, spread irregularly; half of them are in contact."""
        n = len(self.force)
        n_points = min(n, int(np.clip(_SAMPLED_PAIRS // n, _FEWEST_SAMPLED, _MOST_SAMPLED)))
        spread = spread_fractions(n_points)
        in_contact = self.nodes.nodes[(spread[::2] * self.n_contact).astype(int)]
        return np.unique(np.concatenate([in_contact, (spread[1::2] * n).astype(int)]))

    @cached_property
    def _motions(self) -> FloatArray:
        return free_motions(self.conditions, self.nodes, self.loaded.elastic.displacement_space)

    @property
    def _current(self) -> LoadedSystem:
        """The equations after the rigid motion of the last response is subtracted."""
        return self._shifted[-1] if self._shifted else self.loaded

    @cached_property
    def _elements(self) -> ElementConditions:
        return ElementConditions.of(self.conditions, self.nodes, self.loaded.elastic.mesh.lengths)

    @cached_property
    def _known(self) -> tuple[FloatArray, FloatArray]:
        """Tractions and displacements (n_contact, 2) that the equations do not solve for, in the frames of elements.

        They belong to the particular solution of body forces; given forces are subtracted.
        """
        nodes = self.nodes.nodes
        force, displacement = -self.force[nodes], np.zeros((self.n_contact, 2))
        if self.inside is not None:
            force, displacement = force + self.inside.force[nodes], self.inside.displacement[nodes]
        frame, traction = self.conditions.frame[nodes], force / self.loaded.elastic.mesh.lengths[nodes, None]
        return np.einsum("nkc,nc->nk", frame, traction), np.einsum("nkc,nc->nk", frame, displacement)

    def _solved(self, conditions: LinearConditions) -> ContactState:
        """Return the response; subtract a rigid motion of the contact nodes that is far larger than their strain.

        A rigid motion causes no tractions, but in the compressed equations it causes some within their tolerance.
        """
        nodes, required = self.nodes.nodes, self._elements.at_elements(conditions)
        frame, (traction, displacement) = self.conditions.frame[nodes], self._known
        for _ in range(_MOST_SHIFTS):
            loaded = self._current
            moved = displacement + np.einsum("nkc,nc->nk", frame, loaded.motion[nodes])
            try:
                state = loaded.system.state(loaded.known, nodes, required.relative_to(traction, moved))
            except SingularMatrixError as error:
                raise SingularResponse(str(error)) from error
            strained = np.einsum("nkc,nk->nc", frame, state[:, 2:])
            amplitudes = loaded.large_motion(nodes, strained)
            if amplitudes is None:
                break
            self._shifted[:] = [loaded.subtracting(amplitudes)]
        response = self._elements.of_contact(state[:, :2] + traction, state[:, 2:] + moved)
        given_tractions = conditions.with_given_tractions(response.traction)
        given_tractions[self.tangent_follows, 1] = 0.0
        return ContactState(conditions.with_given_displacements(response.displacement), given_tractions)


@dataclass(frozen=True, eq=False)
class _Response:
    """A state, its conditions, and the value of `BodyFactor.n_updates` when it was solved."""

    state: ContactState
    conditions: LinearConditions
    answer: int


@dataclass(frozen=True, eq=False)
class _Fields:
    """Fields (n_elements, 2) in x and y on the whole boundary.

    `strained` and `traction` are solutions of the equations; `displacement` and `force` also contain the rigid motion
    that was subtracted and the particular solution of body forces.
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
    """Return the given displacements and forces minus those of the particular solution."""
    return (conditions, force) if inside is None else inside.left_of(conditions, force)


def hierarchical_body(
    elastic: HierarchicalCollocation,
    conditions: NodalConditions,
    contact: ContactNodes,
    force: FloatArray,
    inside: ForcesInside | None = None,
) -> HierarchicalBody:
    """Return a body with compressed equations for the contact solvers.

    Parameters
    ----------
    elastic : HierarchicalCollocation
    conditions : NodalConditions
    contact : ContactNodes
        Nodes that may touch; their directions are retained unless a support holds them, see `opened`.
    force : (n_elements, 2) array [N/m]
        Given nodal forces, zero at contact nodes.
    inside : ForcesInside, optional
        Body forces and heat.

    Raises
    ------
    NoContactNodesError
        If no node of the contact boundary can move towards the obstacle.
    """
    if not contact.nodes.size:
        raise NoContactNodesError
    loaded = LoadedSystem.of(elastic, *_left_of(conditions, force, inside))
    return HierarchicalBody(loaded, contact, conditions, force, inside)
