"""Load histories: options, the loop over the steps, and results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.contact.body import ContactState
from bemkit.contact.solvability import UnsolvableLoad, find_unsolvable_load
from bemkit.errors import InputError
from bemkit.model.model import Model, build_model
from bemkit.model.placed import Meshes
from bemkit.model.prepared import Prepared, prepare_steps
from bemkit.model.solved_contact import with_energies_checked, with_sliding_checked
from bemkit.plan.plan import Plan, announce_plan, check_elements, check_memory, plan_steps
from bemkit.runs.load_path import Callback, IncrementEnd, Path, ReachedStep, advance
from bemkit.runs.solution_of import solution_of, with_missed_contact_named
from bemkit.scene.scene import Scene
from bemkit.solvers.active_sets import NodeStatus
from bemkit.solvers.base import ContactSolution, Status
from bemkit.stopwatch import Stage, StageClock, announce, assembly_time
from bemkit.threads import blas_threads_for

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from bemkit.results.load_history import LoadHistory, LoadStep
    from bemkit.results.solution import Solution


class UnsolvableSceneError(InputError):
    """The scene has no solution; the message says why."""


def planned(steps: Sequence[Scene], meshes: Meshes = None) -> tuple[tuple[Prepared, ...], Plan, StageClock]:
    """Return load steps ready to solve, their plan, and the clock of their run; check that they fit into memory."""
    clock = StageClock.start()
    if meshes is None:
        check_elements(steps[0])
    prepared = prepare_steps(steps, meshes)
    plan = plan_steps(prepared)
    check_memory(plan)
    announce_plan(plan)
    return prepared, plan, clock.closed(Stage.MESH)


def built(prepared: Prepared, clock: StageClock, executor: Executor | None = None) -> tuple[Model, StageClock]:
    """Assemble and condense the bodies."""
    with assembly_time() as assembly:
        model = build_model(prepared, executor)
    return model, clock.closed_build(assembly)


def checked(model: Model, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, with another status if checks of energy, free rotation or sliding fail."""
    result = _with_load_named(model, with_energies_checked(model, result))
    if any(rows.law.is_frictionless for rows in model.prepared.rows):
        from bemkit.model.turning import with_turning_checked

        result = with_turning_checked(model.prepared, result)
    return with_sliding_checked(model, result)


def _with_load_named(model: Model, result: ContactSolution) -> ContactSolution:
    """Name the load in the message of a failed solve, if all pressed nodes slip and their friction cannot hold it."""
    has_stick = bool(np.isin(result.node_status, NodeStatus.STICK).any())
    if result.status not in (Status.STALLED, Status.CYCLING) or has_stick or not result.state.is_finite:
        return result
    load = find_unsolvable_load(model.problem, result.state)
    if load is None:
        return result
    words = f"At the pressures of the last state {explained(model, load)}. {result.message}"
    return replace(result, message=words)


def why_not(model: Model, result: ContactSolution) -> str:
    """Explain why a load cannot be balanced; for another failure return the message of the solver."""
    load = find_unsolvable_load(model.problem) if result.status is Status.UNSOLVABLE_LOAD else None
    return result.message if load is None else explained(model, load)


def explained(model: Model, load: UnsolvableLoad) -> str:
    """Describe how a load moves bodies that nothing holds, and the remedy."""
    from bemkit.model.free_motion import describe

    return describe(model.prepared, load)


@dataclass(frozen=True, eq=False)
class RunOptions:
    """Options of a run besides its scene and its meshes.

    Parameters
    ----------
    guess : callable, optional
        Model -> where to start the first step; see `guess_from`. By default every node sticks.
    callback : callable, optional
        Receives a record of every step of the solver as soon as it exists.
    executor : Executor, optional
        Where bodies are assembled and factored, copies once; by default in this process, in turn.
    done : Solution, optional
        Of an earlier run, up to some step, with its `loading`: that is where to go on.
    finished : callable, optional
        Receives the solution of each step but the last, with the steps up to it as its load history.
    """

    guess: Callable[[Model], ContactState | None] | None = None
    callback: Callback = None
    executor: Executor | None = None
    done: Solution | None = None
    finished: Callable[[Solution], None] | None = None


