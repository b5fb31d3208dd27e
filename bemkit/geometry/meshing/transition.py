"""Element lengths that grow gradually away from a densely divided neighbour.

Where a long element follows a short one, the nodal force between them belongs to the long one, and the traction that is
found from it on the short one is wrong by a share that grows with the ratio of their lengths.
"""

from __future__ import annotations

import math

import numpy as np

from bemkit.arrays import FloatArray

ALIKE = 1.2
"""Ratio of two neighbouring element lengths up to which nothing is done."""
GROWTH = 0.3
"""Growth of the element length per length of boundary, unless there are too few elements for so little."""
TIE = 1e-6
"""A neighbour has shorter elements if they are shorter by more than this share: lengths hold few digits far away."""
LARGEST_STRETCH = 2.0
"""No element is longer than this many times the mean of its piece."""


def gradual_positions(n: int, before: float, after: float) -> FloatArray:
    """Return where `n` elements begin and end along a piece between neighbours that may be divided more densely.

    Parameters
    ----------
    n : int
        Number of elements, at least one.
    before, after : float
        Lengths of the elements next to the piece, in units of its own length; infinite if there are none.

    Returns
    -------
    (n + 1,) array
        Fractions of the length of the piece, increasing from 0 to 1; uniform where the neighbours are alike.

    Notes
    -----
    At the distances s and 1 - s from its ends the elements have the length ``min(H, a + g s, b + g (1 - s))``, where a
    and b are those of the neighbours: with constant tractions, twice that length at a roller costs the pressure there
    an order.
    """
    own = (1.0 - TIE) / n
    if n == 1 or min(before, after) >= own / ALIKE:
        return np.arange(n + 1) / n
    start, end = (length if length < own else LARGEST_STRETCH / n for length in (before, after))
    growth = GROWTH
    while _count(LARGEST_STRETCH / n, start, end, growth) > n:
        growth *= 1.5
    shortest, longest = 1.0 / n, LARGEST_STRETCH / n
    for _ in range(60):  # bisection to round-off
        middle = 0.5 * (shortest + longest)
        shortest, longest = (middle, longest) if _count(middle, start, end, growth) > n else (shortest, middle)
    # the number of elements up to a place is the integral of 1 / length, by sums that crowd where lengths are short
    even = np.linspace(0.0, 1.0, 64 * n + 1)
    near_start, near_end = (size * np.expm1(even * math.log1p(1.0 / size)) for size in (start, end))
    s = np.unique(np.clip(np.concatenate([even, near_start, 1.0 - near_end]), 0.0, 1.0))
    density = 1.0 / np.minimum(longest, np.minimum(start + growth * s, end + growth * (1.0 - s)))
    count = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(s) * (density[1:] + density[:-1]))])
    return np.asarray(np.interp(np.arange(n + 1) / n, count / count[-1], s))


def _count(longest: float, start: float, end: float, growth: float) -> float:
    """Return the number of elements if the longest have a given length."""
    start, end = min(start, longest), min(end, longest)
    level = 1.0 - (2.0 * longest - start - end) / growth
    if level < 0.0:
        peak = 0.5 * (start + end + growth)
        return math.log(peak * peak / (start * end)) / growth
    return math.log(longest * longest / (start * end)) / growth + level / longest
