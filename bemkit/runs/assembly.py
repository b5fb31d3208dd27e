"""Solve assemblies of several bodies: one, or several that follow each other in time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from bemkit.arrays import IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.solvability import find_unsolvable_load
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import dof_points
from bemkit.model.assembled.energies import with_energies_checked
from bemkit.model.assembled.model import AssembledModel, build_assembled_model
from bemkit.model.assembled.prepared import prepare_assembly_steps
from bemkit.model.boundary_tractions import mean_tractions
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.stopwatch import assembly_time
from bemkit.plan import Plan, check_memory
from bemkit.plan.assembly_plan import plan_assembly
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.contact_table import ContactTable, bound_at, find_transitions
from bemkit.results.part_forces import contact_forces, nodal_resultants
from bemkit.results.rigid_result import RigidResult
from bemkit.results.solution import BoundaryFields, as_one
from bemkit.results.warnings import find_assembly_warnings
from bemkit.runs.history import UnsolvableSceneError
from bemkit.runs.load_increments import reach_load
from bemkit.runs.timing import Stage, StageClock
from bemkit.scene.assembly import Assembly
from bemkit.scene.load_history import load_steps
from bemkit.solvers.base import ContactSolution, Status, StepRecord, solve


def run_assembly(
    assembly: Assembly,
    *,
    meshes: Mapping[str, BoundaryMesh] | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> AssemblySolution:
    """Solve an assembly on one mesh of each body.

    Parameters
    ----------
    assembly : Assembly
    meshes : mapping of str to BoundaryMesh, optional
        Meshes of bodies by name, in the coordinates of their shapes; by default those the assembly describes.
    callback : callable, optional
        Receives a record of every step as soon as it exists.

    Returns
    -------
    AssemblySolution
        Of a load history the last step, with the linear solves and records of all; its assembly has the load factors
        that were reached.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the first load.
    ValueError
        If the assembly is not well posed; the message names the body or the contact.
    """
    steps = run_assembly_history([assembly], meshes=meshes, callback=callback)
    n_steps = len(assembly.load_factors)
    if n_steps == 1:
        return steps[0]
    n_reached = max(1, sum(step.is_converged for step in steps))
    stated = replace(steps[0].assembly, bodies=assembly.bodies, load_factors=assembly.load_factors[:n_reached])
    bodies = {
        body.name: replace(body, scene=stated.scene_of(placed))
        for body, placed in zip(steps[-1].bodies.values(), stated.placed_bodies, strict=True)
    }
    return replace(as_one(steps, n_steps), assembly=stated, bodies=bodies)


def run_assembly_history(
    assemblies: Sequence[Assembly],
    *,
    meshes: Mapping[str, BoundaryMesh] | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> tuple[AssemblySolution, ...]:
    """Solve assemblies that follow each other in time, slip counting from the end of the step before.

    Every body is factored once for all steps. Where the jump to a load stalls, it is gone in halves; see
    `bemkit.runs.load_increments.reach_load`.

    Parameters
    ----------
    assemblies : sequence of Assembly
        The same bodies and contacts under changing loads, motions, gaps or laws; one with several load factors stands
        for as many steps.
    meshes, callback : optional
        As for `run_assembly`.

    Returns
    -------
    tuple of AssemblySolution
        One for each step, up to the first that does not converge. If that is not the first one, its fields are those
        of the step before, the last state that is certified; status, message and history are its own.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the first load.
    """
    scenes = [step for each in assemblies for step in load_steps(each)]
    if not scenes:
        raise InputError("assemblies is empty: give at least one assembly")
    clock = StageClock.start()
    steps = prepare_assembly_steps(scenes, meshes)
    if not steps[0].n_contact:
        raise InputError("no two bodies are in contact: list contacts, or solve each body as a scene of its own")
    plan = plan_assembly(steps)
    check_memory(plan)
    clock = clock.closed(Stage.MESH)
    with blas_threads_for(max(body.space.n_dofs for body in steps[0].bodies)):
        with assembly_time() as assembly:
            model = build_assembled_model(steps[0])
        clock = clock.closed_build(assembly)
        result = with_energies_checked(model, _first_solved(model, callback=callback))
        clock = clock.closed(Stage.SOLVE)
        solutions = [_solution(model, result, plan, clock)]
        for step in steps[1:]:
            if not result.is_converged:
                break
            clock = StageClock.start()
            before, model = model, model.under(step)
            clock = clock.closed(Stage.CONDENSE)
            reached = reach_load(before, model, result.state, callback)
            model = replace(model, problem=reached.problem)
            result = with_energies_checked(model, reached.result)
            clock = clock.closed(Stage.SOLVE)
            is_there = result.is_converged
            solutions.append(
                _solution(model, result, plan, clock) if is_there else _not_reached(solutions[-1], result, clock)
            )
    return tuple(solutions)


def solved_assembly(
    model: AssembledModel, plan: Plan, clock: StageClock, start: ContactState | None = None
) -> tuple[AssemblySolution, ContactState]:
    """Solve a model under a single load; return the physical fields, and the state that others may start from."""
    result = with_energies_checked(model, _first_solved(model, start))
    return _solution(model, result, plan, clock.closed(Stage.SOLVE)), result.state


def _first_solved(
    model: AssembledModel, start: ContactState | None = None, callback: Callable[[StepRecord], None] | None = None
) -> ContactSolution:
    solver = model.prepared.assembly.solver
    result = solve(model.problem, solver, start=start, throw=False, callback=callback)
    if not result.history:
        load = find_unsolvable_load(model.problem) if result.status is Status.UNSOLVABLE_LOAD else None
        remedy = "hold what moves by a support, raise the friction, or change the loads"
        raise UnsolvableSceneError(result.message if load is None else f"{load.description}: {remedy}")
    return result


def _not_reached(before: AssemblySolution, result: ContactSolution, clock: StageClock) -> AssemblySolution:
    """Return what stands for a step that failed: the fields of the step before, and why they are the last."""
    return replace(
        before,
        status=result.status,
        message=f"{result.message} The fields are those of the step before.",
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        timings=clock.timings,
        memory=clock.memory,
        warnings=before.plan.warnings,
    )


def _solution(model: AssembledModel, result: ContactSolution, plan: Plan, clock: StageClock) -> AssemblySolution:
    prepared = model.prepared
    table = _contact_table(model, result.state, result.node_status)
    slip = table.u_t - model.problem.slip_origin * prepared.units.displacement
    transitions = find_transitions(table, slip)
    bodies = {}
    for body, (displacement, traction, energy) in zip(
        prepared.bodies, model.boundary_fields(result.state), strict=True
    ):
        space = body.scene.discretisation.traction_space(body.mesh)
        fields = BoundaryFields(
            dof_points(body.space),
            displacement,
            body.mesh.centres.copy(),
            mean_tractions(space, traction),
            traction.reshape(-1, 2),
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
        contact_directions=prepared.frame[:, 0].copy(),
        friction_bound=bound_at(table, prepared.law),
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
    return replace(solution, warnings=find_assembly_warnings(solution))


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
