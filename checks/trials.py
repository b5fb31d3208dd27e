"""Solve random scenes and assemblies and judge what comes out."""

from __future__ import annotations

import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from enum import Enum
from functools import partial
from itertools import pairwise
from math import isnan
from pathlib import Path
from typing import Any

from bemkit.errors import BemkitError
from bemkit.results.solution import Solution
from bemkit.results.tables import TABLES, table_of, to_json
from bemkit.runs.run import run
from bemkit.studies.engine import Task
from bemkit.testing.independent_check import energy_fault, violations_of
from checks.random_assemblies import random_assembly
from checks.random_scenes import RandomCase, random_case

EVERY = 4
"""Every fourth trial has several bodies; the others are what they would be without these."""


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


def drawn_case(seed: int, index: int) -> RandomCase:
    """Draw what a trial solves; see `random_case` and `random_assembly`."""
    return random_assembly(seed, index) if index % EVERY == EVERY - 1 else random_case(seed, index)


def try_case(seed: int, index: int, solve: Callable[[RandomCase], Sequence[Solution]] | None = None) -> Trial:
    """Draw a random scene, solve it, by default with `solved_steps`, and judge the solution; see `drawn_case`."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")  # a warning of numpy is a number that nobody expected
        try:
            return Trial(seed, index, *judge((solve or solved_steps)(drawn_case(seed, index))))
        except BemkitError as error:
            return Trial(seed, index, Outcome.NAMED, type(error).__name__, str(error))
        except Exception as error:
            return Trial(seed, index, Outcome.TRACEBACK, type(error).__name__, traceback.format_exc())


def solved_steps(case: RandomCase) -> Sequence[Solution]:
    """Solve the scenes of a case; one solution for each load step."""
    scenes: Any = case.scenes
    return [run(scenes[0])] if len(scenes) == 1 and scenes[0].n_steps == 1 else run(scenes)


def judge(steps: Iterable[Solution]) -> tuple[Outcome, str, str]:
    """Judge the steps of a load history by the independent check; return outcome, reason and message, see `Trial`."""
    solutions: tuple[Solution, ...] = tuple(steps)
    for before, step in pairwise((None, *solutions)):
        if step is None:
            continue
        if places := list(not_numbers(step)):
            return Outcome.WRONG, "not a number", ", ".join(places)
        if not step.is_converged:
            continue
        check = violations_of(step, before)
        if not check.is_good:
            return Outcome.WRONG, check.faults[0], check.description
        if fault := energy_fault(step):
            return Outcome.WRONG, "energy of the load history", fault
        # meshes of which an earlier step has warned stay what they are when the load goes
        warned = solutions if step.scene.bodies else (step,)
        if check.needs_warning and not any(each.warnings for each in warned):
            return Outcome.WRONG, check.needs_warning, check.description
    last = solutions[-1]
    if not last.is_converged:
        return Outcome.NAMED, last.status.name.lower(), last.message or last.status.value
    if any(step.warnings for step in solutions):
        return Outcome.WARNED, "warning", "; ".join(sorted({each.text for step in solutions for each in step.warnings}))
    return Outcome.SUCCESS, "", ""


def not_numbers(solution: Solution) -> Iterator[str]:
    """Yield where the summary and the tables of a solution hold what is not a number; write the summary, too."""
    to_json(solution)
    yield from _not_numbers(solution.summary(), "summary")
    for name in TABLES:
        if name != "steps" or solution.loading is not None:
            table = table_of(solution, name)
            yield from (f"{name}.{head}" for head in table.names if _has_nan(table.values(head)))


def _not_numbers(content: Any, path: str) -> Iterator[str]:
    if isinstance(content, Mapping):
        for key, value in content.items():
            yield from _not_numbers(value, f"{path}.{key}")
    elif isinstance(content, list | tuple):
        for position, value in enumerate(content):
            yield from _not_numbers(value, f"{path}[{position}]")
    elif _has_nan([content]):
        yield path


def _has_nan(values: Iterable[Any]) -> bool:
    return any(isinstance(value, float) and isnan(value) for value in values)


def trial_tasks(seed: int, indices: Iterable[int]) -> list[Task[Trial]]:
    """Return the tasks of random scenes, for `bemkit.studies.engine.compute`."""
    return [Task((seed, index), f"random scene {index}", partial(try_case, seed, index)) for index in indices]


def save_trial(trial: Trial, folder: Path) -> None:
    """Write the scenes of a trial as TOML into a folder, headed by what was found."""
    lines = [f"{trial.outcome.value}: {trial.reason}", *trial.message.splitlines()]
    head = "".join(f"# {line}\n" for line in lines)
    for name, text in drawn_case(trial.seed, trial.index).files().items():
        (folder / name).write_text(head + text, encoding="utf-8")
