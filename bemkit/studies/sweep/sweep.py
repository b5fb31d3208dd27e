"""Solve a scene under all combinations of some of its numbers; bodies that stay the same are factored once."""

from __future__ import annotations

import json
from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from os import cpu_count
from pathlib import Path

from bemkit.atomic_files import reserved
from bemkit.errors import BemkitError
from bemkit.results.solution import Solution
from bemkit.runs.run import run
from bemkit.runs.shared_body import SharedBody
from bemkit.scene.keys import Key
from bemkit.scene.scene import Scene, check_scene
from bemkit.scene.toml import scene_to_toml
from bemkit.studies.engine import Attempt, StudyError, Task, attempt, compute
from bemkit.studies.sweep.grid import all_rows, check_number, keeps_bodies, with_values
from bemkit.studies.sweep.records import FILE, SweepRow, row_of
from bemkit.studies.sweep.table import Sweep

Values = tuple[float, ...]


Compute = Callable[[Sequence[Task[SweepRow]]], Iterable[SweepRow]]
"""Computes the rows of tasks, such as `bemkit.studies.engine.compute`."""


def sweep(
    scene: Scene,
    vary: Mapping[str, Sequence[float]],
    *,
    file: str | Path | None = None,
    executor: Executor | None = None,
    cold: bool = False,
) -> Sweep:
    """Solve a scene for all combinations of values of some of its numbers.

    Rows that differ only in laws, loads and obstacles share their bodies, which are assembled and factored once.

    Parameters
    ----------
    scene : Scene
        Without Python functions: formulas are `Expression`.
    vary : mapping of str to sequence of float
        Places in scene files, such as ``"law.friction_coefficient"`` or ``"bodies.punch.placement.shift[0]"``, and the
        values to take.
    file : str or Path, optional
        JSON Lines file (.jsonl) that gets each row as soon as it is ready. Rows that it already
        has are not computed again.
    executor : Executor, optional
        Such as a `ProcessPoolExecutor`, or that of a `distributed` client. Without one rows are solved in turn.
    cold : bool
        Start each solve with every node sticking, as `bemkit.run` does. By default a solve may start at the solution of
        the row before, which takes fewer steps; it matters for the result only where a scene has several solutions.

    Returns
    -------
    Sweep
        Rows that cannot be solved are in `Sweep.failed`, with a message each.

    Raises
    ------
    StudyError
        If a key leads to no number of the scene, there are no values, or no row at all is a valid scene.
    RowFileError, OutputFileError
        If the file cannot be written, or holds another sweep.
    """
    check_scene(scene)
    computed = partial(compute, executor=executor, n_workers=cpu_count() or 1)
    with reserved(FILE.check(file)):
        return run_sweep(scene, vary, computed, file=file, cold=cold)


def run_sweep(
    scene: Scene,
    vary: Mapping[str, Sequence[float]],
    compute: Compute,
    *,
    file: str | Path | None = None,
    cold: bool = False,
) -> Sweep:
    """Solve a scene under all combinations of some of its numbers into a file that is checked; see `sweep`."""
    keys, grid = all_rows(vary)
    text = scene_to_toml(scene)  # raises for Python functions, which a file cannot hold
    for key in keys:
        check_number(scene, key)
    names = tuple(key.text for key in keys)
    labels = {"scene": text, "keys": json.dumps(names), "starts": "cold" if cold else "near"}
    by_key = FILE.completed(
        file, labels, lambda finished: compute(sweep_tasks(scene, keys, grid, finished=finished, cold=cold))
    )
    return Sweep(scene, names, tuple(by_key[values] for values in grid))


def sweep_tasks(
    scene: Scene,
    keys: Sequence[Key],
    grid: Sequence[Values],
    *,
    finished: Container[object] = (),
    cold: bool = False,
) -> tuple[Task[SweepRow], ...]:
    """Return a task for each row that is not finished, those that share their bodies one after the other.

    Raises
    ------
    BemkitError
        Of the first row, if every row is refused.
    """
    scenes: dict[Values, Scene] = {}
    refused: dict[Values, BemkitError] = {}
    for values in grid:
        try:
            scenes[values] = with_values(scene, dict(zip(keys, values, strict=True)))
        except BemkitError as error:
            refused[values] = error.with_traceback(None)
    if not scenes:
        raise StudyError(f"no row is a valid scene: {refused[grid[0]]}") from refused[grid[0]]
    groups: dict[Values, list[Values]] = {}
    for values in scenes:
        of_body = tuple(value for key, value in zip(keys, values, strict=True) if not keeps_bodies(key))
        groups.setdefault(of_body, []).append(values)
    tasks = []
    for of_body, rows in groups.items():
        shared = [scenes[values] for values in rows]
        # a single scene shares nothing, nor do meshes that follow each solution
        body = None
        if len(rows) > 1 and shared[0].mesh.accuracy is None:
            body = SharedBody(shared, starts_cold=cold)
        left = [values for values in rows if values not in finished]
        for values in left:
            solve = partial(run if body is None else body.run, scenes[values])
            done = body.release if body is not None and values == left[-1] else None
            tasks.append(Task(values, _label(keys, values), partial(_solved_row, values, solve, done), of_body))
    for values, reason in refused.items():
        if values not in finished:
            row = partial(row_of, values, Attempt(None, str(reason), 0.0))
            tasks.append(Task(values, _label(keys, values), row))
    return tuple(tasks)


def _solved_row(values: Values, solve: Callable[[], Solution], done: Callable[[], None] | None) -> SweepRow:
    row = row_of(values, attempt(solve))
    if done is not None:
        done()
    return row


def _label(keys: Sequence[Key], values: Values) -> str:
    return ", ".join(f"{key.text} = {value:g}" for key, value in zip(keys, values, strict=True))
