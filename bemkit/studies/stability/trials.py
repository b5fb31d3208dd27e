"""Solve random scenes and judge what comes out."""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Iterable
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import pairwise
from pathlib import Path

from bemkit.errors import BemkitError
from bemkit.results.outputs import write_text
from bemkit.results.solution import Solution
from bemkit.runs.history import run_history
from bemkit.runs.run import run
from bemkit.studies.engine import Task
from bemkit.studies.stability.independent_check import IndependentCheck, check_solution
from bemkit.studies.stability.random_scenes import RandomCase, random_case


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
    def key(self) -> tuple[int, int]:
        """What tells trials apart."""
        return self.seed, self.index

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
    """Judge the steps of a load history by the independent check; return outcome, reason and message, see `Trial`."""
    steps = tuple(steps)
    for before, step in pairwise((None, *steps)):
        if step is None or not step.is_converged:
            continue
        check = check_solution(step, before)
        if not check.is_good:
            return Outcome.WRONG, check.faults[0], describe(check)
        if check.needs_warning and not step.warnings:
            return Outcome.WRONG, check.needs_warning, describe(check)
    last = steps[-1]
    if not last.is_converged:
        return Outcome.NAMED, last.status.name.lower(), last.message or last.status.value
    if any(step.warnings for step in steps):
        return Outcome.WARNED, "warning", "; ".join(sorted({text for step in steps for text in step.warnings}))
    return Outcome.SUCCESS, "", ""


def describe(check: IndependentCheck) -> str:
    """Return the entries of the check that are too large, with their values."""
    entries = [f"{name} {check.exact[name]:.1e}" for name in check.faults]
    doubts = [f"{name} {getattr(check, name):.1e}" for name in ("reciprocity", "hidden_overlap")]
    return "; ".join([*entries, *doubts])


def trial_tasks(seed: int, indices: Iterable[int]) -> list[Task[Trial]]:
    """Return the tasks of random scenes, for `bemkit.studies.engine.compute`."""
    return [Task((seed, index), f"random scene {index}", partial(try_case, seed, index)) for index in indices]


def save_trial(trial: Trial, folder: Path) -> None:
    """Write the scenes of a trial as TOML into a folder, headed by what was found."""
    lines = [f"{trial.outcome.value}: {trial.reason}", *trial.message.splitlines()]
    head = "".join(f"# {line}\n" for line in lines)
    for name, text in random_case(trial.seed, trial.index).files().items():
        write_text(str(folder / name), head + text)
