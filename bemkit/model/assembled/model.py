"""From a prepared assembly to a dimensionless contact problem, and back to physical fields of each body."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from bemkit.arrays import FloatArray, IntArray, blended
from bemkit.contact.body import ContactState
from bemkit.contact.joined.joined_bodies import JoinedBodies
from bemkit.contact.joined.member import Member, diagonal_blocks
from bemkit.contact.problem import ContactProblem
from bemkit.model.assembled.placed import PlacedBody, groups
from bemkit.model.assembled.prepared import PreparedAssembly
from bemkit.model.assembled.rigid import motion_units, rigid_members, rigid_motions
from bemkit.model.assembled.shapes import condensed_shapes
from bemkit.model.contact_model import elastic_energy, insert_loads
from bemkit.model.units import Units
from bemkit.operators.counts import OperationCounts
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside, HeavyElasticity, condensed_under
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions, free_modes, supporting_forces
from bemkit.solvers.base import ContactSolver


@dataclass(frozen=True, eq=False)
class AssembledModel:
    """A prepared assembly with the maps of its bodies, condensed and joined, and its contact problem.

    Parameters
    ----------
    prepared : PreparedAssembly
    elastic : tuple of SteklovPoincare
        Of each body; copies share theirs.
    condensed : tuple of CondensedMap
        Of each body; copies share their stiffness.
    body : JoinedBodies
    problem : ContactProblem
    work : OperationCounts
    """

    prepared: PreparedAssembly
    elastic: tuple[SteklovPoincare, ...]
    condensed: tuple[CondensedMap, ...]
    body: JoinedBodies
    problem: ContactProblem
    work: OperationCounts

    def under(self, prepared: PreparedAssembly) -> AssembledModel:
        """Return the same bodies under other loads, gaps and laws; nothing is factored again.

        Parameters
        ----------
        prepared : PreparedAssembly
            From `PreparedAssembly.under` of this model's.
        """
        condensed = tuple(
            map_ if _is_loaded_alike(prepared, self.prepared, number) else _under(map_, prepared, number)
            for number, map_ in enumerate(self.condensed)
        )
        maps = [map_.weightless if isinstance(map_, HeavyElasticity) else map_ for map_ in self.elastic]
        elastic = _loaded(maps, prepared.insides)
        offset = _offset(prepared)
        loads = [*(map_.load for map_ in condensed), *(member.load for member in rigid_members(prepared))]
        body = self.body.under(loads, offset)
        added = sum((condensed[group[0]].work for group in groups(prepared.bodies)), OperationCounts())
        return AssembledModel(prepared, elastic, condensed, body, _problem(prepared, body), self.work + added)

    @property
    def units(self) -> Units:
        """The physical size of one dimensionless unit."""
        return self.prepared.units

    @property
    def solver(self) -> ContactSolver:
        """The driver."""
        return self.prepared.assembly.solver

    @property
    def has_body_forces(self) -> bool:
        """Whether something acts inside a body."""
        return any(inside is not None for inside in self.prepared.insides)

    def between(self, before: AssembledModel, share: float) -> ContactProblem:
        """Return the problem at a share of the way from the loads and gaps of a step before to those of this model.

        Notes
        -----
        Condensed loads, relative displacements that supports prescribe, and gaps are affine in the data. So these are
        interpolated, and formulas are not evaluated again.
        """
        if share == 1.0:
            return self.problem
        pairs = zip(before.body.members, self.body.members, strict=True)
        loads = [blended(one.load, two.load, share) for one, two in pairs]
        body = self.body.under(loads, blended(before.body.offset, self.body.offset, share))
        return replace(self.problem, body=body, gap=blended(before.problem.gap, self.problem.gap, share))

    def acting(self, state: ContactState) -> tuple[FloatArray, FloatArray]:
        """Return the forces of loads and supports on all bodies, and the displacements on which they work.

        On the nodes of all elastic bodies [N/m] and [m], then on the motions of rigid bodies.
        """
        prepared, forces, displacements = self.prepared, [np.zeros(0)], [np.zeros(0)]
        bodies = zip(prepared.conditions, prepared.forces, self._beyond_contact(state), strict=True)
        for conditions, given, (displacement, force) in bodies:
            forces.append(supporting_forces(conditions, given, force) * prepared.force_unit)
            displacements.append(displacement.ravel() * prepared.units.displacement)
        rigid = self.rigid_bodies(state)
        forces += [reaction for _, reaction in rigid]
        displacements += [motion for motion, _ in rigid]
        return np.concatenate(forces), np.concatenate(displacements)

    def reactions(self, state: ContactState) -> list[FloatArray]:
        """Return the forces (n_nodes, 2) [N/m] of supports on all nodes of each body, in the axes of the scene."""
        prepared, reactions = self.prepared, []
        bodies = zip(prepared.bodies, prepared.conditions, prepared.forces, self._beyond_contact(state), strict=True)
        for body, conditions, given, (_, force) in bodies:
            held = supporting_forces(conditions, np.zeros_like(force), force - given).reshape(-1, 2)
            reactions.append(np.asarray(body.turn.turned(held)) * prepared.force_unit)
        return reactions

    def _beyond_contact(self, state: ContactState) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield displacement and all forces but those of contact (n_nodes, 2) of each body, in its own axes."""
        unknowns = self.body.member_displacements(state)[: len(self.condensed)]
        for of_contact, condensed, retained in zip(self._contact_forces(state), self.condensed, unknowns, strict=True):
            displacement, force = condensed.recover(retained)
            yield displacement, force - of_contact

    def _contact_forces(self, state: ContactState) -> list[FloatArray]:
        """Return the nodal forces (n_nodes, 2) of contact on each body, in its own axes, dimensionless."""
        bodies = self.prepared.bodies
        in_place = _coupling(self.prepared).T @ (self.body.weights[:, None] * state.traction).ravel()
        ends = np.cumsum([body.space.n_dofs for body in bodies])[:-1]
        by_body = np.split(in_place, ends)
        return [body.turn.turned_back(force.reshape(-1, 2)) for body, force in zip(bodies, by_body, strict=True)]

    def boundary_fields(self, state: ContactState) -> list[tuple[FloatArray, FloatArray, float]]:
        """Return the physical fields of a contact state on the boundary of each body.

        Returns
        -------
        list of (displacement, traction, energy)
            (n_nodes, 2) [m]; (n_elements, n_local, 2) [Pa] at the local nodes of the traction space; elastic energy
            1/2 a(u, u) [J/m].
        """
        prepared, units = self.prepared, self.prepared.units
        in_place = prepared.column("weights")[:, None] * np.einsum("nk,nkc->nc", state.traction, prepared.frame)
        of_contacts: list[list[tuple[IntArray, FloatArray]]] = [[] for _ in prepared.bodies]
        for number, elements, values in prepared.spread.tractions(units.stress * in_place):
            of_contacts[number].append((elements, values))
        fields: list[tuple[FloatArray, FloatArray, float]] = []
        unknowns = self.body.member_displacements(state)[: len(self.condensed)]
        bodies = zip(prepared.bodies, self.elastic, self.condensed, unknowns, strict=True)
        for body, elastic, condensed, retained in bodies:
            displacement, force = condensed.recover(retained)
            traction = elastic.element_tractions(displacement, force) * (prepared.force_unit / body.own_mesh.diameter)
            traction = np.array(body.turn.turned(traction))
            traction_space = body.scene.discretisation.traction_space(body.mesh)
            for elements, values in of_contacts[len(fields)]:
                traction[elements] = values
            touching = prepared.assembly.contact_parts(body.body)
            insert_loads(traction, body.scene, body.mesh, traction_space, touching)
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
        unknowns = iter(self.body.member_displacements(state)[len(prepared.bodies) :])
        traction, begin = state.traction * units.stress, 0
        reactions = np.zeros((len(prepared.assembly.rigid), 3))
        for rows in prepared.rows:
            if isinstance(rows.on_other, np.ndarray):
                tractions = traction[begin : begin + rows.n_contact]
                forces = rows.weights[:, None] * np.einsum("nk,nkc->nc", tractions, rows.frame)
                reactions[rows.other - len(prepared.bodies)] += np.einsum("nc,ncm->m", forces, rows.on_other)
            begin += rows.n_contact
        bodies = []
        for body, reaction in zip(prepared.assembly.rigid, reactions, strict=True):
            motion, is_driven = body.motion, body.is_driven
            if is_driven.any():
                motion[is_driven] = next(unknowns) * units.displacement / motion_units(units)[is_driven]
            bodies.append((motion, reaction))
        return bodies


