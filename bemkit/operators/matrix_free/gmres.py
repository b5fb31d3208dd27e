"""GMRES whose directions are kept in single precision, in rounds that begin with the true residual.

What a round gains is limited by the precision of its directions, the solution is not: each round begins with the
residual of the solution so far [SaadSchultz1986], so that directions of half the size cost no digits.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from bemkit.arrays import FloatArray

KEPT = 12
"""Directions of a round."""
_GAIN = 1e-5
"""A round ends where it has gained so much. Single precision holds little more, and two rounds of about equal length
take hardly more steps than a single one."""
_SHARE = 0.8
"""A round ends below this share of the target, because its own estimate of the residual is none of round-off."""
_CHUNK = 4096
SingleArray: TypeAlias = NDArray[np.float32]


def gmres(
    product: Callable[[SingleArray], FloatArray],
    residual: Callable[[FloatArray], FloatArray],
    x: FloatArray,
    *,
    tolerance: float,
    size: float,
    max_steps: int,
) -> tuple[int, float]:
    """Solve ``residual(x) = 0`` until the norm of the residual is small.

    Parameters
    ----------
    product : callable
        Minus the derivative of the residual, linear, (n,) float32 array -> (n,) array.
    residual : callable
        (n,) array -> (n,) array.
    x : (n,) array
        Where the iteration begins; the solution is written over it.
    tolerance : float
        Largest norm of the residual, by `size` or by the norm of the first residual, whichever is larger.
    size : float
    max_steps : int
        Of all rounds together.

    Returns
    -------
    n_steps : int
    left : float
        Norm of the true residual in the same measure; above the tolerance if the steps do not suffice, or if a round
        does not halve it, which is round-off.
    """
    directions = np.empty((KEPT + 1, x.size), np.float32)
    directions[0], left = _unit(residual(x))
    unit, n_steps = max(size, left), 0
    while left > tolerance * unit and n_steps < max_steps:
        wanted = max(_SHARE * tolerance * unit, _GAIN * left)
        factors = _round(product, directions, left, wanted, min(KEPT, max_steps - n_steps))
        _add(x, factors, directions)
        n_steps, before = n_steps + factors.size, left
        directions[0], left = _unit(residual(x))
        if not left < 0.5 * before:
            break
    return n_steps, left / unit if unit else 0.0


def _unit(vector: FloatArray) -> tuple[FloatArray, float]:
    """Return a vector of the length one and its length before."""
    size = float(np.linalg.norm(vector))
    vector /= size or 1.0
    return vector, size


def _round(
    product: Callable[[SingleArray], FloatArray], directions: SingleArray, size: float, wanted: float, n_kept: int
) -> FloatArray:
    """Return by which factors of a few directions, found here, what is left of ``size * directions[0]`` is least."""
    hessenberg, right = np.zeros((n_kept + 1, n_kept)), np.zeros(n_kept + 1)
    right[0] = size
    for k in range(n_kept):
        image = product(directions[k])
        hessenberg[: k + 1, k] = _along(directions[: k + 1], image)
        _add(image, -hessenberg[: k + 1, k], directions)
        hessenberg[k + 1, k] = np.linalg.norm(image)
        factors = np.linalg.lstsq(hessenberg[: k + 2, : k + 1], right[: k + 2], rcond=None)[0]
        left = np.linalg.norm(right[: k + 2] - hessenberg[: k + 2, : k + 1] @ factors)
        if left <= wanted or not hessenberg[k + 1, k] > 0.0:
            break
        image /= hessenberg[k + 1, k]
        directions[k + 1] = image
        del image  # while the next one is made
    return np.asarray(factors, float)


def _along(directions: SingleArray, vector: FloatArray) -> FloatArray:
    """Return the products of directions (k, n) with a vector."""
    products = np.zeros(len(directions))
    for some in _chunks(vector):
        products += directions[:, some].astype(float) @ vector[some]
    return products


def _add(vector: FloatArray, factors: FloatArray, directions: SingleArray) -> None:
    """Add to a vector some directions, the first of those given, times factors."""
    for some in _chunks(vector):
        vector[some] += factors @ directions[: factors.size, some].astype(float)


def _chunks(vector: FloatArray) -> Iterator[slice]:
    """Return parts of a vector that stay in the cache together with their directions."""
    return (slice(i, i + _CHUNK) for i in range(0, vector.size, _CHUNK))
