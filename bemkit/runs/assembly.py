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
from bemkit.model.assembled.prepared import prepare_assembly
from bemkit.model.boundary_tractions import mean_tractions
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.stopwatch import assembly_time
from bemkit.plan import Plan, check_memory
from bemkit.plan.assembly_plan import plan_assembly
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.contact_table import ContactTable, bound_at, find_transitions
from bemkit.results.part_forces import contact_forces, nodal_resultants
from bemkit.results.solution import BoundaryFields
from bemkit.results.warnings import find_assembly_warnings
from bemkit.runs.history import UnsolvableSceneError
from bemkit.runs.timing import Stage, StageClock
from bemkit.scene.assembly import Assembly
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

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the loads.
    ValueError
        If the assembly is not well posed; the message names the body or the contact.
    """
    return run_assembly_history([assembly], meshes=meshes, callback=callback)[0]


def run_assembly_history(
    assemblies: Sequence[Assembly],
    *,
    meshes: Mapping[str, BoundaryMesh] | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> tuple[AssemblySolution, ...]:
    """Solve assemblies that follow each other in time, slip counting from the end of the step before.

    Every body is factored once for all steps.

    Parameters
    ----------
    assemblies : sequence of Assembly
        The same bodies and contacts under changing loads, gaps or laws.
    meshes, callback : optional
        As for `run_assembly`.

    Returns
    -------
    tuple of AssemblySolution
        One for each step, up to the first that does not converge.
    """
    if not assemblies:
        raise InputError("assemblies is empty: give at least one assembly")
    clock = StageClock.start()
    prepared = prepare_assembly(assemblies[0], meshes)
    if not prepared.n_contact:
        raise InputError("no two bodies are in contact: list contacts, or solve each body as a scene of its own")
    steps = [prepared, *(prepared.under(_like(each, prepared.assembly)) for each in assemblies[1:])]
    plan = plan_assembly(steps)
    check_memory(plan)
    clock = clock.closed(Stage.MESH)
    solutions: list[AssemblySolution] = []
    with blas_threads_for(max(body.space.n_dofs for body in prepared.bodies)):
        with assembly_time() as assembly:
            model = build_assembled_model(prepared)
        clock = clock.closed_build(assembly)
        state: ContactState | None = None
        for step in steps:
            if state is not None:
                model = model.under(step)
                model = replace(model, problem=replace(model.problem, reference_slip=state.u_t))
                clock = clock.closed(Stage.CONDENSE)
            result = with_energies_checked(model, _solved(model, state, callback))
            clock = clock.closed(Stage.SOLVE)
            solutions.append(_solution(model, result, plan, clock))
            clock = StageClock.start()
            state = result.state
            if not result.is_converged:
                break
    return tuple(solutions)


def _like(assembly: Assembly, first: Assembly) -> Assembly:
    """Return an assembly with the contacts that were found in the first one."""
    return assembly.with_contacts(first.contacts) if assembly.touching else assembly


def _solved(
    model: AssembledModel, start: ContactState | None, callback: Callable[[StepRecord], None] | None
) -> ContactSolution:
    solver = model.prepared.assembly.solver
    result = solve(model.problem, solver, start=start, throw=False, callback=callback)
    if not result.history:
        load = find_unsolvable_load(model.problem) if result.status is Status.UNSOLVABLE_LOAD else None
        remedy = "hold what moves by a support, raise the friction, or change the loads"
        raise UnsolvableSceneError(result.message if load is None else f"{load.description}: {remedy}")
    return result


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
