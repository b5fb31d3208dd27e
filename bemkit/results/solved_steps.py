"""The solutions of load steps: each with the records, times and warnings of those before it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from bemkit.errors import ResultWarning, without_duplicates
from bemkit.notebook import ShownInNotebooks
from bemkit.results.solution import Solution, continued
from bemkit.solvers.base import StepRecord

if TYPE_CHECKING:
    from bemkit.scene.scene import Scene


class SolvedSteps(ShownInNotebooks, tuple[Solution, ...]):
    """The solutions of load steps in their order, at least one."""

    __slots__ = ()

    def __repr__(self) -> str:
        """Return one line."""
        last = self[-1]
        return f"SolvedSteps({last.title!r}: {len(self)} steps, the last one {last.status_words})"


def with_totals(result: Solution, solutions: Sequence[Solution], names: Sequence[str]) -> Solution:
    """Return a solution with the steps, linear solves, times and memory of all solutions on the way, in their order.

    `names`, such as "load step 1 of 3", are put before the messages of the steps of each.
    """
    records: tuple[StepRecord, ...] = ()
    for name, solution in zip(names, solutions, strict=True):
        records = continued(records, solution.history, name)
    return replace(
        with_times(result, solutions),
        history=records,
        linear_solves=sum(solution.linear_solves for solution in solutions),
        outer_steps=sum(solution.outer_steps for solution in solutions),
    )


def with_times(result: Solution, solutions: Sequence[Solution]) -> Solution:
    """Return a solution with the total times and the largest memory of all solutions on the way."""
    return replace(
        result,
        timings={name: sum(solution.timings[name] for solution in solutions) for name in result.timings},
        memory={name: max(solution.memory.get(name, 0) for solution in solutions) for name in result.memory},
    )


def following(so_far: Solution | None, solution: Solution, stated: Scene, number: int, n_steps: int) -> Solution:
    """Return a step of a load history with the records, solves, times, memory and warnings of all before it.

    The last warning of each kind and subject is kept; it names its step if that is an earlier one. `at_step` has the
    warnings of a single step.

    Parameters
    ----------
    so_far : Solution, optional
        The result of this function for the step before.
    solution : Solution
        Of the step.
    stated : Scene
        With all steps.
    number, n_steps : int
        Of the step, counted from 1, and of all; at least two.
    """
    name = f"load step {number} of {n_steps}"
    before = () if so_far is None else (so_far,)
    total = with_totals(solution, [*before, solution], [*("" for _ in before), name])
    loading = None if solution.loading is None else replace(solution.loading, asked=stated)
    result = replace(total, message=f"{name}: {solution.message}", loading=loading)
    # the warnings of this step first: of equal ones the first is kept
    earlier = (_of_step(warning, number - 1, n_steps) for one in before for warning in one.warnings)
    return result.with_warnings(without_duplicates((*solution.warnings, *earlier)))


def _of_step(warning: ResultWarning, number: int, n_steps: int) -> ResultWarning:
    """Return a warning that names its step; a warning from a step before does already."""
    if warning.step is not None:
        return warning
    return replace(warning, step=number, text=f"Load step {number} of {n_steps}: {warning.text}")
