"""Solve scenes that follow each other in time on one mesh: from what the user states to certified results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
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
from bemkit.model.contact_model import Model, build_model
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.model.solved_contact import contact_warnings, with_energy_checked
from bemkit.plan import Plan, check_elements, plan_steps
from bemkit.result_warning import ResultWarning
from bemkit.results.contact_table import ContactTable, find_transitions
from bemkit.results.solution import BoundaryFields, Solution
from bemkit.results.solved_problem import SolvedSteps
from bemkit.results.warnings import find_warnings
from bemkit.runs.steps import Kind, joined, solved_history
from bemkit.scene.scene import NoContactError, Scene
from bemkit.solvers.base import ContactSolution, Status, StepRecord
from bemkit.stopwatch import Stage, StageClock


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
        One body under changing loads, obstacles or laws; a scene with several steps or load factors is as many.
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
    if not scenes:
        raise InputError("scenes is empty: give at least one scene")
    return SolvedSteps(solved_history(ONE_BODY, scenes, mesh, callback, guess=_guess(scenes[0], start))[1])


def run_on_mesh(
    scene: Scene,
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> Solution:
    """Solve a scene on one mesh; of a load history return the last step with the solves, records and times of all."""
    return joined(*solved_history(ONE_BODY, [scene], mesh, callback, guess=_guess(scene, start)))


def _guess(scene: Scene, start: Solution | None) -> Callable[[Model], ContactState] | None:
    """Return what takes a solution to the contact nodes of a model, where one is given."""
    if start is None:
        return None
    if not scene.contact_parts:
        raise NoContactError("start is given, but no part is in contact: remove it; nothing is iterated")
    from bemkit.runs.warm_start import state_on

    return lambda model: state_on(model, start)


def _prepared(steps: Sequence[Scene], mesh: BoundaryMesh | None) -> tuple[tuple[Prepared, ...], Plan]:
    """Return load steps ready to solve, and their plan."""
    if mesh is None:
        check_elements(steps[0])
        mesh = steps[0].build_mesh()
    prepared = prepare_steps(steps, mesh)
    return prepared, plan_steps(prepared)


def _explained(model: Model, load: UnsolvableLoad) -> str:
    from bemkit.model.free_motion import describe

    return describe(model.prepared, load)


def solution_of(
    model: Model, result: ContactSolution, plan: Plan, clock: StageClock, motion: SlipHistory | None = None
) -> Solution:
    """Turn what the driver found into physical fields; the slip is for laws that depend on it."""
    state, node_status = result.state, result.node_status
    displacement, traction_dofs, energy = model.boundary_fields(state)
    table = _contact_table(model, state, node_status)
    transitions = find_transitions(table, table.u_t - model.problem.slip_origin * model.units.displacement)
    of_contact = contact_warnings(model, displacement, node_status) if result.is_converged else ()
    points, centres = dof_points(model.prepared.space, model.mesh), model.mesh.centres.copy()
    means = mean_tractions(model.elastic.traction_space, traction_dofs)
    fields = BoundaryFields(points, displacement, centres, means, traction_dofs.reshape(-1, 2), model.reactions(state))
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
    return solution.with_warnings(partial(_warnings, of_contact))


def _warnings(of_contact: tuple[ResultWarning, ...], solution: Solution) -> tuple[ResultWarning, ...]:
    """Return the warnings about a solution, last those about its contact."""
    return (*find_warnings(solution), *of_contact)


def _contact_table(model: Model, state: ContactState, node_status: IntArray) -> ContactTable:
    units, contact = model.units, model.contact
    displacement = state.displacement * units.displacement
    return ContactTable(
        part=contact.parts,
        x=contact.points[:, 0].copy(),
        y=contact.points[:, 1].copy(),
        s=contact.arc_length.copy(),
        u_n=displacement[:, 0].copy(),
        u_t=displacement[:, 1].copy(),
        sigma_n=state.sigma_n * units.stress,
        sigma_t=state.sigma_t * units.stress,
        gap=contact.gap.copy(),
        clearance=contact.gap - displacement[:, 0],
        status=np.asarray(node_status).copy(),
        weight=model.nodes.weights * units.length,
    )


ONE_BODY: Kind[Model, Solution] = Kind(_prepared, build_model, with_energy_checked, solution_of, _explained)
