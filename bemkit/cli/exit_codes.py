"""The exit codes of commands; 0 says solved, or done."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from bemkit.errors import BemkitError, NoResultError

if TYPE_CHECKING:
    from bemkit.results.solution import Solution

NOT_CONVERGED = 1
"""Solved, but not converged; or a method that ends without a result."""
BAD_INPUT = 2
"""One line on standard error says what is wrong."""
INACCURATE = 3
"""Certified, but less accurate than asked for."""
INTERRUPTED, PIPE_CLOSED, TERMINATED = 130, 141, 143


def exit_code_of(solution: Solution) -> int:
    """Return the exit code of a command that solves, draws or reports one solution."""
    if solution.is_converged:
        return 0
    return INACCURATE if solution.is_certified else NOT_CONVERGED


def exit_code_of_error(error: BemkitError) -> int:
    """Return the exit code of a command that an error ends."""
    return NOT_CONVERGED if isinstance(error, NoResultError) else BAD_INPUT


def most_serious(codes: Iterable[int]) -> int:
    """Return the exit code of a command that did several things: bad input is more serious than no convergence."""
    return max(codes, key=(0, INACCURATE, NOT_CONVERGED, BAD_INPUT).index)
