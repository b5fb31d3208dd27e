"""Random supports and loads on the sides that no obstacle faces."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.formulas import Expression
from bemkit.scene.conditions import Clamped, Condition, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.studies.stability.random_scenes.bodies import Body, SideSample
from bemkit.studies.stability.random_scenes.draw import between, chance, decades, direction, one_by_weight, one_of


def random_actions(
    random: np.random.Generator, body: Body, taken: Sequence[str], down: FloatArray, modulus: float
) -> tuple[Part, ...]:
    """Draw supports and loads that mostly press the body in a direction."""
    free = [side for side in body.sides if side.name not in taken]
    n_supports = min(len(free), one_of(random, (0, 0, 1, 1, 1, 2)))
    order = [free[k] for k in random.permutation(len(free)).tolist()]
    stress = modulus * decades(random, -8.0, -2.0)
    parts = [_part(random, side, _support(random, body, down, stress / modulus)) for side in order[:n_supports]]
    for side in order[n_supports:]:
        if chance(random, 0.65):
            parts.append(_part(random, side, _load(random, body, down, stress)))
    return tuple(parts)


def _part(random: np.random.Generator, side: SideSample, condition: Condition) -> Part:
    """Put a condition on a side, sometimes on a part of it only."""
    if not chance(random, 0.15):
        return Part(side.name, condition, sides=(side.name,))
    axis = int(np.argmax(np.ptp(side.points, axis=0)))
    place = float(side.points[int(random.integers(5, 20)), axis])
    where = Expression(f"{'xy'[axis]} {one_of(random, '<>')} {place!r}")
    return Part(side.name, condition, sides=(side.name,), where=where)


def _support(random: np.random.Generator, body: Body, down: FloatArray, strain: float) -> Condition:
    motion = strain * body.size * between(random, 0.1, 10.0)
    x, y = (float(motion * component) for component in down)
    match one_by_weight(random, {"roller": 3.0, "clamped": 2.0, "moved": 2.0, "component": 2.0, "turned": 0.7}):
        case "roller":
            return Roller()
        case "clamped":
            return Clamped()
        case "moved":
            return PrescribedDisplacement(x, y)
        case "component":
            along_x = abs(down[0]) > abs(down[1])
            return PrescribedDisplacement(x=x) if along_x != chance(random, 0.2) else PrescribedDisplacement(y=y)
    middle_x, middle_y = (float(component) for component in body.centre)
    turn = motion / body.size
    return PrescribedDisplacement(
        Expression(f"{x!r} - {turn!r} * (y - {middle_y!r})"), Expression(f"{y!r} + {turn!r} * (x - {middle_x!r})")
    )


def _load(random: np.random.Generator, body: Body, down: FloatArray, stress: float) -> Condition:
    if chance(random, 0.2):
        stress *= decades(random, -4.0, 0.0)
    x, y = (float(stress * component) for component in down)
    middle = float(body.centre[0])
    slope = f"(1 + {between(random, -1.5, 1.5)!r} * (x - {middle!r}) / {body.size!r})"
    match one_by_weight(random, {"press": 4.0, "oblique": 1.5, "varying": 2.0, "pressure": 2.0, "any": 1.0}):
        case "press":
            return Traction(x, y)
        case "oblique":
            share = between(random, -0.5, 0.5)
            return Traction(x - share * y, y + share * x)
        case "varying":
            return Traction(Expression(f"{x!r} * {slope}"), Expression(f"{y!r} * {slope}"))
        case "pressure":
            return Pressure(stress * one_of(random, (1.0, 1.0, -0.3)), one_of(random, (0.0, 0.0, 0.2 * stress)))
    x, y = (float(stress * component) for component in direction(random))
    return Traction(x, y)
