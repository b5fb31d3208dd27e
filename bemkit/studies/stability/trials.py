"""Solve random scenes and judge what comes out."""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import pairwise

from bemkit.errors import BemkitError
from bemkit.results.solution import Solution
from bemkit.runs.run import run, run_history
from bemkit.studies.stability.evidence import Evidence, examine
from bemkit.studies.stability.random_scenes import RandomCase, random_case
from bemkit.workers import worker_processes


class Outcome(Enum):
    """What became of a random scene."""

    SUCCESS = "success"
    """Called converged without a warning, and the independent check agrees."""
    WARNED = "warned"
    """Called converged with a warning; the check finds nothing wrong but, perhaps, a coarse mesh."""
    NAMED = "named failure"
    """No answer, but a named status or error."""
    WRONG = "wrong success"
    """Called converged against the evidence."""
    TRACEBACK = "traceback"
    """An error that bemkit does not name."""


@dataclass(frozen=True)
class Trial:
    """The outcome of one random scene.

    Parameters
    ----------
    seed, index : int
    outcome : Outcome
    reason : str
        Short: the status, the class of the error, or what the check found.
    message : str
        At length: the remark of the solver, the text of the error, or the numbers of the check.
    """

    seed: int
    index: int
    outcome: Outcome
    reason: str
    message: str

    @property
    def is_failure(self) -> bool:
        """Whether bemkit broke its promise."""
        return self.outcome in (Outcome.WRONG, Outcome.TRACEBACK)


def try_case(seed: int, index: int) -> Trial:
    """Draw a random scene, solve it and judge the answer; see `random_case`."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a warning of numpy is a number that nobody expected
        try:
            steps = solved_steps(random_case(seed, index))
            return Trial(seed, index, *judge(steps))
        except BemkitError as error:
            return Trial(seed, index, Outcome.NAMED, type(error).__name__, str(error))
        except Exception as error:
            return Trial(seed, index, Outcome.TRACEBACK, type(error).__name__, traceback.format_exc())


def solved_steps(case: RandomCase) -> tuple[Solution, ...]:
    """Solve the scenes of a case; one solution for each load step."""
    if len(case.scenes) == 1 and len(case.scenes[0].load_factors) == 1:
        return (run(case.scenes[0]),)
    return run_history(case.scenes)


def judge(steps: Iterable[Solution]) -> tuple[Outcome, str, str]:
    """Judge the steps of a load history, each by the independent check.

    Parameters
    ----------
    steps : iterable of Solution

    Returns
    -------
    outcome : Outcome
    reason, message : str
        See `Trial`.
    """
    steps = tuple(steps)
    for before, step in pairwise((None, *steps)):
        if step is None or not step.is_converged:
            continue
        evidence = examine(step, before)
        if not evidence.is_good:
            return Outcome.WRONG, evidence.faults[0], describe(evidence)
        if evidence.is_coarse and not getattr(step, "warnings", ()):
            return Outcome.WRONG, "reciprocity", describe(evidence)
    last = steps[-1]
    if not last.is_converged:
        return Outcome.NAMED, last.status.name.lower(), last.message or last.status.value
    if any(getattr(step, "warnings", ()) for step in steps):
        return Outcome.WARNED, "warning", "; ".join(sorted({text for step in steps for text in step.warnings}))
    return Outcome.SUCCESS, "", ""


def describe(evidence: Evidence) -> str:
    """Return the entries of the check that are too large, with their values."""
    entries = [f"{name} {evidence.exact[name]:.1e}" for name in evidence.faults]
    doubts = [f"{name} {getattr(evidence, name):.1e}" for name in ("reciprocity", "hidden_overlap")]
    return "; ".join([*entries, *doubts])


def try_cases(seed: int, indices: Iterable[int], *, processes: int = 1) -> Iterator[Trial]:
    """Yield the outcomes of random scenes, in order.

    Parameters
    ----------
    seed : int
    indices : iterable of int
    processes : int
        Among which the scenes are spread.
    """
    if processes == 1:
        yield from (try_case(seed, index) for index in indices)
        return
    with worker_processes(processes) as executor:
        yield from executor.map(partial(try_case, seed), indices, chunksize=4)
