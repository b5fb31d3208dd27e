"""Solve a scene: the way from what the user states to a certified result."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import Executor
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.boundary_data import Units, find_units
from bemkit.clock import StageClock
from bemkit.contact.admissibility import find_unsolvable_load
from bemkit.contact.body import ContactState
from bemkit.contact_warnings import contact_warnings
from bemkit.elasticity import ElasticModel, build_elastic_model
from bemkit.energy import with_energy_checked
from bemkit.errors import BemkitError, InputError
from bemkit.escape import describe_escape
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.space import dof_points
from bemkit.held_friction import with_held_friction
from bemkit.history import load_steps
from bemkit.model import Model, build_model
from bemkit.operators.stopwatch import assembly_time
from bemkit.operators.threads import blas_threads_for
from bemkit.plan import Plan, Stage, check_elements, check_memory, make_plan
from bemkit.scene import NoContactError, Scene
from bemkit.solution import BoundaryFields, ContactTable, Solution, Transition, find_transitions
from bemkit.solution_warnings import find_warnings
from bemkit.solvers.base import ContactSolution, Status, StepRecord, solve
from bemkit.solvers.floating import unheld_response
from bemkit.solvers.probe import probe
from bemkit.totals import with_totals
from bemkit.warm_start import state_on


class UnsolvableSceneError(InputError):
    """The scene has no solution; the message says why."""


class LoadHistoryError(InputError):
    """A load history where only a single load makes sense."""


def run(
    scene: Scene,
    *,
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> Solution:
    """Solve a scene.

    Parameters
    ----------
    scene : Scene
    mesh : BoundaryMesh, optional
        A mesh of one's own with the parts of the scene; by default the one the scene describes, or as many as its
        accuracy needs.
    start : Solution, optional
        Where to start, on any mesh; see `bemkit.cascade.run_cascade`. By default every node sticks. Where a scene has
        several solutions the start chooses among them. Refused without contact, where there is only one.
    callback : callable, optional
        Receives a record of every step as soon as it exists.

    Returns
    -------
    Solution
        Look at `Solution.status` before you use it: a run that did not converge returns what it reached. Of a load
        history this is the last step, with the linear solves and the records of all steps.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the load, or the body can move freely.
    FreeBodyError
        If no part is in contact and the supports leave a rigid motion free.
    ValueError
        If the scene is not well posed; the message names the part and the remedy.
    """
    if scene.mesh.accuracy is not None and mesh is None:
        from bemkit.adaptive import run_adaptive  # which calls this function for each of its meshes

        return run_adaptive(scene, callback=callback)[-1]
    steps = run_history([scene], mesh=mesh, start=start, callback=callback)
    return steps[0] if len(scene.load_factors) == 1 else _summed(scene, steps)


def run_history(
    scenes: Sequence[Scene],
    *,
    mesh: BoundaryMesh | None = None,
    start: Solution | None = None,
    callback: Callable[[StepRecord], None] | None = None,
) -> tuple[Solution, ...]:
    """Solve scenes that follow each other in time, slip counting from the end of the step before.

    The body is factored once for all steps.

    Parameters
    ----------
    scenes : sequence of Scene
        One body under changing loads, obstacles or laws; a scene with several load factors stands for as many steps.
    mesh, start, callback : optional
        As for `run`.

    Returns
    -------
    tuple of Solution
        One for each step, up to the first that does not converge.

    Raises
    ------
    UnsolvableSceneError, ValueError
        As for `run`, also if the scenes differ by more than numbers.
    """
    steps = [step for scene in scenes for step in load_steps(scene)]
    if not steps:
        raise InputError("scenes is empty: give at least one scene")
    clock = StageClock.start()
    if mesh is None:
        check_elements(steps[0])
        mesh = steps[0].build_mesh()
    plan = make_plan(scenes[0], mesh, steps=steps)
    check_memory(plan)
    clock = clock.closed(Stage.MESH)
    with blas_threads_for(plan.sizes.n_displacements):
        return tuple(_solve_in_turn(steps, mesh, plan, start, callback, clock))


def _solve_in_turn(
    steps: Sequence[Scene],
    mesh: BoundaryMesh,
    plan: Plan,
    start: Solution | None,
    callback: Callable[[StepRecord], None] | None,
    clock: StageClock,
) -> list[Solution]:
    units = max((find_units(step, mesh) for step in steps), key=lambda units: units.stress)
    if not plan.decisions.has_contact:
        if start is not None:
            raise NoContactError("start is given, but no part is in contact: leave it out, there is nothing to iterate")
        return _solve_without_contact(steps, mesh, units, plan, callback, clock)
    with assembly_time() as assembly:
        model = build_model(steps[0], mesh, units, plan)
    clock = clock.closed_build(assembly)
    state = None if start is None else state_on(model, start)
    solutions: list[Solution] = []
    for step in steps:
        if solutions and state is not None:
            model = model.under(step)
            model = replace(model, problem=replace(model.problem, reference_slip=state.u_t))
        clock = clock.closed(Stage.CONDENSE)
        result = solve(model.problem, step.solver, start=state, throw=False, callback=callback)
        if not result.history:
            raise UnsolvableSceneError(_reason(model, result))
        result = with_energy_checked(model, result)
        clock = clock.closed(Stage.SOLVE)
        solutions.append(_solution(model, result, plan, clock))
        clock = StageClock.start()
        state = result.state
        if not result.is_converged:
            break
    return solutions


def _solve_without_contact(
    steps: Sequence[Scene],
    mesh: BoundaryMesh,
    units: Units,
    plan: Plan,
    callback: Callable[[StepRecord], None] | None,
    clock: StageClock,
) -> list[Solution]:
    with assembly_time() as assembly:
        model = build_elastic_model(steps[0], mesh, units, plan)
    clock = clock.closed_build(assembly)
    solutions: list[Solution] = []
    for step in steps:
        if solutions:
            model = model.under(step)
        clock = clock.closed(Stage.CONDENSE)
        result = with_energy_checked(model, model.certified())
        if callback is not None:
            callback(result.history[-1])
        clock = clock.closed(Stage.SOLVE)
        solutions.append(_solution(model, result, plan, clock))
        clock = StageClock.start()
        if not result.is_converged:
            break
    return solutions


def _reason(model: Model, result: ContactSolution) -> str:
    escape = find_unsolvable_load(model.problem) if result.status is Status.UNSOLVABLE_LOAD else None
    return result.message if escape is None else describe_escape(model, escape)


def _solution(model: Model | ElasticModel, result: ContactSolution, plan: Plan, clock: StageClock) -> Solution:
    """Turn what the driver found into physical fields."""
    transitions: tuple[Transition, ...] = ()
    warnings: tuple[str, ...] = ()
    if isinstance(model, ElasticModel):
        displacement, traction, energy = model.boundary_fields()
        table = ContactTable.empty()
    else:
        state, node_status = with_held_friction(model, result.state, result.node_status)
        displacement, traction, energy = model.boundary_fields(state)
        table = _contact_table(model, state, node_status, displacement)
        transitions = find_transitions(table, table.u_t - model.problem.slip_origin * model.units.displacement)
        warnings = contact_warnings(model, displacement, node_status) if result.is_converged else ()
    points = dof_points(model.elastic.displacement_space, model.mesh)
    fields = BoundaryFields(points, displacement, model.mesh.centres.copy(), traction)
    clock = clock.closed(Stage.RECOVER)
    if result.is_converged and not (
        np.isfinite(energy) and np.isfinite(displacement).all() and np.isfinite(traction).all()
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
    return replace(solution, warnings=(*find_warnings(solution), *warnings))


def _summed(scene: Scene, steps: Sequence[Solution]) -> Solution:
    """Return the last step with the solves, records and times of all."""
    names = [f"load step {number} of {len(scene.load_factors)}" for number in range(1, len(steps) + 1)]
    return replace(
        with_totals(steps[-1], steps, names),
        scene=scene,
        message=f"{names[-1]}: {steps[-1].message}",
        warnings=tuple(dict.fromkeys(warning for step in reversed(steps) for warning in step.warnings)),
    )


def run_probe(scene: Scene, *, n_starts: int = 8, mesh: BoundaryMesh | None = None) -> tuple[Solution, ...]:
    """Solve a scene from several starts and return the distinct solutions.

    With Coulomb friction a scene may have more than one solution; which of them `run` returns is a matter of its
    start.

    Parameters
    ----------
    scene : Scene
        With a single load factor.
    n_starts : int
        Starts: all nodes sticking, open, slipping forward, slipping backward, then random choices (always the same).
    mesh : BoundaryMesh, optional
        As for `run`.

    Returns
    -------
    tuple of Solution
        In the order found, each certified; empty if no start leads to a solution. A single one does not prove that
        there is no other.

    Raises
    ------
    UnsolvableSceneError, ValueError
        As for `run`; also if the scene has a load history or `n_starts` is negative.
    """
    if not scene.contact_parts:
        raise NoContactError("no part is in contact: the solution is the only one, which run returns")
    if len(scene.load_factors) > 1:
        raise LoadHistoryError(f"a load history of {len(scene.load_factors)} steps cannot be probed: give one factor")
    clock = StageClock.start()
    if mesh is None:
        check_elements(scene)
        mesh = scene.build_mesh()
    plan = make_plan(scene, mesh)
    check_memory(plan)
    clock = clock.closed(Stage.MESH)
    with blas_threads_for(plan.sizes.n_displacements):
        return _probed(scene, mesh, plan, n_starts, clock)


def _probed(scene: Scene, mesh: BoundaryMesh, plan: Plan, n_starts: int, clock: StageClock) -> tuple[Solution, ...]:
    with assembly_time() as assembly:
        model = build_model(scene, mesh, plan=plan)
    clock = clock.closed_build(assembly)
    escape = find_unsolvable_load(model.problem)
    if escape is not None and unheld_response(model.body) is None:
        raise UnsolvableSceneError(describe_escape(model, escape))
    clock = clock.closed(Stage.CONDENSE)
    found = [with_energy_checked(model, result) for result in probe(model.problem, scene.solver, n_starts=n_starts)]
    clock = clock.closed(Stage.SOLVE)
    return tuple(_solution(model, result, plan, clock) for result in found if result.is_converged)


@dataclass(frozen=True)
class FailedRun:
    """Stands in a list of solutions for a scene that has none.

    Parameters
    ----------
    scene : Scene
    error : BemkitError
        What `run` raised; its message names the remedy.
    """

    scene: Scene
    error: BemkitError

    @property
    def is_converged(self) -> bool:
        """False, as of a solution that is none."""
        return False


def run_all(scenes: Iterable[Scene], executor: Executor | None = None) -> list[Solution | FailedRun]:
    """Solve several scenes, on any `concurrent.futures.Executor` if one is given.

    Parameters
    ----------
    scenes : iterable of Scene
    executor : Executor, optional
        For example a `ProcessPoolExecutor`, or the executor of a `distributed` client. Without one the scenes are
        solved in turn.

    Returns
    -------
    list of Solution or FailedRun
        In the order of the scenes. A scene that is refused, such as one that nothing holds, is a `FailedRun`.
    """
    return list(map(_attempt, scenes)) if executor is None else list(executor.map(_attempt, scenes))


def _attempt(scene: Scene) -> Solution | FailedRun:
    try:
        return run(scene)
    except BemkitError as error:
        return FailedRun(scene, error.with_traceback(None))  # whose frames hold matrices


def _contact_table(
    model: Model, state: ContactState, node_status: IntArray, boundary_displacement: FloatArray
) -> ContactTable:
    units, contact = model.units, model.contact
    tangents = model.nodes.frame[:, 1]
    # where the tangent is no unknown the body itself says how it moves
    u_t = np.sum(boundary_displacement[model.nodes.nodes] * tangents, axis=1)
    u_t = np.where(model.body.tangent_is_free, u_t, state.u_t * units.displacement)
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
