"""Nested iteration: solve on a coarse mesh first, and start each finer mesh from the solution before it."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from bemkit.contact.body import ContactState
from bemkit.errors import BemkitError, InputError
from bemkit.model.model import Model
from bemkit.plan.plan import check_elements
from bemkit.results.solution import Solution
from bemkit.runs.steps import RunOptions, run_on_mesh
from bemkit.runs.warm_start import state_on, take_sticking_state
from bemkit.scene.scene import Scene
from bemkit.scene.toml import with_overrides


def run_nested(
    scene: Scene,
    *,
    coarsest: int = 40,
    ratio: int = 2,
    options: RunOptions | None = None,
) -> tuple[Any, ...]:
    """Solve a scene on meshes of growing size, ending with its own.

    The number of linear solves on the finest mesh then hardly depends on its size, and the coarser meshes together
    cost less than a sixth of it.

    Parameters
    ----------
    scene : Scene
        With a single load factor, without an accuracy.
    coarsest : int
        The number of elements is halved as long as it stays at least this large.
    ratio : int
        Factor by which the number of elements is divided.
    options : RunOptions, optional
        Of each mesh; its guess is not used.

    Returns
    -------
    tuple of Solution
        From the coarsest mesh to the scene's own, which comes last. A mesh that fails starts the next one cold, and a
        coarse one on which the scene is refused is skipped.

    Raises
    ------
    ValueError
        If the scene has a load history, whose memory belongs to one mesh, or no contact, if `coarsest` is too small for
        any mesh, if `ratio` is less than two, or for the reasons of `bemkit.run`.
    """
    if coarsest < 3:
        raise InputError(f"coarsest = {coarsest}: give at least 3 elements")
    if ratio < 2:
        raise InputError(f"ratio = {ratio}: give a whole number from 2 on")
    if not scene.has_contact:
        raise InputError("no part is in contact: one mesh is enough, where there is nothing to iterate")
    if scene.n_steps > 1:
        raise InputError(f"a load history of {scene.n_steps} steps cannot cascade: run it on one mesh")
    check_elements(scene)
    counts = [scene.mesh.n_elements]
    while counts[-1] // ratio >= coarsest:
        counts.append(counts[-1] // ratio)
    levels, solutions = _Levels(), []
    options = replace(options or RunOptions(), guess=levels.start)
    for count in reversed(counts):
        is_last = count == counts[0]
        level = scene if is_last else with_overrides(scene, elements=count)
        try:
            solutions.append(run_on_mesh(level, options=options))
        except BemkitError:
            if is_last:  # a coarse mesh may be too coarse for the scene
                raise
            levels.models.clear()
        else:
            levels.solution = solutions[-1]
    return tuple(solutions)


@dataclass
class _Levels:
    """The model and the solution on the mesh before."""

    models: list[Model] = field(default_factory=list)
    solution: Solution | None = None

    def start(self, model: Model) -> ContactState | None:
        """Return where a model starts; the load is measured by the sticking state of the model before."""
        start = None
        if self.models and self.solution is not None and self.solution.is_converged:
            take_sticking_state(model, self.models[0])
            start = state_on(model, self.solution)
        self.models[:] = [model]
        return start
