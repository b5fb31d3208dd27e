"""Solve scenes that follow each other in time on one mesh of each body: from what the user states to results."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING, Any

from bemkit.contact.body import ContactState
from bemkit.errors import InputError
from bemkit.model.model import Model
from bemkit.model.placed import Meshes
from bemkit.results.solved_problem import SolvedSteps
from bemkit.runs.steps import joined, solved_history
from bemkit.scene.scene import NoContactError, Scene
from bemkit.scene.steps import Stated
from bemkit.solvers.base import StepRecord

if TYPE_CHECKING:
    from concurrent.futures import Executor


def run_history(
    scenes: Sequence[Stated],
    *,
    mesh: Meshes = None,
    start: Any = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> SolvedSteps[Any]:
    """Solve scenes that follow each other in time, slip counting from the end of the step before.

    Every body is factored once for all steps. Where the jump to a load fails, it is gone in halves; see
    `bemkit.runs.load_path.reach`.

    Parameters
    ----------
    scenes : sequence of Scene or of Assembly
        The same bodies and contacts under changing loads, motions, obstacles, gaps or laws; a scene with several steps
        or load factors is as many.
    mesh, start, callback, executor : optional
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
    guess = guess_from(scenes[0], start)
    return SolvedSteps(solved_history(scenes, mesh, callback, guess=guess, executor=executor)[1])


def run_on_mesh(
    scene: Stated,
    mesh: Meshes = None,
    start: Any = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> Any:
    """Solve a scene on one mesh of each body; of a load history return the last step with the records of all."""
    return joined(*solved_history([scene], mesh, callback, guess=guess_from(scene, start), executor=executor))


def guess_from(scene: Stated, start: Any) -> Callable[[Model], ContactState] | None:
    """Return what takes a solution to the contact nodes of a model, where one is given."""
    if start is None:
        return None
    if isinstance(scene, Scene) and not scene.contact_parts:
        raise NoContactError("start is given, but no part is in contact: remove it; nothing is iterated")
    from bemkit.runs.warm_start import state_on

    return lambda model: state_on(model, start)