@dataclass(frozen=True, eq=False)
class History:
    """A load history and how it is solved.

    Parameters
    ----------
    asked : Scene
    times : sequence of float [s]
        Of its steps.
    is_recorded : bool
        Whether results contain the steps.
    options : RunOptions
    """

    asked: Scene
    times: Sequence[float]
    is_recorded: bool
    options: RunOptions

    @classmethod
    def of(cls, asked: Scene, steps: Sequence[Scene], options: RunOptions) -> History:
        """Return the history of scenes with single loads; those that say no time follow each other at 1, 2, 3.

        Raises
        ------
        InputError
            If times do not increase.
        """
        has_times = any(step.steps for step in steps)
        times = [step.steps[-1].time if step.steps else float(k) for k, step in enumerate(steps, start=1)]
        for number in range(1, len(times)):
            if times[number] <= times[number - 1]:
                before, time = times[number - 1], times[number]
                raise InputError(f"step {number + 1}: time is {time:g} after {before:g}: give times that increase")
        return cls(asked, times, has_times or len(times) > 1, options)


def solved_history(
    scenes: Sequence[Scene], meshes: Meshes = None, options: RunOptions | None = None
) -> tuple[History, tuple[Solution, ...]]:
    """Solve scenes that follow each other in time on one mesh of each body.

    Parameters
    ----------
    scenes : sequence of Scene
        One with several steps or load factors is as many.
    meshes : BoundaryMesh, or mapping of str to BoundaryMesh, optional
        As `bemkit.run` takes them.
    options : RunOptions, optional

    Returns
    -------
    History, tuple of solutions
        See `solve_steps`.
    """
    steps = [step for each in scenes for step in _load_steps(each)]
    history = History.of(scenes[-1], steps, options or RunOptions())
    prepared, plan, clock = planned(steps, meshes)
    with blas_threads_for(prepared[0].largest_matrix):
        model, clock = built(prepared[0], clock, history.options.executor)
        return history, solve_steps(model, prepared, plan, history, clock)


def _load_steps(scene: Scene) -> tuple[Scene, ...]:
    if scene.is_one_load:
        return (scene,)
    from bemkit.scene.load_history import load_steps

    return load_steps(scene)


def solve_steps(
    model: Model, steps: Sequence[Prepared], plan: Plan, history: History, clock: StageClock
) -> tuple[Solution, ...]:
    """Solve the steps of a load history, up to the first that does not converge.

    Parameters
    ----------
    model : Model
        Of the first step.
    steps : sequence of Prepared
    plan : Plan
    history : History
    clock : StageClock

    Returns
    -------
    tuple of solutions
        One for each step that is solved here. If a step fails that is not the first one, its fields are those of the
        step before, the last state that is certified; status, message and history are its own.

    Raises
    ------
    UnsolvableSceneError
        If nothing can balance the first load.
    """
    solutions: list[Solution] = []
    options = history.options
    guess = None if options.guess is None else options.guess(model)
    before, end = None, IncrementEnd.at_rest(model)
    done = None if options.done is None else options.done.loading
    n_done = 0 if done is None else len(done.steps)
    for number, step in enumerate(steps):
        if number:
            before, model = model, model.under(step)
        if done is not None and number < n_done:  # in an earlier run: only the model goes the same way again
            end = IncrementEnd.under(model, done.steps[-1].state, done.motion) if number == n_done - 1 else end
            continue
        clock = clock.closed(Stage.CONDENSE)
        reached = advance(_path(model, before, end, history, number), guess, options.callback)
        if before is None and not reached.result.history:
            raise UnsolvableSceneError(why_not(model, reached.result))
        model = replace(model, problem=reached.problem)
        result = checked(model, reached.result)
        clock = clock.closed(Stage.SOLVE)
        if before is not None and not result.is_converged:
            words, why = result.message, why_not(model, result)
            if why != words:
                words = f"{result.status.value} {why}."
            former = solutions[-1] if solutions else options.done
            solutions.append(_not_reached(former, replace(result, message=words), clock))
            break
        with np.errstate(over="ignore", invalid="ignore"):  # the status says what is not finite
            solution = solution_of(model, result, plan, clock, reached.end.motion)
        solution = with_missed_contact_named(solution)
        if history.is_recorded and solution.is_converged:
            solution = replace(solution, loading=_loading(history, solutions, model, reached, solution))
        solutions.append(solution)
        if len(steps) > 1:
            announce(f"load step {number + 1} of {len(steps)} finished")
        clock, end = StageClock.start(), reached.end
        if not solution.is_converged:
            break
        if options.finished is not None and number + 1 < len(steps):
            options.finished(solution)
            clock = clock.closed(Stage.WRITE)
    return tuple(solutions)


