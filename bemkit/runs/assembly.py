"""Solve assemblies of several bodies: one, or several that follow each other in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.body import ContactState, SlipHistory
from bemkit.contact.solvability import UnsolvableLoad
from bemkit.errors import InputError
from bemkit.geometry.local_values import mean_tractions
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import dof_points
from bemkit.model.assembled.model import AssembledModel, build_assembled_model
from bemkit.model.assembled.prepared import PreparedAssembly, prepare_assembly_steps
from bemkit.model.assembled.turning import with_turning_checked
from bemkit.model.finite_sliding import with_sliding_checked
from bemkit.model.solved_contact import with_energies_checked
from bemkit.plan import Plan
from bemkit.plan.assembly_plan import plan_assembly
from bemkit.results.assembly_solution import AssemblySolution, BodyResult, SideName
from bemkit.results.contact_table import ContactTable, bound_at, find_transitions
from bemkit.results.part_forces import RigidResult, contact_forces, nodal_resultants
from bemkit.results.solution import BoundaryFields
from bemkit.results.solved_problem import SolvedSteps
from bemkit.results.warnings import find_warnings
from bemkit.runs.steps import Kind, joined, solved_history
from bemkit.scene.assembly import Assembly
from bemkit.solvers.base import ContactSolution, Status, StepRecord
from bemkit.stopwatch import Stage, StageClock


def run_assembly(
    assembly: Assembly,
    *,
    meshes: Mapping[str, BoundaryMesh] | None = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> AssemblySolution:
    """Solve an assembly on one mesh of each body.

    Parameters
    ----------
    assembly : Assembly
    meshes : mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes; by default those the assembly describes.
    callback : callable, optional
        Receives a record of every step as soon as it exists.
    executor : Executor, optional
        Where bodies are assembled and factored, copies once: a `ProcessPoolExecutor`, say, or that of a `distributed`
        client. By default here, in turn.

    Returns
    -------
    AssemblySolution
        Of a load history the last step, with the linear solves and records of all.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the first load.
    ValueError
        If the assembly is not well posed; the message names the body or the contact.
    """
    return joined(*solved_history(several_bodies(executor), [assembly], meshes, callback))


def run_assembly_history(
    assemblies: Sequence[Assembly],
    *,
    meshes: Mapping[str, BoundaryMesh] | None = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> SolvedSteps[AssemblySolution]:
    """Solve assemblies that follow each other in time, slip counting from the end of the step before.

    Every body is factored once for all steps. Where the jump to a load stalls, it is halved; see
    `bemkit.runs.load_path.reach`.

    Parameters
    ----------
    assemblies : sequence of Assembly
        The same bodies and contacts under changing loads, motions, gaps or laws; one with several steps or load factors
        is as many.
    meshes, callback, executor : optional
        As for `run_assembly`.

    Returns
    -------
    SolvedSteps
        A tuple of solutions, one for each step, up to the first that does not converge. If that is not the first one,
        its fields are those of the step before, the last state that is certified; status, message and history are its
        own.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the first load.
    """
    if not assemblies:
        raise InputError("assemblies is empty: give at least one assembly")
    return SolvedSteps(solved_history(several_bodies(executor), assemblies, meshes, callback)[1])


def _prepared(
    steps: Sequence[Assembly], meshes: Mapping[str, BoundaryMesh] | None
) -> tuple[tuple[PreparedAssembly, ...], Plan]:
    """Return load steps ready to solve, and their plan."""
    prepared = prepare_assembly_steps(steps, meshes)
    if not prepared[0].n_contact:
        raise InputError("no two bodies are in contact: list contacts, or solve each body as a scene of its own")
    return prepared, plan_assembly(prepared)


def _checked(model: AssembledModel, result: ContactSolution) -> ContactSolution:
    return with_sliding_checked(model, with_turning_checked(model, with_energies_checked(model, result)))


def _explained(model: AssembledModel, load: UnsolvableLoad) -> str:
    return f"{load.description}: hold what moves by a support, raise the friction, or change the loads"


def assembly_solution(
    model: AssembledModel, result: ContactSolution, plan: Plan, clock: StageClock, motion: SlipHistory | None = None
) -> AssemblySolution:
    """Turn what the driver found into the physical fields of all bodies; the slip is for laws that depend on it."""
    prepared = model.prepared
    law = prepared.law if motion is None else prepared.law.at_slip(motion)
    solved = model.boundary_fields(result.state)
    table = _contact_table(model, result.state, result.node_status)
    slip = table.u_t - model.problem.slip_origin * prepared.units.displacement
    transitions = find_transitions(table, slip)
    bodies = {}
    reactions = model.reactions(result.state)
    for body, (displacement, traction, energy), reaction in zip(prepared.bodies, solved, reactions, strict=True):
        space = body.scene.discretisation.traction_space(body.mesh)
        fields = BoundaryFields(
            dof_points(body.space),
            displacement,
            body.mesh.centres.copy(),
            mean_tractions(space, traction),
            traction.reshape(-1, 2),
            reaction,
        )
        bodies[body.name] = BodyResult(body.name, body.scene, body.mesh, fields, energy)
    rigid = {
        body.name: RigidResult(body.name, *reaction.tolist(), *motion.tolist())
        for body, (motion, reaction) in zip(prepared.assembly.rigid, model.rigid_bodies(result.state), strict=True)
    }
    clock = clock.closed(Stage.RECOVER)
    finite = all(np.isfinite(body.energy) and np.isfinite(body.boundary.displacement).all() for body in bodies.values())
    if result.is_converged and not finite:
        result = replace(result, status=Status.NOT_FINITE, message=Status.NOT_FINITE.value)
    solution = AssemblySolution(
        assembly=prepared.assembly,
        bodies=bodies,
        status=result.status,
        certificate=result.certificate,
        contact=table,
        contact_sides=_contact_sides(prepared),
        contact_directions=prepared.frame[:, 0].copy(),
        friction_bound=bound_at(table, law),
        contacts=contact_forces(table, nodal_resultants(table, prepared.frame, prepared.acting_at), transitions),
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        transitions=transitions,
        timings=clock.timings,
        memory=clock.memory,
        plan=plan,
        work=model.work,
        message=result.message,
        rigid=rigid,
    )
    return solution.with_warnings(find_warnings)


def _contact_sides(prepared: PreparedAssembly) -> dict[str, tuple[SideName, ...]]:
    """Return the sides of elastic bodies in each contact, first the one with the nodes."""
    sides = {pair.name: tuple(SideName(*each) for each in pair.elastic_parts) for pair in prepared.assembly.contacts}
    for rows in prepared.rows:
        with_nodes = SideName(prepared.bodies[rows.body].name, rows.part)
        sides[rows.name] = (with_nodes, *(side for side in sides.get(rows.name, ()) if side != with_nodes))
    return sides


def _contact_table(model: AssembledModel, state: ContactState, node_status: IntArray) -> ContactTable:
    prepared, units = model.prepared, model.prepared.units
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


def several_bodies(executor: Executor | None = None) -> Kind[AssembledModel, AssemblySolution]:
    """Return how several bodies are solved, assembled and factored on an executor if one is given."""
    build = partial(build_assembled_model, executor=executor)
    return Kind(_prepared, build, _checked, assembly_solution, _explained)


SEVERAL_BODIES = several_bodies()
