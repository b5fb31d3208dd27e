"""Conjugate gradients for several right-hand sides at once.

One search space serves all columns: with each of m columns every step adds m directions to it, so that fewer steps are
needed than for one column alone, and every product with a matrix is a product with a block. The residuals are kept as
R = Q C with columns of Q that are orthonormal in the inner product of the preconditioner; directions that have
nothing left to give are dropped from Q. After [OLeary1980] and [Dubrulle2001].
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import NoResultError
from bemkit.operators.linear.dense import SingularMatrixError, multiply

BlockMap = Callable[[FloatArray], FloatArray]
"""(n, k) array -> (n, k) array, symmetric and linear."""

_DEPENDENT = 1e-14
"""Eigenvalues of a Gram matrix below this, relative to the largest, may be round-off."""
_INDEFINITE = 1e-8
"""Negative eigenvalues of this relative size are no round-off."""


class NotConvergedError(NoResultError):
    """An iterative solver that did not reach its tolerance; the message says how far it came and what helps."""


@dataclass(frozen=True)
class Iterations:
    """What a solution took.

    Parameters
    ----------
    n_columns : int
        Right-hand sides solved together.
    n_steps : int
        Steps of the iteration, each with one product with the matrix and one with the preconditioner.
    """

    n_columns: int
    n_steps: int


def block_cg(
    apply: BlockMap, precondition: BlockMap, right: FloatArray, *, rtol: float, max_steps: int, name: str
) -> tuple[FloatArray, Iterations]:
    """Solve A x = right for all columns.

    Parameters
    ----------
    apply, precondition : callable
        x -> A x and r -> P r with A and P symmetric positive definite.
    right : (n, m) array
        Columns may be zero, or linearly dependent.
    rtol : float
        Each column ends with a residual below this times the column itself, both measured by <r, P r>^(1/2); with a
        good P that is the error of the solution in the energy norm, relative to the solution.
    max_steps : int
    name : str
        What A stands for, for messages.

    Returns
    -------
    x : (n, m) array
    iterations : Iterations

    Raises
    ------
    NotConvergedError
        If `max_steps` do not suffice, or round-off keeps the residual from going down.
    SingularMatrixError
        If A or P turns out to be indefinite.

    Notes
    -----
    The residuals that the recurrence carries drift away from the true ones. When they are small enough the true ones
    are computed, and if these are not, the iteration begins anew with them.
    """
    solution, residual, n_steps = np.zeros(right.shape), right, 0
    target, before = rtol * _sizes(right, precondition(right), name), np.inf
    while True:
        correction, n = _cycle(apply, precondition, residual, target, max_steps - n_steps, name)
        solution, n_steps = solution + correction, n_steps + n
        residual = right - apply(solution)
        sizes = _sizes(residual, precondition(residual), name)
        if np.all(sizes <= target):
            return solution, Iterations(right.shape[1], n_steps)
        worst = float(np.max(sizes[target > 0.0] / target[target > 0.0]))
        # a new beginning that does not gain a factor of two has met round-off
        if n_steps >= max_steps or not worst < 0.5 * before:
            raise NotConvergedError(
                f"{name}: conjugate gradients stopped after {n_steps} of {max_steps} steps with the residual "
                f"{worst * rtol:.1e}, above rtol {rtol:.1e}: use the direct linear solver, or a larger rtol"
            )
        before = worst


def _cycle(
    apply: BlockMap, precondition: BlockMap, right: FloatArray, target: FloatArray, max_steps: int, name: str
) -> tuple[FloatArray, int]:
    """Run the recurrence until its own residuals reach half of the target; return the solution and the steps."""
    solution = np.zeros(right.shape)
    basis, conjugate, coefficients = _orthonormal(right, precondition(right), name)
    directions = conjugate
    for step in range(max_steps):
        if np.all(np.linalg.norm(coefficients, axis=0) <= 0.5 * target):
            return solution, step
        image = apply(directions)
        inverse = _inverse(multiply(directions.T, image), name)
        solution += multiply(directions, inverse @ coefficients)
        remaining = basis - multiply(image, inverse)
        basis, conjugate, factor = _orthonormal(remaining, precondition(remaining), name)
        coefficients = factor @ coefficients
        directions = conjugate + multiply(directions, np.ascontiguousarray(factor.T))
    return solution, max_steps


def _sizes(residual: FloatArray, preconditioned: FloatArray, name: str) -> FloatArray:
    """Return the norms <r, P r>^(1/2) of the columns; round-off below zero counts as zero."""
    squares: FloatArray = np.einsum("nm,nm->m", residual, preconditioned)
    round_off = _INDEFINITE * np.linalg.norm(residual, axis=0) * np.linalg.norm(preconditioned, axis=0)
    if np.any(squares < -round_off):
        raise _indefinite(name)
    return np.sqrt(np.maximum(squares, 0.0))


def _orthonormal(
    columns: FloatArray, preconditioned: FloatArray, name: str
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return Q, P Q and C with columns = Q C and Q^T P Q = I; Q has as many columns as are independent."""
    columns, preconditioned, first = _spread(columns, preconditioned, name, is_last=False)
    columns, preconditioned, second = _spread(columns, preconditioned, name, is_last=True)
    return columns, preconditioned, second @ first


def _spread(
    columns: FloatArray, preconditioned: FloatArray, name: str, *, is_last: bool
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Make columns more nearly orthonormal.

    Eigenvalues of a Gram matrix tell directions only down to the square root of round-off. In a first pass smaller
    ones are taken for just that and kept, and a second pass finds out how large they are. Scaled to one there, what is
    left of dependent columns would be told from directions no more: round-off, for which P Q is not P of Q.
    """
    scale, inverse = _scales(columns, preconditioned, name, is_scaled=not is_last)
    values, vectors = _definite(inverse[:, None] * multiply(columns.T, preconditioned) * inverse, name)
    floor = _DEPENDENT * float(values.max(initial=0.0))
    kept = values > (floor if is_last else -np.inf)
    values, vectors = np.sqrt(np.maximum(values[kept], max(floor, np.finfo(float).tiny))), vectors[:, kept]
    change = inverse[:, None] * vectors / values
    return multiply(columns, change), multiply(preconditioned, change), (values[:, None] * vectors.T) * scale


def _scales(
    columns: FloatArray, preconditioned: FloatArray, name: str, *, is_scaled: bool
) -> tuple[FloatArray, FloatArray]:
    """Return the sizes of the columns, or ones, and their inverses, zero for columns without size."""
    scale = _sizes(columns, preconditioned, name) if is_scaled else np.ones(columns.shape[1])
    inverse = np.zeros(scale.shape)
    np.divide(1.0, scale, out=inverse, where=scale > 0.0)
    return scale, inverse


def _inverse(gram: FloatArray, name: str) -> FloatArray:
    """Invert D^T A D on the directions that it does not annihilate."""
    values, vectors = _definite(gram, name)
    kept = values > _DEPENDENT * float(values.max(initial=0.0))
    inverse: FloatArray = (vectors[:, kept] / values[kept]) @ vectors[:, kept].T
    return inverse


def _definite(gram: FloatArray, name: str) -> tuple[FloatArray, FloatArray]:
    values, vectors = np.linalg.eigh(0.5 * (gram + gram.T))
    if values.size and not values[0] >= -_INDEFINITE * abs(values[-1]):
        raise _indefinite(name)
    return values, vectors


def _indefinite(name: str) -> SingularMatrixError:
    return SingularMatrixError(
        f"{name} is not positive definite: check for coincident elements and for supports that leave the body free"
    )
