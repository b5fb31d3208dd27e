"""Elements bisected until a single quadrature rule serves each piece."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray

SEPARATION = 3.0
"""A piece is integrated once its centre is this many of its half lengths from every singular point."""
MAX_SPLITS = 60
"""Pieces shorter than 2**-60 of an element carry nothing that a double can hold."""


def split_until(
    is_ready: Callable[[IntArray, FloatArray, FloatArray], BoolArray], n_pairs: int, start: float, end: float
) -> tuple[IntArray, FloatArray, FloatArray]:
    """Bisect an interval for each of several pairs of a point, or an element, and an element.

    Parameters
    ----------
    is_ready : callable
        Pairs (k,) and the ends (k,) of one piece of each -> which of these need no further bisection, (k,).
    n_pairs : int
    start, end : float
        Of the interval.

    Returns
    -------
    pair, low, high : (n_pieces,) arrays
        The pair that each piece belongs to, and its ends.
    """
    pair, low, high = np.arange(n_pairs), np.full(n_pairs, start), np.full(n_pairs, end)
    done: list[tuple[IntArray, FloatArray, FloatArray]] = []
    for split in range(MAX_SPLITS + 1):
        ready = is_ready(pair, low, high) | (split == MAX_SPLITS)
        done.append((pair[ready], low[ready], high[ready]))
        pair, low, high = pair[~ready], low[~ready], high[~ready]
        if not pair.size:
            break
        middle = 0.5 * (low + high)
        pair, low, high = np.tile(pair, 2), np.concatenate([low, middle]), np.concatenate([middle, high])
    pairs, lows, highs = zip(*done, strict=True)
    return np.concatenate(pairs), np.concatenate(lows), np.concatenate(highs)
