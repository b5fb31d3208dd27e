"""Load histories that are written step by step, and resume from the last step in the file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from bemkit.results.result_file import ResultWriter, check_result_target, read_result
from bemkit.results.solution import Solution
from bemkit.runs.adaptive import run_adaptive
from bemkit.runs.mesh_sequence import with_sides_of
from bemkit.runs.steps import RunOptions, run_on_mesh
from bemkit.scene.scene import Scene
from bemkit.scene.toml import scene_to_toml
from bemkit.solvers.base import Status


def run_to_file(scene: Scene, path: str | Path, options: RunOptions) -> Any:
    """Solve a load history and write each finished step to a result file.

    A file that holds the beginning of the same history, because a run was killed, is continued; the numbers are those
    of a run without interruption, to the last bit, but for times. With an accuracy the file holds the steps so far on
    the mesh at hand; a run that goes on solves the coarser meshes again, and of this mesh what is missing.

    Parameters
    ----------
    scene : Scene
        It is compared with that in the file by what a scene file says.
    path : str or Path
        The result file, ``.h5``. Until the last step is there its status is UNFINISHED.
    options : RunOptions
        Without steps of an earlier run, which the file holds.

    Returns
    -------
    Solution
        Of the last step, as `bemkit.run` returns it.

    Raises
    ------
    OutputFileError
        If the file cannot be written.
    SceneError
        If the scene holds a Python function.
    ValueError
        As `bemkit.run`.
    """
    solution: Any
    target = check_result_target(path)
    known = read_result(target) if target.exists() else None
    done: Any = known if known is not None and _is_begun(scene, known) else None

    with ResultWriter(target) as writer:
        options = replace(options, done=done, finished=writer.append)
        if scene.mesh.accuracy is not None:
            solution = run_adaptive(scene, options)[-1]
        else:
            solution = run_on_mesh(scene, options=options)
        writer.finish(solution)
    return solution


def _is_begun(scene: Scene, known: Solution) -> bool:
    """Whether an earlier run has begun a scene; on later meshes it states the sides of the multipliers, too."""
    if known.status is not Status.UNFINISHED:
        return False
    begun = scene_to_toml(known.stated)
    return scene_to_toml(scene) == begun or scene_to_toml(with_sides_of(scene, known)) == begun
