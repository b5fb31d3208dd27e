"""GMRES whose directions are kept in single precision, in rounds that begin with the true residual.

What a round gains is limited by the precision of its directions, the solution is not: each round begins with the
residual of the solution so far [SaadSchultz1986], so that directions of half the size cost no digits.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray

KEPT = 14
"""Directions of a round."""
_GAIN = 1e-5
"""A round ends where it has gained so much. Single precision holds little more, and two rounds of about equal length
take hardly more steps than a single one."""
_SHARE = 0.8
"""A round ends below this share of the target, because its own estimate of the residual is none of round-off."""


def gmres(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, *, target: float, max_steps: int
) -> tuple[FloatArray, int, float]:
    """Solve ``product(x) = right`` until the norm of the residual is below a target.

    Parameters
    ----------
    product : callable
        Linear, (n,) array -> (n,) array.
    right : (n,) array
    target : float
    max_steps : int
        Of all rounds together.

    Returns
    -------
    x : (n,) array
    n_steps : int
    left : float
        Norm of the true residual; above the target if the steps do not suffice, or if a round does not halve it, which
        is round-off.
    """
    solution, residual, n_steps = np.zeros(right.size), right, 0
    left = float(np.linalg.norm(residual))
    while left > target and n_steps < max_steps:
        correction, n = _round(product, residual, target, min(KEPT, max_steps - n_steps))
        solution, n_steps, before = solution + correction, n_steps + n, left
        residual = right - product(solution)
        left = float(np.linalg.norm(residual))
        if not left < 0.5 * before:
            break
    return solution, n_steps, left


def _round(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, target: float, n_kept: int
) -> tuple[FloatArray, int]:
    """Return the combination of a few directions that leaves the least of `right`, and the number of directions."""
    size = float(np.linalg.norm(right))
    directions = np.empty((n_kept + 1, right.size), np.float32)
    directions[0] = right / size
    hessenberg, wanted = np.zeros((n_kept + 1, n_kept)), max(_SHARE * target, _GAIN * size)
    unit = np.zeros(n_kept + 1)
    unit[0] = size
    for k in range(n_kept):
        image = product(directions[k].astype(float))
        for i in range(k + 1):
            direction = directions[i].astype(float)
            hessenberg[i, k] = direction @ image
            image -= hessenberg[i, k] * direction
        hessenberg[k + 1, k] = np.linalg.norm(image)
        factors = np.linalg.lstsq(hessenberg[: k + 2, : k + 1], unit[: k + 2], rcond=None)[0]
        left = np.linalg.norm(unit[: k + 2] - hessenberg[: k + 2, : k + 1] @ factors)
        if left <= wanted or not hessenberg[k + 1, k] > 0.0:
            break
        directions[k + 1] = image / hessenberg[k + 1, k]
    combined = np.zeros(right.size)
    for factor, direction in zip(factors, directions, strict=False):
        combined += factor * direction
    return combined, factors.size