def build_assembled_model(prepared: PreparedAssembly, executor: Executor | None = None) -> AssembledModel:
    """Assemble the operators of all bodies, and condense each onto its nodes in contact.

    Parameters
    ----------
    prepared : PreparedAssembly
    executor : Executor, optional
        Where bodies are assembled and factored, copies once; the factors are sent back. By default in this process, in
        turn.

    Raises
    ------
    SingularMatrixError
        If supports and contacts, all sticking, do not hold a body; the message names it.
    NotSentError
        If a body cannot be sent to the executor, or this breaks down.
    """
    bodies, firsts = prepared.bodies, _firsts(prepared.bodies)
    shapes = iter(condensed_shapes(prepared, executor))
    elastic: list[SteklovPoincare] = []
    condensed: list[CondensedMap] = []
    work = OperationCounts()
    for number, first in enumerate(firsts):
        if first < number:
            elastic.append(elastic[first])
            condensed.append(_under(condensed[first], prepared, number))
            continue
        map_, base = next(shapes)
        elastic.append(map_)
        condensed.append(base)
        work += base.work
    motions = [_motions(*pair) for pair in zip(bodies, prepared.conditions, strict=True)]
    members = tuple(
        Member(
            stiffness=condensed[first].stiffness,
            load=map_.load,
            motions=motions[first],
            modulus=body.material.plane_modulus / prepared.units.modulus,
            name=body.name,
        )
        for map_, body, first in zip(condensed, bodies, firsts, strict=True)
    )
    joined = JoinedBodies(
        members=(*members, *rigid_members(prepared)),
        relative=_relative(prepared),
        offset=_offset(prepared),
        weights=prepared.column("weights") / prepared.units.length,
        tangent_follows=prepared.tangent_follows,
    )
    n_following = int(np.count_nonzero(prepared.tangent_follows))
    work += OperationCounts(contact_unknowns=2 * prepared.n_contact - n_following)
    loaded_maps = _loaded(elastic, prepared.insides)
    return AssembledModel(prepared, loaded_maps, tuple(condensed), joined, _problem(prepared, joined), work)


