"""Measure the records of a study: run times, memory and errors, or the errors alone where runs disturb each other."""

from __future__ import annotations

import tracemalloc
from collections.abc import Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np

from bemkit.reference.compare import answer_of
from bemkit.reference.values import MEASURES, Reference, errors_of
from bemkit.runs.run import run as solve
from bemkit.studies.accuracy.records import STAGES, ErrorRecord
from bemkit.studies.accuracy.runs import Run
from bemkit.studies.engine import Attempt, StudyError, Task, attempt

_NAN = float("nan")
_UNTIMED: Mapping[str, float] = {"seconds": _NAN, "peak_memory": _NAN} | {f"seconds_{stage}": _NAN for stage in STAGES}


def error_tasks(runs: Sequence[Run], reference: Reference, repeat: int | None = None) -> tuple[Task[ErrorRecord], ...]:
    """Return the tasks of a study, for `bemkit.studies.engine.compute`.

    Parameters
    ----------
    runs : sequence of Run
    reference : Reference
    repeat : int, optional
        Timed repetitions of each run, after one that warms up and before one that measures the memory; by default run
        times and memory are not measured and are nan: runs at the same time would disturb each other.

    Raises
    ------
    StudyError
        If `repeat` is not positive.
    """
    if repeat is not None and repeat < 1:
        raise StudyError(f"repeat is {repeat}: give at least one timed repetition")
    return tuple(
        Task(
            run.key,
            f"{run.discretisation}, {run.meshes} {run.size:g}, {run.solver}",
            partial(measure, run, reference, repeat),
        )
        for run in runs
    )


def measure(run: Run, reference: Reference, repeat: int | None) -> ErrorRecord:
    """Run once to warm up and for the errors, then repeatedly for the times, then once for the memory."""
    first = _attempt(run)
    if repeat is None or first.solution is None or not first.solution.is_certified:
        return _record(run, first, reference, _UNTIMED)
    solutions = [again for _ in range(repeat) if (again := _attempt(run).solution) is not None]
    seconds = {stage: float(np.median([each.timings[stage] for each in solutions])) for stage in ("total", *STAGES)}
    measured = {f"seconds_{stage}": seconds[stage] for stage in STAGES}
    return _record(run, first, reference, measured | {"seconds": seconds["total"], "peak_memory": _peak_memory(run)})


def _attempt(run: Run) -> Attempt:
    # the scene is made inside: what it does not allow is an answer too
    return attempt(lambda: solve(run.scene))


def _peak_memory(run: Run) -> float:
    """Return the largest memory [bytes] that one run holds at a time; tracing it slows the run down."""
    tracemalloc.start()
    try:
        _attempt(run)
        return float(tracemalloc.get_traced_memory()[1])
    finally:
        tracemalloc.stop()


def _record(run: Run, found: Attempt, reference: Reference, measured: Mapping[str, Any]) -> ErrorRecord:
    solution = found.solution
    errors: dict[str, Any] = dict.fromkeys(MEASURES, _NAN)
    if solution is not None and solution.is_certified:
        errors = errors_of(answer_of(solution, reference.places), reference)
    return ErrorRecord(
        discretisation=run.discretisation,
        map=run.map,
        meshes=run.meshes,
        solver=run.solver,
        size=float(run.size),
        status=found.status,
        elements=0 if solution is None else solution.mesh.n_elements,
        contact_nodes=0 if solution is None else solution.contact.n_contact,
        linear_solves=0 if solution is None else solution.linear_solves,
        outer_steps=0 if solution is None else solution.outer_steps,
        estimated_error=_NAN if solution is None or solution.estimated_error is None else solution.estimated_error,
        message="" if found.is_converged else found.message,
        **measured,
        **errors,
    )
