"""Solve a scene on one mesh of each body."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from bemkit.contact.body import ContactState
from bemkit.model.model import Model
from bemkit.model.placed import Meshes
from bemkit.runs.steps import joined, solved_history
from bemkit.scene.scene import NoContactError, Scene
from bemkit.solvers.base import StepRecord

if TYPE_CHECKING:
    from concurrent.futures import Executor


def run_on_mesh(
    scene: Scene,
    mesh: Meshes = None,
    start: Any = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> Any:
    """Solve a scene on one mesh of each body; of a load history return the last step with the records of all."""
    return joined(*solved_history([scene], mesh, callback, guess=guess_from(scene, start), executor=executor))


def guess_from(scene: Scene, start: Any) -> Callable[[Model], ContactState] | None:
    """Return what takes a solution to the contact nodes of a model, where one is given."""
    if start is None:
        return None
    if not scene.has_contact:
        raise NoContactError("start is given, but no part is in contact: remove it; nothing is iterated")
    from bemkit.runs.warm_start import state_on

    return lambda model: state_on(model, start)