def _loaded(maps: Sequence[SteklovPoincare], insides: Sequence[ForcesInside | None]) -> tuple[SteklovPoincare, ...]:
    """Return the maps with the body forces of their bodies; copies under equal forces share one."""
    shared: dict[tuple[int, int], SteklovPoincare] = {}
    return tuple(
        shared.setdefault((id(map_), id(inside)), map_ if inside is None else HeavyElasticity(map_, inside))
        for map_, inside in zip(maps, insides, strict=True)
    )


def _under(condensed: CondensedMap, prepared: PreparedAssembly, number: int) -> CondensedMap:
    """Return a condensed map under the loads of a body."""
    conditions, force = prepared.conditions[number], prepared.forces[number]
    return condensed_under(condensed, conditions, force, prepared.insides[number])


def _firsts(bodies: Sequence[PlacedBody]) -> list[int]:
    """Return for each body the first one that shares its mesh."""
    first_of: dict[int, int] = {}
    return [first_of.setdefault(id(body.own_mesh), number) for number, body in enumerate(bodies)]


def _problem(prepared: PreparedAssembly, body: JoinedBodies) -> ContactProblem:
    units = prepared.units
    gap = prepared.column("gap") / units.displacement
    return ContactProblem(body, gap, prepared.law.scaled(units.stress))


def _motions(body: PlacedBody, conditions: NodalConditions) -> FloatArray:
    """Return the rigid motions (n_motions, n_retained) that no support resists."""
    motions = free_modes(body.own_space, conditions)
    along = np.einsum("nkc,mnc->mnk", conditions.frame, motions)
    return np.asarray(along[:, conditions.is_retained])


def _nodal(body: PlacedBody, conditions: NodalConditions) -> sparse.csr_array:
    """Return how retained displacements move nodes in the axes of the scene, sparse (2 n_nodes, n_retained)."""
    directions = body.turn.turned(conditions.frame)  # (n_nodes, 2, 2): rows are vectors
    node, k = np.nonzero(conditions.is_retained)
    vectors = directions[node, k]
    rows = 2 * node[:, None] + np.arange(2)
    columns = np.broadcast_to(np.arange(node.size)[:, None], rows.shape)
    shape = (2 * len(directions), node.size)
    return sparse.csr_array((vectors.ravel(), (rows.ravel(), columns.ravel())), shape)


def _prescribed(body: PlacedBody, conditions: NodalConditions) -> FloatArray:
    """Return the displacements (2 n_nodes,) that supports prescribe, in the axes of the scene."""
    fixed = np.where(conditions.is_fixed, conditions.displacement, 0.0)
    return np.asarray(np.einsum("nkc,nk->nc", body.turn.turned(conditions.frame), fixed)).ravel()


