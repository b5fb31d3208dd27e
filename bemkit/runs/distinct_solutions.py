"""Distinct solutions of one scene, found from several starts."""

from __future__ import annotations

from typing import Any

from bemkit.contact.solvability import find_unsolvable_load
from bemkit.errors import InputError
from bemkit.runs.run import UnsolvableSceneError, on_its_meshes
from bemkit.runs.solution_of import solution_of, with_missed_contact_named
from bemkit.runs.steps import built, checked, explained, planned
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import Scene, check_scene
from bemkit.solvers.multistart import probe
from bemkit.stopwatch import Stage
from bemkit.threads import blas_threads_for


def distinct_solutions(scene: Scene, *, n_starts: int = 8) -> tuple[Any, ...]:
    """Solve a scene from several starts and return the distinct solutions.

    With Coulomb friction a scene may have more than one solution; which of them `run` returns depends on its start.

    Parameters
    ----------
    scene : Scene
        With a single load. With an accuracy, on the meshes that it needs.
    n_starts : int
        Starts: all nodes sticking, open, slipping forward, slipping backward, then random choices (always the same).

    Returns
    -------
    tuple of Solution
        In the order found, each certified; empty if no start leads to a solution. A single one does not prove that
        there is no other.

    Raises
    ------
    UnsolvableSceneError, ValueError
        As for `run`; also if the scene has a load history or `n_starts` is negative.
    NoResultError
        If the accuracy is not reached.
    """
    check_scene(scene)
    if not scene.has_contact:
        raise InputError("no part is in contact: the solution is the only one, which run returns")
    if scene.n_steps > 1:
        raise InputError(
            f"a load history of {scene.n_steps} steps cannot be searched for distinct solutions: give one load"
        )
    scene, mesh = on_its_meshes(scene)
    (prepared,), plan, clock = planned(load_steps(scene), mesh)
    with blas_threads_for(prepared.largest_matrix):
        model, clock = built(prepared, clock)
        load = find_unsolvable_load(model.problem)
        if load is not None:
            raise UnsolvableSceneError(explained(model, load))
        clock = clock.closed(Stage.CONDENSE)
        results = probe(model.problem, scene.solver, n_starts=n_starts)
        results = tuple(checked(model, result) for result in results)
        clock = clock.closed(Stage.SOLVE)
        solutions = (solution_of(model, result, plan, clock) for result in results if result.is_converged)
        return tuple(each for each in map(with_missed_contact_named, solutions) if each.is_converged)
