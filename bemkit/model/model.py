"""From a prepared scene to a dimensionless contact problem, and back to physical fields of each body.

Inside, lengths are measured by the diameter of the largest body, stresses of the material by E', loads by their largest
value p and displacements by p L / E', so that results do not depend on the user's units, or on the positions and
stiffnesses of bodies. A scene without contact is a contact problem without nodes.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, cast

import numpy as np

from bemkit.arrays import FloatArray, IntArray, blended
from bemkit.contact.body import ContactState
from bemkit.contact.problem import ContactProblem
from bemkit.errors import InputError
from bemkit.model.fields import HeldForces, elastic_energy, insert_loads
from bemkit.model.given import loaded_map, with_far_motion, without_body_forces
from bemkit.model.placed import shape_numbers
from bemkit.model.prepared import Prepared, PreparedBody
from bemkit.model.single_body import SingleBody, is_direct, is_single, single_body
from bemkit.model.units import Units, motion_units
from bemkit.operators.counts import OperationCounts
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.nodal_conditions import supporting_forces
from bemkit.solvers.base import ContactSolver

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from bemkit.contact.joined.joined_bodies import JoinedBodies  # single bodies are solved without it


@dataclass(frozen=True, eq=False)
class Model:
    """A prepared scene with the maps of its bodies, the body of the contact problem, and this problem.

    Parameters
    ----------
    prepared : Prepared
    elastic : tuple of SteklovPoincare
        Of each body, dimensionless; copies share theirs.
    condensed : tuple of CondensedMap
        Of each of the bodies that are joined; copies share their stiffness. Empty for a single body.
    body : JoinedBodies, or the only body: DirectBody, HierarchicalBody, SurfaceBody or ContactFreeBody
    problem : ContactProblem
    work : OperationCounts
        Counted so far: integrals, factorisations and solves.
    """

    prepared: Prepared
    elastic: tuple[SteklovPoincare, ...]
    condensed: tuple[CondensedMap, ...]
    body: JoinedBodies | SingleBody
    problem: ContactProblem
    work: OperationCounts

    @property
    def units(self) -> Units:
        """The physical size of one dimensionless unit."""
        return self.prepared.units

    @property
    def solver(self) -> ContactSolver:
        """The solver."""
        return self.prepared.scene.solver

    @property
    def depth(self) -> float:
        """The thickness on which forces in results act, 1 if none is given; inside, all is per unit of thickness."""
        return self.prepared.scene.depth

    @property
    def has_body_forces(self) -> bool:
        """Whether something acts inside a body."""
        return any(body.inside is not None for body in self.prepared.bodies)

    def under(self, prepared: Prepared) -> Model:
        """Return the same bodies under other loads, obstacles, gaps and laws; nothing is factored again.

        Bodies are condensed again only if other nodes can touch, and a single one also if directions of contact or its
        motion far away change.

        Parameters
        ----------
        prepared : Prepared
            From `Prepared.under` of this model's.
        """
        elastic = _maps_under(prepared, self)
        if not self.condensed:
            return _single(prepared, elastic[0], self._single_under(prepared, elastic[0]))
        from bemkit.model.joined import condensed_under_step, joined_under

        condensed, work = condensed_under_step(prepared, self.prepared, elastic, self.condensed)
        joined = joined_under(prepared, self.prepared, self._joined_bodies, condensed)
        return Model(prepared, elastic, condensed, joined, _problem(prepared, joined), self.work + work)

    def _single_under(self, prepared: Prepared, elastic: SteklovPoincare) -> SingleBody:
        before, body = self.prepared, prepared.only
        if body.far_motion == before.only.far_motion and before.is_coupled_like(prepared):
            return self._single_body.under(body.force, body.conditions.displacement, body.inside)
        return single_body(prepared, elastic)

    @property
    def _single_body(self) -> SingleBody:
        return cast("SingleBody", self.body)

    @property
    def _joined_bodies(self) -> JoinedBodies:
        return cast("JoinedBodies", self.body)

    def between(self, before: Model, share: float) -> ContactProblem:
        """Return the problem at a share of the way from the loads and gaps of a step before to those of this model.

        Notes
        -----
        Condensed loads, relative displacements that supports prescribe, and gaps are affine in the data. So these are
        interpolated, and formulas are not evaluated again.
        """
        if share == 1.0:
            return self.problem
        body = self._joined_between(before, share) if self.condensed else self._single_between(before, share)
        return replace(self.problem, body=body, gap=blended(before.problem.gap, self.problem.gap, share))

    def _joined_between(self, before: Model, share: float) -> JoinedBodies:
        if not before.prepared.has_same_unknowns(self.prepared):
            before = before.under(self.prepared.with_loads_of(before.prepared))
        one, two = before._joined_bodies, self._joined_bodies
        members = zip(one.members, two.members, strict=True)
        loads = [blended(former.load, latter.load, share) for former, latter in members]
        return two.under(loads, blended(one.prescribed, two.prescribed, share))

    def _single_between(self, before: Model, share: float) -> SingleBody:
        one, two = before.prepared.only, self.prepared.only
        displacement = blended(one.conditions.displacement, two.conditions.displacement, share)
        force = blended(one.force, two.force, share)
        inside = two.inside if one.inside is None or two.inside is None else one.inside.blended(two.inside, share)
        if one.far_motion == two.far_motion:
            return self._single_body.under(force, displacement, inside)
        from bemkit.operators.half_plane.far_motion import FarMotion

        far_motion = (one.far_motion or FarMotion()).blended(two.far_motion or FarMotion(), share)
        conditions = replace(two.conditions, displacement=displacement)
        body = replace(two, far_motion=far_motion, conditions=conditions, force=force)
        return single_body(replace(self.prepared, bodies=(body,)), with_far_motion(self.elastic[0], far_motion))

    def acting(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return the forces of loads and supports on all bodies, and the displacements on which they work.

        On the nodes of all elastic bodies [N/m] and [m], on a half-plane also the forces that balance all others from
        far away on its motion there, then on the motions of rigid bodies.
        """
        prepared, forces, displacements = self.prepared, [np.zeros(0)], [np.zeros(0)]
        bodies = zip(prepared.bodies, self.elastic, self._beyond_contact(state), strict=True)
        for body, elastic, (displacement, force, total) in bodies:
            forces.append(supporting_forces(body.conditions, body.force, force) * prepared.force_unit)
            displacements.append(displacement.ravel() * prepared.units.displacement)
            if body.mesh.surface is not None:
                forces.append(-total.ravel() * prepared.force_unit)
                motion = displacement - elastic.own_fields(displacement, total)[0]
                displacements.append(motion.ravel() * prepared.units.displacement)
        rigid = self.rigid_bodies(state)
        forces += [reaction for _, reaction in rigid]
        displacements += [motion for motion, _ in rigid]
        return np.concatenate(forces), np.concatenate(displacements)

    def reactions(self, state: ContactState) -> list[FloatArray]:
        """Return the forces (n_nodes, 2) [N/m] of supports on all nodes of each body, in the axes of the scene."""
        reactions = []
        for body, (_, force, _) in zip(self.prepared.bodies, self._beyond_contact(state), strict=True):
            supports = replace(body.conditions, is_fixed=body.conditions.is_supported)
            held = supporting_forces(supports, np.zeros_like(force), force - body.force).reshape(-1, 2)
            reactions.append(np.asarray(body.turn.turned(held)) * self.prepared.force_unit)
        return reactions

    def condensed_map(self, number: int) -> CondensedMap | None:
        """Return the condensed map of a body, None where none is formed."""
        return self.condensed[number] if self.condensed else self._single_body.condensed

    def nodal_fields(self, state: ContactState) -> list[tuple[FloatArray, FloatArray]]:
        """Return displacement and total force (n_nodes, 2) of all nodes of each body, in its axes, dimensionless."""
        if not self.condensed:
            return [self._single_body.recover(state)]
        unknowns = self._joined_bodies.member_displacements(state)[: len(self.condensed)]  # rigid bodies come last
        return [
            condensed.recover(unknowns_of_body)
            for condensed, unknowns_of_body in zip(self.condensed, unknowns, strict=True)
        ]

    def _beyond_contact(self, state: ContactState) -> Iterator[tuple[FloatArray, FloatArray, FloatArray]]:
        """Yield displacement, all forces but those of contact, and all forces (n_nodes, 2) of each body."""
        pairs = zip(self._contact_forces(state), self.nodal_fields(state), strict=True)
        for of_contact, (displacement, force) in pairs:
            yield displacement, force - of_contact, force

    def _contact_forces(self, state: ContactState) -> list[FloatArray]:
        """Return the nodal forces (n_nodes, 2) of contact on each body, in its own axes, dimensionless."""
        prepared = self.prepared
        traction = state.traction * np.stack([np.ones(prepared.n_contact), ~prepared.is_on_line], axis=1)
        in_place = self.body.weights[:, None] * np.einsum("nk,nkc->nc", traction, prepared.frame)
        forces = [np.zeros((body.space.n_dofs // 2, 2)) for body in prepared.bodies]
        for rows, forces_of_rows in prepared.by_contact(in_place):
            rows.add_forces(forces_of_rows, forces)
        return [body.turn.turned_back(force) for body, force in zip(prepared.bodies, forces, strict=True)]

    def _forces_of_nodes(self, state: ContactState) -> FloatArray:
        """Return the forces (n_contact, 2) [N/m] of contact nodes on the bodies with these nodes, in x and y."""
        stress = self.prepared.units.stress * np.einsum("nk,nkc->nc", state.traction, self.prepared.frame)
        return np.asarray(self.prepared.column("weights")[:, None] * stress)

    def held_forces(self, state: ContactState) -> HeldForces:
        """Return the forces of contact at nodes that supports hold in both directions; `reactions` contain them."""
        prepared = self.prepared
        held = prepared.recovery.held_forces(self._forces_of_nodes(state))
        at_obstacles = [rows for rows in prepared.rows if rows.couplings is None]
        is_held = [
            bool(prepared.bodies[body].conditions.is_supported[node].all())
            and not any(rows.body == body and node in rows.nodes for rows in at_obstacles)
            for body, node in zip(held.bodies.tolist(), held.nodes.tolist(), strict=True)
        ]
        return HeldForces(*(column[np.array(is_held, bool)] for column in held))

    def boundary_fields(self, state: ContactState) -> list[tuple[FloatArray, FloatArray, float]]:
        """Return the physical fields of a contact state on the boundary of each body.

        Returns
        -------
        list of (displacement, traction, energy)
            (n_nodes, 2) [m]; (n_elements, n_local, 2) [Pa] at the local nodes of the traction space: given loads and
            contact tractions projected onto its functions, reactions of supports, and zero on the free boundary;
            elastic energy of the stresses in the plane [J/m], without heat 1/2 a(u, u).
        """
        prepared, units = self.prepared, self.prepared.units
        of_contacts: list[list[tuple[IntArray, FloatArray]]] = [[] for _ in prepared.bodies]
        for number, elements, values in prepared.recovery.tractions(self._forces_of_nodes(state)):
            of_contacts[number].append((elements, values))
        fields: list[tuple[FloatArray, FloatArray, float]] = []
        bodies = zip(prepared.bodies, self.elastic, self.nodal_fields(state), strict=True)
        for body, elastic, (displacement, force) in bodies:
            traction = elastic.element_tractions(displacement, force) * (prepared.force_unit / body.own_mesh.diameter)
            traction = np.array(body.turn.turned(traction))
            for elements, values in of_contacts[len(fields)]:
                traction[elements] = values
            touching = prepared.scene.touching_parts(body.body)
            insert_loads(traction, body.scene, body.mesh, body.traction_space, touching)
            energy = elastic_energy(elastic, body.own_space, displacement, force)
            energy *= prepared.force_unit * units.displacement
            fields.append((body.turn.turned(displacement) * units.displacement, traction, energy))
        return fields

    def rigid_bodies(self, state: ContactState) -> list[tuple[FloatArray, FloatArray]]:
        """Return motion (3,) [m, m, rad] and reaction (3,) [N/m, N/m, N m/m] of each rigid body in a contact state.

        The reaction is all that acts on it besides its contacts, about its centre: the given load, or the load that
        causes the given motion.
        """
        prepared, units = self.prepared, self.prepared.units
        if not prepared.scene.rigid or not self.condensed:
            return []
        unknowns = iter(self._joined_bodies.member_displacements(state)[len(prepared.bodies) :])
        reactions = np.zeros((len(prepared.scene.rigid), 3))
        for rows, tractions in prepared.by_contact(state.traction * units.stress):
            if rows.motions is not None:
                forces = rows.weights[:, None] * np.einsum("nk,nkc->nc", tractions, rows.frame)
                reactions[rows.other - len(prepared.bodies)] += np.einsum("nc,ncm->m", forces, rows.motions)
        bodies = []
        for body, reaction in zip(prepared.scene.rigid, reactions, strict=True):
            motion, is_load_controlled = body.motion, body.is_load_controlled
            if is_load_controlled.any():
                motion[is_load_controlled] = (
                    next(unknowns) * units.displacement / motion_units(units)[is_load_controlled]
                )
            bodies.append((motion, reaction))
        return bodies


def build_model(prepared: Prepared, executor: Executor | None = None) -> Model:
    """Assemble the operators of all bodies, and condense each onto its nodes in contact.

    Parameters
    ----------
    prepared : Prepared
    executor : Executor, optional
        Where bodies are assembled and factored, copies once; the factors are sent back. By default in this process, in
        turn.

    Raises
    ------
    FreeBodyError
        If nothing is in contact and the supports leave a rigid motion free, which the message names.
    NoContactNodesError
        If supports leave no node of the contact boundary free to move towards the obstacle.
    SingularMatrixError
        If supports and contacts, all sticking, do not hold a body; the message names it.
    NotSentError
        If a body cannot be sent to the executor, or this breaks down.
    """
    if is_single(prepared):
        return _single(prepared, *_single_of(prepared, executor))
    from bemkit.model.joined import for_copies, joined_bodies
    from bemkit.model.shapes import condensed_shapes

    shapes = condensed_shapes(prepared, executor)
    elastic = _loaded([shapes[number][0] for number in shape_numbers(prepared.bodies)], prepared.bodies)
    condensed = for_copies([of_shape for _, of_shape in shapes], prepared.bodies)
    n_unknowns = 2 * prepared.n_contact - int(np.count_nonzero(prepared.tangent_follows))
    work = sum((base.work for _, base in shapes), OperationCounts(contact_unknowns=n_unknowns))
    joined = joined_bodies(prepared, condensed)
    return Model(prepared, elastic, condensed, joined, _problem(prepared, joined), work)


def _single(prepared: Prepared, elastic: SteklovPoincare, body: SingleBody) -> Model:
    return Model(prepared, (elastic,), (), body, _problem(prepared, body), body.work)


def _single_of(prepared: Prepared, executor: Executor | None) -> tuple[SteklovPoincare, SingleBody]:
    """Return the map of the only body, and the body of the contact problem."""
    if executor is None:
        (elastic,) = _loaded([prepared.elastic_map(prepared.only)], prepared.bodies)
        return elastic, single_body(prepared, elastic)
    if not is_direct(prepared):
        raise InputError("executor is given, but the only body is not condensed onto contact nodes: remove it")
    from bemkit.model.shapes import condensed_shapes

    ((alone, condensed),) = condensed_shapes(prepared, executor)
    (elastic,) = _loaded([alone], prepared.bodies)
    return elastic, single_body(prepared, elastic, condensed)


def _loaded(maps: Sequence[SteklovPoincare], bodies: Sequence[PreparedBody]) -> tuple[SteklovPoincare, ...]:
    """Return the maps with the body forces of their bodies; copies under equal forces share one."""
    shared: dict[tuple[int, int], SteklovPoincare] = {}
    return tuple(
        shared.setdefault((id(map_), id(body.inside)), loaded_map(map_, body.inside))
        for map_, body in zip(maps, bodies, strict=True)
    )


def _maps_under(prepared: Prepared, model: Model) -> tuple[SteklovPoincare, ...]:
    """Return the maps of a model under the body forces and the motions far away of another step."""
    loaded = zip(model.elastic, model.prepared.bodies, strict=True)
    maps = [without_body_forces(map_, body.inside) for map_, body in loaded]
    pairs = zip(maps, model.prepared.bodies, prepared.bodies, strict=True)
    moved = [
        map_ if one.far_motion == two.far_motion else with_far_motion(map_, two.far_motion) for map_, one, two in pairs
    ]
    return _loaded(moved, prepared.bodies)


def _problem(prepared: Prepared, body: JoinedBodies | SingleBody) -> ContactProblem:
    units = prepared.units
    gap = prepared.column("gap") / units.displacement
    return ContactProblem(body, gap, prepared.law.scaled(units.stress))
