"""Several solves that lead to one result, load steps or meshes, taken together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from bemkit.results.solution import Solution
from bemkit.solvers.base import StepRecord


def with_totals(result: Solution, solutions: Sequence[Solution], names: Sequence[str]) -> Solution:
    """Return a solution with the steps, linear solves, times and memory of all that led to it.

    Parameters
    ----------
    result : Solution
    solutions : sequence of Solution
        All of them, in the order in which they were solved.
    names : sequence of str
        What each of them is, for the remarks of its steps: "load step 1 of 3".

    Returns
    -------
    Solution
    """
    records: list[StepRecord] = []
    for name, solution in zip(names, solutions, strict=True):
        first, spent = (records[-1].step + 1, records[-1].linear_solves) if records else (0, 0)
        for record in solution.history:
            message = f"{name}; {record.message}".rstrip("; ")
            total = spent + record.linear_solves
            records.append(replace(record, step=first + record.step, linear_solves=total, message=message))
    return replace(
        result,
        history=tuple(records),
        linear_solves=sum(solution.linear_solves for solution in solutions),
        outer_steps=sum(solution.outer_steps for solution in solutions),
        timings={name: sum(solution.timings[name] for solution in solutions) for name in result.timings},
        memory={name: max(each.memory.get(name, 0) for each in solutions) for name in result.memory},
    )
