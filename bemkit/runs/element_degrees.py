"""Degrees that differ from element to element: lower ones where the next mesh needs no more.

On a geometric mesh the best degrees fall in proportion to the number of layers below the longest element, and smooth
fields on short elements need less than on long ones [GuiBabuska1986]. As every pair of degrees is a sweep of its own,
there are only a few, and only one where the sweeps would cost more than the unknowns.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations

import numpy as np

from bemkit.arrays import FloatArray, IntArray

LEAST_DEGREE = 3
"""Lowest degree whose error follows from the decay of coefficients."""
DEGREES_PER_LAYER = 1.5
"""Decrease of the degree from layer to layer: a square root at the tip of layers that shrink by 0.2 would allow 1.7."""
MOST_KINDS = 3
"""Different degrees of one mesh."""
SWEEP, PRODUCT, ENTRY = 5e-3, 3e-7, 2e-9
"""Seconds for a sweep over the pairs of two degrees, for each product of polynomials on a pair of elements, and for the
third power of the number of nodes (measured)."""


def sufficient_degrees(excess: Callable[[IntArray], FloatArray], n_elements: int, largest: int) -> IntArray:
    """Return the lowest degrees (n_elements,) at which no error exceeds its share; the largest if none suffices.

    Parameters
    ----------
    excess : callable
        Degrees (n_elements,) -> by which factor (n_elements,) errors would be above their shares.
    n_elements : int
    largest : int
    """
    degrees = np.full(n_elements, largest)
    for degree in range(largest - 1, LEAST_DEGREE - 1, -1):
        degrees[(excess(np.full(n_elements, degree)) <= 1.0) & (degrees == degree + 1)] = degree
    return degrees


def below_layers(degrees: IntArray, layers: FloatArray) -> IntArray:
    """Return the degrees (n_elements,) of elements by those of the longest beside them and the layers in between."""
    lowered: IntArray = degrees - np.floor(DEGREES_PER_LAYER * np.round(layers, 2)).astype(np.intp)
    return np.maximum(lowered, LEAST_DEGREE)


def few_kinds(degrees: IntArray) -> IntArray:
    """Return degrees (n_elements,) that are no lower, of a few kinds only: those that cost the least time."""
    present = np.unique(degrees).tolist()
    choices = [
        (*lower, present[-1]) for n in range(min(MOST_KINDS, len(present))) for lower in combinations(present[:-1], n)
    ]
    rounded: list[IntArray] = [np.array(choice)[np.searchsorted(choice, degrees)] for choice in choices]
    return min(rounded, key=_seconds)


def _seconds(degrees: IntArray) -> float:
    n_polynomials = float(np.sum(degrees + 1))
    n_kinds = np.unique(degrees).size
    return SWEEP * n_kinds**2 + PRODUCT * n_polynomials**2 + ENTRY * float(degrees.sum()) ** 3
