"""The one way to solve: a scene, or scenes that follow each other in time."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, overload

from bemkit.errors import InputError, NoResultError
from bemkit.interrupts import interruptible
from bemkit.model.placed import Meshes
from bemkit.plan.plan import few_on, make_plan
from bemkit.runs.steps import RunOptions, guess_from, run_on_mesh, solved_history
from bemkit.runs.steps import UnsolvableSceneError as UnsolvableSceneError
from bemkit.scene.scene import Scene, check_scene
from bemkit.solvers.base import StepRecord

if TYPE_CHECKING:
    from concurrent.futures import Executor

    from bemkit.results.solution import Solution
    from bemkit.results.solved_steps import SolvedSteps

_COARSEST, _RATIO = 1024, 16
"""Elements of the coarsest mesh of a large body, and the ratio of their numbers from one mesh to the next."""
_COARSEST_STRIP = 50
"""Elements of the coarsest mesh of a strip of a half-plane."""
_LARGE = 5000
"""Number of elements of the mesh whose plan decides whether the equations of such a body are compressed."""


@overload
def run(
    scene: Scene,
    *,
    mesh: Meshes = ...,
    start: Any = ...,
    coarsest: int | None = ...,
    file: str | Path | None = ...,
    callback: Callable[[StepRecord], None] | None = ...,
    executor: Executor | None = ...,
) -> Solution: ...


@overload
def run(
    scene: Sequence[Scene],
    *,
    mesh: Meshes = ...,
    start: Any = ...,
    coarsest: int | None = ...,
    file: str | Path | None = ...,
    callback: Callable[[StepRecord], None] | None = ...,
    executor: Executor | None = ...,
) -> SolvedSteps: ...


@interruptible()
def run(
    scene: Scene | Sequence[Scene],
    *,
    mesh: Meshes = None,
    start: Any = None,
    coarsest: int | None = None,
    file: str | Path | None = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> Any:
    """Solve a scene, or scenes that follow each other in time.

    Every body is factored once for all load steps; slip counts from the end of the step before. Where the jump to a
    load fails, the step is halved; see `bemkit.runs.load_path.advance`.

    Parameters
    ----------
    scene : Scene, or sequence of them
        A sequence has the same bodies and contacts under changing loads, motions, obstacles, gaps or laws; a scene with
        several steps or load factors is as many.
    mesh : BoundaryMesh or mapping of str to BoundaryMesh, optional
        A mesh of your own with the parts of the scene, or meshes of bodies by name, in the coordinates of their shapes.
        By default the meshes that the scene describes, or meshes until its accuracy is reached.
    start : Solution, optional
        A solution to start from, on any mesh. By default every node sticks; large scenes on compressed equations start
        from a solution on a coarser mesh. Where a scene has several solutions the start chooses among them. With an
        accuracy the first mesh starts there. An error without contact, where there is only one solution.
    coarsest : int, optional
        Solve on nested meshes, of which the coarsest has at least this number of elements, each from the solution on
        the mesh before. An error with a load history, without contact, and with an accuracy, a mesh, a start or a file.
    file : str or Path, optional
        A result file, ``.h5``, that receives each load step as soon as it is finished. Its status is UNFINISHED until
        the last one. If it holds the beginning of the same history, because a run was killed, the run resumes there,
        with the numbers of a run without interruption. An error with a sequence, a mesh or a start.
    callback : callable, optional
        Receives a record of every step as soon as it exists.
    executor : Executor, optional
        Where bodies are assembled and factored, copies once. An executor of `concurrent.futures`, or that of a
        `distributed` client; by default in this process, in turn.

    Returns
    -------
    Solution or SolvedSteps
        Look at its status before you use it: a run that did not converge returns its last state. Of a load history
        this is the last step, with the linear solves and the records of all steps.

        For a sequence a tuple of solutions, one for each step, up to the first that does not converge. If that is not
        the first one, its fields are those of the step before, the last state that is certified; status, message and
        history are its own.

    Raises
    ------
    UnsolvableSceneError
        If no contact tractions can balance the load, or the body can move freely.
    FreeBodyError
        If no part is in contact and the supports leave a rigid motion free.
    OutputFileError
        If the file cannot be written.
    SceneError
        If a file is given, and the scene holds a Python function.
    ValueError
        If the scene is not well posed, or scenes of a sequence differ by more than numbers; the message names the part
        and the remedy.
    """
    if file is not None and (mesh is not None or start is not None or coarsest is not None):
        raise InputError("file is given with a mesh, a start or coarsest, which a run that resumes does not have")
    if coarsest is not None and (mesh is not None or start is not None):
        raise InputError("coarsest is given with a mesh or a start: nested meshes have their own; remove one")
    if not isinstance(scene, Scene):
        return _in_turn(scene, mesh, start, coarsest, file, RunOptions(None, callback, executor))
    options = RunOptions(guess_from(scene, start), callback, executor)
    if file is not None:
        from bemkit.runs.checkpoint import run_to_file

        return run_to_file(scene, file, options)
    if scene.mesh.accuracy is not None and mesh is None:
        from bemkit.runs.adaptive import run_adaptive  # only where it is asked for

        if coarsest is not None:
            raise InputError("an accuracy is given with coarsest: its meshes start from each other already; remove one")
        return run_adaptive(scene, options)[-1]
    nested = None
    if mesh is None and start is None:
        nested = cascade_of(scene) if coarsest is None else (coarsest, 2)
    if nested is not None:
        from bemkit.results.solved_steps import with_times
        from bemkit.runs.nested import run_nested

        meshes = run_nested(scene, coarsest=nested[0], ratio=nested[1], options=options)
        return with_times(meshes[-1], meshes)
    return run_on_mesh(scene, mesh, options)


def _in_turn(
    scenes: Sequence[Scene],
    mesh: Meshes,
    start: Any,
    coarsest: int | None,
    file: str | Path | None,
    options: RunOptions,
) -> SolvedSteps:
    """Solve scenes that follow each other in time on one mesh of each body."""
    if isinstance(scenes, str) or not isinstance(scenes, Sequence):
        check_scene(scenes)  # which says what to give
    if not scenes:
        raise InputError("scene is an empty sequence: give at least one scene")
    for scene in scenes:
        check_scene(scene)
    if file is not None:
        raise InputError("file is given with a sequence of scenes: a file holds one scene; give it as steps")
    if coarsest is not None:
        raise InputError("coarsest is given with a sequence of scenes: nested meshes take a single load")
    from bemkit.results.solved_steps import SolvedSteps

    options = replace(options, guess=guess_from(scenes[0], start))
    return SolvedSteps(solved_history(scenes, mesh, options)[1])


def cascade_of(scene: Scene) -> tuple[int, int] | None:
    """Return elements of the coarsest mesh and the ratio of a cascade, None if a scene is solved on its mesh at once.

    A cascade pays where a contact step costs about as much as the assembly: for half-planes, of which only closed nodes
    are solved for or which have no matrices, and for large bodies on compressed equations.
    """
    if not scene.has_obstacles_only or scene.n_steps > 1 or not scene.has_contact:
        return None
    outline, n_elements = scene.only.shape.outline(), scene.only.mesh.n_elements
    if outline.surface is None:
        coarsest, ratio = max(_COARSEST, few_on(outline)), _RATIO
    elif outline.surface.is_periodic:
        coarsest, ratio = _COARSEST, 2
    else:
        coarsest, ratio = _COARSEST_STRIP, _RATIO if n_elements > _LARGE else 4
    if n_elements < ratio * coarsest:
        return None
    if outline.surface is not None:
        return coarsest, ratio
    smaller = replace(scene, mesh=replace(scene.mesh, elements=max(_LARGE, few_on(outline))))
    return (coarsest, ratio) if make_plan(smaller).is_compressed else None


def on_its_meshes(scene: Scene) -> tuple[Scene, Meshes]:
    """Return a scene with the discretisations, and the meshes of its bodies, by which it reaches its accuracy.

    Without an accuracy the scene stays as it is.

    Raises
    ------
    NoResultError
        If the accuracy is not reached.
    """
    if scene.mesh.accuracy is None:
        return scene, None
    found = run(scene)
    if not found.is_converged:
        raise NoResultError(f"no mesh reaches the accuracy, give elements or ask for less: {found.message}")
    placed = {body.name: body.placement for body in scene.placed_bodies}
    return found.scene, {name: placed[name].inverse.mesh(body.mesh) for name, body in found.bodies.items()}
