"""What a solution that is certified may still leave in doubt, in sentences for its reader."""

from __future__ import annotations

from bemkit.solution import Solution

LARGEST_ERROR = 0.05
"""Estimated relative error above which a solution carries a warning."""


def find_warnings(solution: Solution) -> tuple[str, ...]:
    """Say what is doubtful about a solution.

    Parameters
    ----------
    solution : Solution

    Returns
    -------
    tuple of str
        One sentence for each doubt: what it is, its value and the remedy. Those of the plan come first.
    """
    return (*solution.plan.warnings, *_large_error(solution))


def _large_error(solution: Solution) -> tuple[str, ...]:
    error = solution.estimated_error
    if error is None or error <= LARGEST_ERROR:
        return ()
    return (f"The estimated error is {100.0 * error:.2g} %: use more elements, or give an accuracy.",)
