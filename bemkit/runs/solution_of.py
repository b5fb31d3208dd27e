"""From the state of a solver to a solution: physical fields, contact table, forces, transitions and warnings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.errors import ResultWarning
from bemkit.geometry.local_values import mean_tractions
from bemkit.geometry.spaces import dof_points
from bemkit.model.fields import HeldForces
from bemkit.model.model import Model
from bemkit.model.solved_contact import contact_warnings
from bemkit.plan.plan import Plan
from bemkit.results.contact_table import ContactTable, bound_at, free_contacts
from bemkit.results.part_forces import PartForce, RigidResult, contact_forces, forces_on_parts, nodal_resultant
from bemkit.results.solution import Solution
from bemkit.results.solved_body import BoundaryFields, SideName, SolvedBody
from bemkit.results.solved_scene import place_in
from bemkit.results.transitions import find_transitions
from bemkit.results.warnings import find_warnings
from bemkit.scene.unit_names import amount
from bemkit.solvers.base import ContactSolution, Status
from bemkit.stopwatch import Stage, StageClock

if TYPE_CHECKING:
    from bemkit.model.prepared import Prepared

LARGEST_APART = 1.0
"""Largest distance of sides that touch, relative to the displacement by contact forces. Mortar conditions hold in the
mean: curved sides of long elements fulfil them at a distance."""


def solution_of(
    model: Model, result: ContactSolution, plan: Plan, clock: StageClock, motion: SlipHistory | None = None
) -> Solution:
    """Return the solution of a contact state; the slip is for laws that depend on it."""
    prepared = model.prepared
    state, node_status = result.state, result.node_status
    solved, reactions, depth = model.boundary_fields(state), model.reactions(state), model.depth
    held = model.held_forces(state)
    for number, node, force in zip(held.bodies, held.nodes, held.forces, strict=True):
        reactions[number][node] -= force
    table = _contact_table(model, state, node_status)
    displacements = [displacement for displacement, _, _ in solved]
    of_contact = contact_warnings(model, displacements, node_status) if result.is_converged else ()
    fields = [
        BoundaryFields(
            dof_points(body.space),
            displacement,
            body.mesh.centres.copy(),
            mean_tractions(body.traction_space, traction),
            traction.reshape(-1, 2),
            depth * reaction,
        )
        for body, (displacement, traction, _), reaction in zip(prepared.bodies, solved, reactions, strict=True)
    ]
    clock = clock.closed(Stage.RECOVER)
    finite = (np.isfinite(each).all() for own in solved for each in own)
    if result.is_converged and not all(finite):
        result = replace(result, status=Status.NOT_FINITE, message=Status.NOT_FINITE.value)
    law = prepared.law if motion is None else prepared.law.at_slip(motion)
    sides = _contact_sides(prepared)
    resultants = _resultants(prepared, table, held)
    on_first = [_on_first_side(own, sides[own[0].name]) for own in resultants]
    on_parts = forces_on_parts(
        pair
        for own in resultants
        for pair in zip(sides[own[0].name], own, strict=False)  # no side of a rigid body
    )
    on_sides = [(prepared.bodies[rows.body].mesh, rows.part) for rows in prepared.rows]
    lengths = [float(mesh.lengths[mesh.part(part)].sum()) for mesh, part in on_sides]
    transitions = find_transitions(table, table.u_t - model.problem.slip_origin * model.units.displacement)
    return Solution(
        scene=prepared.scene,
        bodies={
            body.name: SolvedBody(body.name, body.scene, body.mesh, own, depth * energy, on_parts.get(body.name, {}))
            for body, own, (_, _, energy) in zip(prepared.bodies, fields, solved, strict=True)
        },
        contact_sides=sides,
        contact_directions=prepared.frame[:, 0].copy(),
        friction_bound=bound_at(table, law),
        contacts=contact_forces(table, depth, on_first, lengths, transitions, _along_contacts(prepared, table, held)),
        rigid={
            body.name: RigidResult(body.name, *(depth * reaction).tolist(), *moved.tolist())
            for body, (moved, reaction) in zip(prepared.scene.rigid, model.rigid_bodies(state), strict=True)
        },
        status=result.status,
        certificate=result.certificate,
        contact=table,
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        transitions=transitions,
        timings=clock.timings,
        memory=clock.memory,
        plan=plan,
        work=model.work,
        message=result.message,
        warnings_of=partial(_warnings, of_contact),
    )


def _resultants(prepared: Prepared, table: ContactTable, held: HeldForces) -> list[list[PartForce]]:
    """Return the resultants of each contact with nodes on its elastic sides, first on the one with the nodes.

    Those at nodes that supports hold belong to contacts with fixed obstacles.
    """
    traction = np.stack([table.sigma_n, table.sigma_t], axis=1)
    areas = prepared.scene.depth * table.weight
    forces = np.einsum("nk,nkc->nc", areas[:, None] * traction, prepared.frame)
    resultants = []
    for rows, own in prepared.by_contact(forces):
        signed = zip((own, -own), rows.acting_at(prepared.bodies), strict=False)  # a rigid partner has no points
        resultants.append([nodal_resultant(rows.name, each, points) for each, points in signed])
    for number, node, name, force in zip(*held[:2], _contacts_of(prepared, held), held.forces, strict=True):
        own = next(each for each in resultants if each[0].name == name)
        point = dof_points(prepared.bodies[number].space)[node]
        own[0] += nodal_resultant(name, prepared.scene.depth * force[None], point[None])
    return resultants


def _contacts_of(prepared: Prepared, held: HeldForces) -> list[str]:
    """Return the contact of each held node."""
    return [prepared.names[neighbour] for neighbour in held.neighbours.tolist()]


def _along_contacts(prepared: Prepared, table: ContactTable, held: HeldForces) -> dict[str, FloatArray]:
    """Return normal and tangential force [N/m] and closed length [m] at held nodes, (3,) by contact.

    Directions and statuses are those of the contact nodes beside them.
    """
    along = np.einsum("nkc,nc->nk", prepared.frame[held.neighbours], held.forces)
    lengths = np.where(table.is_closed[held.neighbours], held.lengths, 0.0)
    sums: dict[str, FloatArray] = {}
    for name, values in zip(_contacts_of(prepared, held), np.column_stack([along, lengths]), strict=True):
        sums[name] = sums.get(name, np.zeros(3)) + values
    return sums


def _on_first_side(own: Sequence[PartForce], sides: Sequence[SideName]) -> PartForce:
    """Return the resultant of a contact on the first elastic side of its name, whichever side has the nodes."""
    is_second = len(own) > 1 and own[0].name.startswith(f"{sides[1].body}.{sides[1].part} / ")
    return own[1] if is_second else own[0]


def _contact_sides(prepared: Prepared) -> dict[str, tuple[SideName, ...]]:
    """Return the sides of elastic bodies in each contact, first the one with the nodes."""
    sides = {pair.name: tuple(SideName(*each) for each in pair.elastic_parts) for pair in prepared.scene.contacts}
    for rows in prepared.rows:
        with_nodes = SideName(prepared.bodies[rows.body].name, rows.part)
        sides[rows.name] = (with_nodes, *(side for side in sides.get(rows.name, ()) if side != with_nodes))
    return sides


def _warnings(of_contact: tuple[ResultWarning, ...], solution: Solution) -> tuple[ResultWarning, ...]:
    """Return the warnings about a solution, last those about its contact."""
    return (*find_warnings(solution), *of_contact)


def _contact_table(model: Model, state: ContactState, node_status: IntArray) -> ContactTable:
    prepared, units = model.prepared, model.units
    displacement = state.displacement * units.displacement
    points, gap = prepared.column("points"), prepared.column("gap")
    return ContactTable(
        part=prepared.names,
        x=points[:, 0].copy(),
        y=points[:, 1].copy(),
        s=prepared.column("arc_length"),
        u_n=displacement[:, 0].copy(),
        u_t=displacement[:, 1].copy(),
        sigma_n=state.sigma_n * units.stress,
        sigma_t=state.sigma_t * units.stress,
        gap=gap,
        clearance=gap - displacement[:, 0],
        status=np.asarray(node_status).copy(),
        weight=prepared.column("weights"),
    )


def with_missed_contact_named(solution: Solution) -> Solution:
    """Return the same solution, with the status MISSED_CONTACT if the mesh does not find the contact.

    A contact without any force overlaps between its nodes, one with a force at a few nodes is much deeper between them
    than forces move the bodies, or sides that touch nowhere have a force.
    """
    if not solution.is_converged:
        return solution
    if solution.unfound_contacts:
        name, place = next(iter(solution.unfound_contacts.items()))
        between = solution.narrow_contacts_between_nodes[name]
        depth = amount(between.penetration_depth, "length", solution.units, 2)
        words = f"Contact {name!r} overlaps by {depth} at {place_in(solution, place)}."
    elif apart := _pressed_apart(solution):
        words = f"Contact {apart[0]!r} has a force, but its sides touch nowhere."
    else:
        return solution
    message = f"{Status.MISSED_CONTACT.value} {words}"
    return replace(solution, status=Status.MISSED_CONTACT, message=message)


def _pressed_apart(solution: Solution) -> list[str]:
    """Return the contacts between elastic bodies with a force whose sides touch nowhere."""
    free = free_contacts(solution.contact)
    return [
        name
        for name, each in solution.narrow_contacts_between_nodes.items()
        if name not in free and solution.n_sides(name) > 1 and each.apart > LARGEST_APART
    ]
