"""Limit analysis of rigid rectangular blocks, written without bemkit: the factor by a linear programme of its own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import permutations

import numpy as np
from scipy.optimize import linprog

_SAME = 1e-9


def courses(patterns: Sequence[Sequence[float]], width: float, height: float) -> np.ndarray:
    """Return rectangles (n, 4), (left, bottom, right, top), of courses of blocks; negative widths are openings."""
    blocks = []
    for number, pattern in enumerate(patterns):
        left = 0.0
        for share in pattern:
            right = left + abs(share) * width
            if share > 0.0:
                blocks.append((left, number * height, right, (number + 1) * height))
            left = right
    return np.array(blocks)


def collapse_factor(blocks: np.ndarray, friction: float, dead: np.ndarray, live: np.ndarray) -> float:
    """Return the largest factor of live forces that contact balances together with dead ones.

    Parameters
    ----------
    blocks : (n, 4) array
        Rectangles (left, bottom, right, top); those with bottom = 0 stand on ground.
    friction : float
    dead, live : (n, 3) arrays
        Forces along x and y, and moments about the centres.
    """
    columns = []
    for below, above, point, normal in _ends_of_joints(blocks):
        tangent = np.array([-normal[1], normal[0]])
        for force in (normal + friction * tangent, normal - friction * tangent):
            column = np.zeros((len(blocks), 3))
            for block, sign in ((below, -1.0), (above, 1.0)):
                if block >= 0:
                    arm = point - 0.5 * (blocks[block, :2] + blocks[block, 2:])
                    column[block] += sign * np.array([*force, arm[0] * force[1] - arm[1] * force[0]])
            columns.append(column.ravel())
    balance = np.column_stack([*columns, live.ravel()])
    cost = np.zeros(balance.shape[1])
    cost[-1] = -1.0
    found = linprog(cost, A_eq=balance, b_eq=-dead.ravel(), bounds=(0.0, None), method="highs")
    return float(found.x[-1])


def _ends_of_joints(blocks: np.ndarray):  # type: ignore[no-untyped-def]
    """Yield (lower or left block, other block, end of their joint, normal into the other); the ground is block -1."""
    upwards, sideways = np.array([0.0, 1.0]), np.array([1.0, 0.0])
    for number, (left, bottom, right, _) in enumerate(blocks):
        if abs(bottom) < _SAME:
            yield from ((-1, number, np.array([x, 0.0]), upwards) for x in (left, right))
    for one, two in permutations(range(len(blocks)), 2):
        low, high = np.maximum(blocks[one, :2], blocks[two, :2]), np.minimum(blocks[one, 2:], blocks[two, 2:])
        if abs(blocks[one, 3] - blocks[two, 1]) < _SAME and high[0] - low[0] > _SAME:
            yield from ((one, two, np.array([x, blocks[one, 3]]), upwards) for x in (low[0], high[0]))
        if abs(blocks[one, 2] - blocks[two, 0]) < _SAME and high[1] - low[1] > _SAME:
            yield from ((one, two, np.array([blocks[one, 2], y]), sideways) for y in (low[1], high[1]))