def _frames(prepared: PreparedAssembly) -> sparse.csr_array:
    """Return the matrix from displacements in x and y at the contact nodes to (n, t) components.

    On a symmetry line the images of both bodies cancel what is left of the tangential component.
    """
    n, frame = prepared.n_contact, prepared.frame.copy()
    frame[prepared.is_on_line, 1] = 0.0
    return sparse.csr_array(sparse.bsr_array((frame, np.arange(n), np.arange(n + 1)), shape=(2 * n, 2 * n)))


def _coupling(prepared: PreparedAssembly) -> sparse.csr_array:
    """Return how the nodes of all bodies move the contact nodes, (2 n_contact, 2 n_nodes), in (n, t) components."""
    n_nodes = [body.space.n_dofs // 2 for body in prepared.bodies]
    first = np.concatenate([[0], np.cumsum(n_nodes)])
    data, row, column, begin = [np.zeros(0)], [np.zeros(0, np.intp)], [np.zeros(0, np.intp)], 0
    for rows in prepared.rows:
        for sign, number, on_nodes in ((1.0, rows.body, rows.on_body), (-1.0, rows.other, rows.on_other)):
            if isinstance(on_nodes, sparse.csr_array):
                data.append(sign * on_nodes.data)
                row.append(begin + np.repeat(np.arange(rows.n_contact), np.diff(on_nodes.indptr)))
                column.append(first[number] + on_nodes.indices)
        begin += rows.n_contact
    entries = np.concatenate(data), (np.concatenate(row), np.concatenate(column))
    difference = sparse.csr_array(entries, (begin, int(first[-1])))
    return sparse.csr_array(_frames(prepared) @ sparse.kron(difference, sparse.eye_array(2), format="csr"))


def _rigid_coupling(prepared: PreparedAssembly) -> sparse.csr_array:
    """Return how the motions of all rigid bodies move the contact nodes, (2 n_contact, 3 n_rigid)."""
    n_elastic, n_rigid = len(prepared.bodies), len(prepared.assembly.rigid)
    by_motions, begin = np.zeros((prepared.n_contact, 2, n_rigid, 3)), 0
    for rows in prepared.rows:
        if isinstance(rows.on_other, np.ndarray):
            dimensionless = rows.on_other / motion_units(prepared.units)
            by_motions[begin : begin + rows.n_contact, :, rows.other - n_elastic] = -dimensionless
        begin += rows.n_contact
    return sparse.csr_array(_frames(prepared) @ sparse.csr_array(by_motions.reshape(2 * begin, 3 * n_rigid)))


def _relative(prepared: PreparedAssembly) -> sparse.csr_array:
    """Return how the retained displacements of all bodies move the contact nodes, (2 n_contact, n_retained)."""
    nodal = [_nodal(*pair) for pair in zip(prepared.bodies, prepared.conditions, strict=True)]
    relative = sparse.csr_array(_coupling(prepared) @ diagonal_blocks(nodal))
    if prepared.assembly.rigid:
        chosen = [rigid_motions(body, prepared.units)[0] for body in prepared.assembly.rigid]
        driven = _rigid_coupling(prepared) @ diagonal_blocks(chosen)
        relative = sparse.csr_array(sparse.hstack([relative, driven], format="csr"))
    relative.eliminate_zeros()
    return relative


def _offset(prepared: PreparedAssembly) -> FloatArray:
    """Return the relative displacements (2 n_contact,) that supports and motions of rigid bodies prescribe."""
    offset = np.zeros(2 * prepared.n_contact)
    prescribed = [_prescribed(*pair) for pair in zip(prepared.bodies, prepared.conditions, strict=True)]
    if any(displacement.any() for displacement in prescribed):
        offset += _coupling(prepared) @ np.concatenate(prescribed)
    if prepared.assembly.rigid:
        motions = [rigid_motions(body, prepared.units)[1] for body in prepared.assembly.rigid]
        offset += _rigid_coupling(prepared) @ np.concatenate(motions)
    return offset


def _is_loaded_alike(prepared: PreparedAssembly, other: PreparedAssembly, number: int) -> bool:
    """Return whether loads, body forces and prescribed displacements of a body are the same objects in two steps."""
    data, other_data = (
        (step.forces[number], step.insides[number], step.conditions[number].displacement) for step in (prepared, other)
    )
    return all(one is two for one, two in zip(data, other_data, strict=True))
