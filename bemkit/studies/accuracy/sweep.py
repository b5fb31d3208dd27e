"""Compute the rows of a study, in turn with run times and memory, or spread over processes for the errors alone."""

from __future__ import annotations

import pickle
import tracemalloc
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from concurrent.futures import BrokenExecutor, Executor, as_completed
from typing import Any

import numpy as np

from bemkit.errors import InputError
from bemkit.reference.compare import answer_of
from bemkit.reference.values import MEASURES, Reference, errors_of
from bemkit.results.solution import Solution
from bemkit.studies.accuracy.rows import STAGES, Row
from bemkit.studies.accuracy.runs import Run, StudyError
from bemkit.studies.stability.sweep import Attempt, attempt

_NAN = float("nan")
_UNTIMED: Mapping[str, float] = {"seconds": _NAN, "peak_memory": _NAN} | {f"seconds_{stage}": _NAN for stage in STAGES}


def timed_rows(
    runs: Sequence[Run],
    reference: Reference,
    *,
    repeat: int = 3,
    finished: Collection[Row] = (),
    begins: Callable[[Run], None] | None = None,
) -> Iterator[Row]:
    """Compute rows with run times and memory, one after the other.

    Parameters
    ----------
    runs : sequence of Run
    reference : Reference
    repeat : int
        Timed repetitions of each run, after one that warms up and before one that measures the memory.
    finished : collection of Row
        Of an earlier study; they are handed on instead of computed again.
    begins : callable, optional
        Called with each run that is computed, before it is.

    Yields
    ------
    Row
        In the order of the runs.

    Raises
    ------
    StudyError
        If `repeat` is not positive.
    """
    if repeat < 1:
        raise StudyError(f"repeat is {repeat}: give at least one timed repetition")
    known = {row.key: row for row in finished}
    for run in runs:
        if run.key in known:
            yield known[run.key]
            continue
        if begins is not None:
            begins(run)
        yield timed_row(run, reference, repeat)


def untimed_rows(
    runs: Sequence[Run], reference: Reference, executor: Executor, *, finished: Collection[Row] = ()
) -> Iterator[Row]:
    """Compute rows on an executor, for the errors alone: runs at the same time would disturb each other's times.

    Parameters
    ----------
    runs : sequence of Run
    reference : Reference
    executor : Executor
        For example a `ProcessPoolExecutor`, or the executor of a `distributed` client.
    finished : collection of Row
        Of an earlier study; they are handed on instead of computed again.

    Yields
    ------
    Row
        Finished ones first, the others as they are ready. Their run times and memory are nan.

    Raises
    ------
    StudyError
        If the executor breaks down, or a scene cannot be sent to another process.
    """
    known = {row.key: row for row in finished}
    yield from (known[run.key] for run in runs if run.key in known)
    futures = []
    try:
        futures = [executor.submit(untimed_row, run, reference) for run in runs if run.key not in known]
        for future in as_completed(futures):
            yield future.result()
    except BrokenExecutor as error:
        reason = str(error) or type(error).__name__
        raise StudyError(
            f"the executor broke down ({reason}): finished rows are good; go on with fewer processes or with one"
        ) from error
    except (pickle.PicklingError, AttributeError, TypeError) as error:
        if "pickle" not in str(error):
            raise
        raise StudyError(
            f"the scene cannot be sent to another process ({error}): write its functions as formulas"
        ) from error
    finally:
        for future in futures:
            future.cancel()


def timed_row(run: Run, reference: Reference, repeat: int) -> Row:
    """Run once to warm up and for the errors, then repeatedly for the times, then once for the memory."""
    found = _attempt(run)
    if not found.is_certified:
        return _row(run, found, reference, _UNTIMED)
    solutions = [again for _ in range(repeat) if (again := _attempt(run).solution) is not None]
    seconds = {stage: float(np.median([each.timings[stage] for each in solutions])) for stage in ("total", *STAGES)}
    measured = {f"seconds_{stage}": seconds[stage] for stage in STAGES}
    return _row(run, found, reference, measured | {"seconds": seconds["total"], "peak_memory": _peak_memory(run)})


def untimed_row(run: Run, reference: Reference) -> Row:
    """Run once for the errors alone."""
    return _row(run, _attempt(run), reference, _UNTIMED)


def _attempt(run: Run) -> Attempt:
    try:
        scene = run.scene
    except InputError as error:
        return Attempt(None, str(error), 0.0)
    return attempt(scene)


def _peak_memory(run: Run) -> float:
    """Return the largest memory [bytes] that one run holds at a time; tracing it slows the run down."""
    tracemalloc.start()
    try:
        _attempt(run)
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def _row(run: Run, found: Attempt, reference: Reference, measured: Mapping[str, Any]) -> Row:
    solution = found.solution
    errors: dict[str, Any] = dict.fromkeys(MEASURES, _NAN)
    if solution is not None and found.is_certified:
        errors = errors_of(answer_of(solution, reference.places), reference)
    counts: dict[str, Any] = {
        "elements": 0 if solution is None else solution.mesh.n_elements,
        "contact_nodes": 0 if solution is None else solution.contact.n_contact,
        "linear_solves": 0 if solution is None else solution.linear_solves,
        "outer_steps": 0 if solution is None else solution.outer_steps,
    }
    return Row(
        discretisation=run.discretisation,
        map=run.map,
        meshes=run.meshes,
        solver=run.solver,
        size=float(run.size),
        status=found.status,
        estimated_error=_NAN if solution is None or solution.estimated_error is None else solution.estimated_error,
        message=_message(found, solution),
        **counts,
        **measured,
        **errors,
    )


def _message(found: Attempt, solution: Solution | None) -> str:
    """Say why there is no result, or why it is not what was wished."""
    return "" if solution is not None and solution.is_converged else found.message