def joined(history: History, solutions: Sequence[Solution]) -> Solution:
    """Return the last of the steps, with the records, solves, times, memory and warnings of all."""
    if len(history.times) == 1 and solutions:
        return solutions[-1]
    from bemkit.results.solved_steps import following

    whole = history.options.done
    n_done = 0 if whole is None or whole.loading is None else len(whole.loading.steps)
    for number, solution in enumerate(solutions, start=n_done + 1):
        whole = following(whole, solution, history.asked, number, len(history.times))
    if whole is None:
        raise InputError("there is no step to join")
    return whole


def _path(model: Model, before: Model | None, end: IncrementEnd, history: History, number: int) -> Path:
    factors = history.asked.load_factors
    ends = (factors[number - 1], factors[number]) if number and len(factors) == len(history.times) else None
    return Path(model, end, history.times[number], before, ends)


def _loading(
    history: History,
    solutions: Sequence[Solution],
    model: Model,
    reached: ReachedStep,
    solution: Solution,
) -> LoadHistory:
    """Return the history up to a step that is finished."""
    from bemkit.results.load_history import LoadHistory, LoadStep

    former = solutions[-1] if solutions else history.options.done
    steps: tuple[LoadStep, ...] = () if former is None or former.loading is None else former.loading.steps
    work, end = reached.work, reached.end
    if model.has_body_forces:
        change = solution.energy - (steps[-1].elastic_energy if steps else 0.0)
        work = replace(work, external_work=change + work.dissipation + work.increment_work)
    step = LoadStep(
        work=work,
        n_increments=len(reached.ends),
        linear_solves=solution.linear_solves,
        end=solution,
        state=end.state,
        motion=end.motion,
    )
    return LoadHistory(history.asked, len(history.times), (*steps, step))


def _not_reached(before: Solution | None, result: ContactSolution, clock: StageClock) -> Solution:
    """Return the result of a step that failed: the fields of the step before, and why they are the last."""
    if before is None or before.loading is None:
        raise InputError("there is no step before the one that failed")
    return replace(
        before,
        status=result.status,
        message=f"{result.message} {before.loading.where()} The fields are those of the step before.",
        history=result.history,
        linear_solves=result.linear_solves,
        outer_steps=result.steps,
        timings=clock.timings,
        memory=clock.memory,
    ).with_warnings(before.plan.warnings)


def run_on_mesh(scene: Scene, mesh: Meshes = None, options: RunOptions | None = None) -> Any:
    """Solve a scene on one mesh of each body; of a load history return the last step with the records of all."""
    return joined(*solved_history([scene], mesh, options))


def guess_from(scene: Scene, start: Any) -> Callable[[Model], ContactState] | None:
    """Return a function that interpolates a solution to the contact nodes of a model, if a solution is given."""
    if start is None:
        return None
    if not scene.has_contact:
        raise InputError("start is given, but no part is in contact: remove it; nothing is iterated")
    from bemkit.results.solution import Solution
    from bemkit.runs.warm_start import state_on

    if not isinstance(start, Solution):
        raise InputError(f"start is a {type(start).__name__}: give a Solution, of bk.run or of bk.read_result")
    return lambda model: state_on(model, start)
