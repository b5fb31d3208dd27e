"""Bisection of elements until one quadrature rule is accurate on each piece."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray

SEPARATION = 3.0
"""Smallest distance of a singular point from the centre of a piece, in half lengths of the piece."""
MAX_SPLITS = 60
"""Largest number of bisections: shorter pieces contribute less than round-off."""


def split_until(
    is_ready: Callable[[IntArray, FloatArray, FloatArray], BoolArray], n_pairs: int, start: float, end: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Bisect an interval for each of several pairs of a point, or an element, and an element.

    Parameters
    ----------
    is_ready : callable
        (pairs, begins, ends) of pieces, each (k,) -> mask (k,) of pieces that need no further bisection.
    n_pairs : int
    start, end : float
        Ends of the interval.

    Returns
    -------
    pair, low, high : (n_pieces,) arrays
        The pair of each piece, and its ends.
    """
    pair, low, high = np.arange(n_pairs), np.full(n_pairs, start), np.full(n_pairs, end)
    finished: list[tuple[IntArray, FloatArray, FloatArray]] = []
    for split in range(MAX_SPLITS + 1):
        ready = is_ready(pair, low, high) | (split == MAX_SPLITS)
        finished.append((pair[ready], low[ready], high[ready]))
        pair, low, high = pair[~ready], low[~ready], high[~ready]
        if not pair.size:
            break
        middle = 0.5 * (low + high)
        pair, low, high = np.tile(pair, 2), np.concatenate([low, middle]), np.concatenate([middle, high])
    pairs, lows, highs = zip(*finished, strict=True)
    return np.concatenate(pairs), np.concatenate(lows), np.concatenate(highs)
