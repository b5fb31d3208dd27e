"""Run scenes: one, several, or one from several starts."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from bemkit.contact.solvability import find_unsolvable_load
from bemkit.errors import BemkitError, InputError
from bemkit.interrupts import interruptible
from bemkit.model.placed import Meshes
from bemkit.operators.linear.threads import blas_threads_for
from bemkit.plan.plan import few_on, make_plan
from bemkit.results.solution import Solution
from bemkit.results.solved_problem import with_times
from bemkit.runs.history import run_on_mesh
from bemkit.runs.solution_of import solution_of
from bemkit.runs.steps import UnsolvableSceneError as UnsolvableSceneError
from bemkit.runs.steps import built, checked, explained, planned
from bemkit.scene.load_history import load_steps
from bemkit.scene.scene import NoContactError, Scene
from bemkit.scene.steps import Stated, check_stated
from bemkit.solvers.base import StepRecord
from bemkit.stopwatch import Stage

if TYPE_CHECKING:
    from concurrent.futures import Executor

_COARSEST, _RATIO = 1024, 16
"""Elements of the coarsest mesh of a large body, and the ratio of their numbers from one mesh to the next."""
_COARSEST_STRIP = 50
"""Elements of the coarsest mesh of a strip of a half-plane."""
_LARGE = 5000
"""Elements of the mesh whose plan decides whether the equations of such a body are compressed."""


class LoadHistoryError(InputError):
    """A load history was given where only a single load is possible."""


@interruptible()
def run(
    scene: Stated,
    *,
    mesh: Meshes = None,
    start: Any = None,
    file: str | Path | None = None,
    callback: Callable[[StepRecord], None] | None = None,
    executor: Executor | None = None,
) -> Any:
    """Solve a scene, or an assembly of several bodies.

    Parameters
    ----------
    scene : Scene or Assembly
    mesh : BoundaryMesh or mapping of str to BoundaryMesh, optional
        A mesh of your own with the parts of the scene, or meshes of bodies by name, in the coordinates of their shapes.
        By default the meshes that the scene describes, or meshes until its accuracy is reached.
    start : Solution or AssemblySolution, optional
        A solution to start from, on any mesh; see `bemkit.runs.nested.run_cascade`. By default every node sticks; large
        scenes on compressed equations start from a solution on a coarser mesh. Where a scene has several solutions the
        start chooses among them. An error without contact, where there is only one solution.
    file : str or Path, optional
        A result file, ``.h5``, that receives each load step as soon as it is finished. Its status is UNFINISHED until
        the last one. If it holds the beginning of the same history, because a run was killed, the run resumes there,
        with the numbers of a run without interruption. An error with a mesh or a start.
    callback : callable, optional
        Receives a record of every step as soon as it exists.
    executor : Executor, optional
        Where bodies are assembled and factored, copies once. An executor of `concurrent.futures`, or that of a
        `distributed` client; by default in this process, in turn.

    Returns
    -------
    Solution or AssemblySolution
        Look at its status before you use it: a run that did not converge returns its last state. Of a load history
        this is the last step, with the linear solves and the records of all steps.

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
        If the scene is not well posed; the message names the part and the remedy.
    """
    check_stated(scene)
    if file is not None:
        if mesh is not None or start is not None:
            raise InputError("file is given with a mesh or a start, which a run that resumes does not have: remove one")
        from bemkit.runs.checkpoint import run_to_file

        return run_to_file(scene, file, callback, executor)
    if scene.mesh.accuracy is not None and mesh is None:
        from bemkit.runs.adaptive import run_adaptive  # only where it is asked for

        return run_adaptive(scene, callback=callback, executor=executor)[-1]
    if mesh is None and start is None and (cascade := _cascade(scene)):
        from bemkit.runs.nested import run_cascade

        meshes = run_cascade(scene, coarsest=cascade[0], ratio=cascade[1], callback=callback)
        return with_times(meshes[-1], meshes)
    return run_on_mesh(scene, mesh, start, callback, executor)


def _cascade(scene: Stated) -> tuple[int, int] | None:
    """Return elements of the coarsest mesh and the ratio of a cascade, None if a scene is solved on its mesh at once.

    A cascade pays where a contact step costs about as much as the assembly: for half-planes, of which only closed nodes
    are solved for or which have no matrices, and for large bodies on compressed equations.
    """
    if not isinstance(scene, Scene) or scene.n_steps > 1 or not scene.contact_parts:
        return None
    outline, n_elements = scene.shape.outline(), scene.mesh.n_elements
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


def run_probe(scene: Stated, *, n_starts: int = 8, mesh: Meshes = None) -> tuple[Any, ...]:
    """Solve a scene from several starts and return the distinct solutions.

    With Coulomb friction a scene may have more than one solution; which of them `run` returns depends on its start.

    Parameters
    ----------
    scene : Scene or Assembly
        With a single load. With an accuracy, on the meshes that it needs.
    n_starts : int
        Starts: all nodes sticking, open, slipping forward, slipping backward, then random choices (always the same).
    mesh : BoundaryMesh or mapping of str to BoundaryMesh, optional
        As for `run`.

    Returns
    -------
    tuple of Solution or of AssemblySolution
        In the order found, each certified; empty if no start leads to a solution. A single one does not prove that
        there is no other.

    Raises
    ------
    UnsolvableSceneError, ValueError
        As for `run`; also if the scene has a load history or `n_starts` is negative.
    """
    if isinstance(scene, Scene) and not scene.contact_parts:
        raise NoContactError("no part is in contact: the solution is the only one, which run returns")
    if scene.n_steps > 1:
        raise LoadHistoryError(f"a load history of {scene.n_steps} steps cannot be probed: give one load")
    from bemkit.solvers.multistart import probe

    if mesh is None:
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
        return tuple(solution_of(model, result, plan, clock) for result in results if result.is_converged)


def on_its_meshes(scene: Stated) -> tuple[Stated, Meshes]:
    """Return a scene with the discretisations, and the meshes of its bodies, by which it reaches its accuracy.

    Without an accuracy the scene stays as it is.
    """
    if scene.mesh.accuracy is None:
        return scene, None
    found = run(scene)
    if isinstance(found, Solution):
        return found.scene, found.mesh
    placed = {body.name: body.placement for body in scene.placed_bodies}
    return found.assembly, {name: placed[name].inverse.mesh(body.mesh) for name, body in found.bodies.items()}


@dataclass(frozen=True)
class FailedRun:
    """Entry of `run_all` for a scene that was refused.

    Parameters
    ----------
    scene : Scene or Assembly
    error : BemkitError
        What `run` raised; its message names the remedy.
    """

    scene: Stated
    error: BemkitError

    @property
    def is_converged(self) -> bool:
        """False."""
        return False


def run_all(scenes: Iterable[Stated], executor: Executor | None = None) -> list[Any]:
    """Solve several scenes, on any `concurrent.futures.Executor` if one is given.

    Parameters
    ----------
    scenes : iterable of Scene or Assembly
    executor : Executor, optional
        For example a `ProcessPoolExecutor`, or the executor of a `distributed` client. Without one the scenes are
        solved in turn.

    Returns
    -------
    list of Solution, AssemblySolution or FailedRun
        In the order of the scenes. A scene that is refused, such as one that nothing holds, is a `FailedRun`.
    """
    return list(map(_attempt, scenes)) if executor is None else list(executor.map(_attempt, scenes))


def _attempt(scene: Stated) -> Any:
    try:
        return run(scene)
    except BemkitError as error:
        return FailedRun(scene, error.with_traceback(None))  # whose frames hold matrices
