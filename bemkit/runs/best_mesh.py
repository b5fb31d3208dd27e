"""What a sequence of meshes returns: the best solution last, and why it is not better."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

from bemkit.results.solution import AnySolution, with_totals
from bemkit.solvers.base import Status


def best_last(
    solutions: Sequence[AnySolution],
    obstacle: str,
    accuracy: float,
    *,
    error: Callable[[AnySolution], float],
    shown: Callable[[AnySolution], str],
) -> tuple[AnySolution, ...]:
    """Put the best solution last, with the totals of all and the reason why its accuracy is not what was asked for.

    Parameters
    ----------
    solutions : sequence of solutions
        One for each mesh.
    obstacle : str
        Why the accuracy was not reached; empty if it was.
    accuracy : float
    error, shown : callable
        The estimated error of a solution, infinite without an estimate, and in words.
    """
    best = min((solution for solution in solutions if solution.is_converged), key=error, default=solutions[-1])
    message = f"{len(solutions)} meshes, the last with {best.n_elements} elements. {best.message}"
    status = best.status
    if obstacle:
        message = (
            f"The accuracy {accuracy:g} was not reached: {obstacle}; estimated error {shown(best)}; allow more "
            f"elements or time, or ask for less. {message}"
        )
        status = Status.ACCURACY_NOT_REACHED if best.is_converged else best.status
    names = [f"mesh {number} of {len(solutions)}" for number in range(1, len(solutions) + 1)]
    others = [solution for solution in solutions if solution is not best]
    return (*others, replace(with_totals(best, solutions, names), status=status, message=message))
