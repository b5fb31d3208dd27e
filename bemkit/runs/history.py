"""Solve scenes that follow each other in time on one mesh: from what the user states to certified results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import ContactState
from bemkit.contact.slip_history import SlipHistory
from bemkit.contact.solvability import find_unsolvable_load
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import dof_points
from bemkit.model.boundary_tractions import mean_tractions
from bemkit.model.contact_model import Model, build_model
from bemkit.model.energy import with_energy_checked
from bemkit.model.free_motion import describe
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.model.solved_contact import contact_warnings, with_held_friction
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.operators.stopwatch import assembly_time
from bemkit.plan import Plan, announce_plan, check_elements, check_memory, plan_steps
from bemkit.results.contact_table import ContactTable, find_transitions
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.solved_steps import SolvedSteps
from bemkit.results.warnings import find_warnings
from bemkit.runs.steps import History, Kind, joined, solve_steps
from bemkit.runs.steps import UnsolvableSceneError as UnsolvableSceneError
from bemkit.runs.timing import Stage, StageClock
from bemkit.runs.warm_start import state_on
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import NoContactError, Scene
from bemkit.solvers.base import ContactSolution, Status, StepRecord


def run_history(
    scenes: Sequence[Scene],
    *,
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> SolvedSteps[Solution]:
    """Solve scenes that follow each other in time, slip counting from the end of the step before.

    The body is factored once for all steps. Where the jump to a load fails, it is gone in halves; see
    `bemkit.runs.load_path.reach`.

    Parameters
    ----------
    scenes : sequence of Scene
        One body under changing loads, obstacles or laws; a scene with several steps or load factors stands for as many.
    mesh, start, callback : optional
        As for `run`.

    Returns
    -------
    SolvedSteps
        A tuple of solutions, one for each step, up to the first that does not converge. If that is not the first one,
        its fields are those of the step before, the last state that is certified; status, message and history are its
        own.

    Raises
    ------
    UnsolvableSceneError, ValueError
        As for `run`, also if the scenes differ by more than numbers.
    """
    return SolvedSteps(solved_history(scenes, mesh, start, callback)[1])


def solved_history(
    scenes: Sequence[Scene],
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
    done: Solution | None = None,
    finished: Callable[[Solution], None] | None = None,
) -> tuple[History[Solution], tuple[Solution, ...]]:
    """Solve scenes as `run_history`; see `History` for what is done and who hears of finished steps."""
    steps = [step for scene in scenes for step in load_steps(scene)]
    if not steps:
        raise InputError("scenes is empty: give at least one scene")
    history: History[Solution] = History.of(scenes[-1], steps, done, finished)
    prepared, plan, clock = prepared_and_planned(steps, mesh)
    with blas_threads_for(plan.largest_matrix):
        if start is not None and not steps[0].contact_parts:
            raise NoContactError("start is given, but no part is in contact: leave it out, there is nothing to iterate")
        model, clock = built(prepared[0], clock)
        guess = None if start is None else state_on(model, start)
        solved = solve_steps(ONE_BODY, model, prepared, plan, history, clock=clock, guess=guess, callback=callback)
        return history, solved


def prepared_and_planned(
    steps: Sequence[Scene], mesh: BoundaryMesh | None
) -> tuple[tuple[Prepared, ...], Plan, StageClock]:
    """Return load steps ready to solve, their plan, and the clock of their run; refuse what does not fit."""
    clock = StageClock.start()
    if mesh is None:
        check_elements(steps[0])
        mesh = steps[0].build_mesh()
    prepared = prepare_steps(steps, mesh)
    plan = plan_steps(prepared)
    check_memory(plan)
    announce_plan(plan)
    return prepared, plan, clock.closed(Stage.MESH)


def run_on_mesh(
    scene: Scene,
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> Solution:
    """Solve a scene on one mesh; of a load history return the last step with the solves, records and times of all."""
    return joined(*solved_history([scene], mesh, start, callback))


def built(prepared: Prepared, clock: StageClock) -> tuple[Model, StageClock]:
    """Assemble and condense the body of a scene."""
    with assembly_time() as assembly:
        model = build_model(prepared)
    return model, clock.closed_build(assembly)


def explained(model: Model, result: ContactSolution) -> str:
    """Say why nothing can balance the load."""
    load = find_unsolvable_load(model.problem) if result.status is Status.UNSOLVABLE_LOAD else None
    return result.message if load is None else describe(model.prepared, load)


def solution_of(
    model: Model, result: ContactSolution, plan: Plan, clock: StageClock, motion: SlipHistory | None = None
) -> Solution:
    """Turn what the driver found into physical fields; the slip is for laws that depend on it."""
    state, node_status = with_held_friction(model, result.state, result.node_status, motion)
    displacement, traction_dofs, energy = model.boundary_fields(state)
    table = _contact_table(model, state, node_status, displacement)
    transitions = find_transitions(table, table.u_t - model.problem.slip_origin * model.units.displacement)
    warnings = contact_warnings(model, displacement, node_status) if result.is_converged else ()
    points, centres = dof_points(model.prepared.space, model.mesh), model.mesh.centres.copy()
    means = mean_tractions(model.elastic.traction_space, traction_dofs)
    fields = BoundaryFields(points, displacement, centres, means, traction_dofs.reshape(-1, 2))
    clock = clock.closed(Stage.RECOVER)
    if result.is_converged and not (
        np.isfinite(energy) and np.isfinite(displacement).all() and np.isfinite(traction_dofs).all()
    ):
        result = replace(result, status=Status.NOT_FINITE, message=Status.NOT_FINITE.value)
    solution = Solution(
        scene=model.scene,
        mesh=model.mesh,
        status=result.status,
        certificate=result.certificate,
        contact=table,
        boundary=fields,
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        force_normal=float(np.sum(-table.weight * table.sigma_n)),
        force_tangential=float(np.sum(table.weight * table.sigma_t)),
        energy=energy,
        transitions=transitions,
        timings=clock.timings,
        memory=clock.memory,
        plan=plan,
        work=model.work,
        message=result.message,
    )
    return solution.with_warnings((*find_warnings(solution), *warnings))


def _contact_table(
    model: Model, state: ContactState, node_status: IntArray, boundary_displacement: FloatArray
) -> ContactTable:
    units, contact = model.units, model.contact
    tangents = model.nodes.frame[:, 1]
    # where the tangent is no unknown the body itself says how it moves
    u_t = np.sum(boundary_displacement[model.nodes.nodes] * tangents, axis=1)
    u_t = np.where(model.body.tangent_is_eliminated, u_t, state.u_t * units.displacement)
    displacement = state.displacement * units.displacement
    return ContactTable(
        part=contact.parts,
        x=contact.points[:, 0].copy(),
        y=contact.points[:, 1].copy(),
        s=contact.arc_length.copy(),
        u_n=displacement[:, 0].copy(),
        u_t=u_t,
        sigma_n=state.sigma_n * units.stress,
        sigma_t=state.sigma_t * units.stress,
        gap=contact.gap.copy(),
        clearance=contact.gap - displacement[:, 0],
        status=np.asarray(node_status).copy(),
        weight=model.nodes.weights * units.length,
    )


ONE_BODY: Kind[Model, Solution] = Kind(with_energy_checked, solution_of, explained)
