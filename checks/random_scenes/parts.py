"""Random conditions on the sides of a body: obstacles close to it or cut into it, supports, loads, friction laws."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import cast

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.further_laws import CohesiveCoulomb
from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.obstacle import Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.formulas import Expression
from bemkit.scene.conditions import (
    Clamped,
    Condition,
    Contact,
    Part,
    PrescribedDisplacement,
    Pressure,
    Roller,
    Traction,
)
from checks.random_scenes.bodies import Body, SideSample, pair, turned
from checks.random_scenes.draw import Draw

_LEAST_FACING = 0.2
"""Cosine between a side's normal and the way to the obstacle from which on the side may be a contact part."""


def random_contact(draw: Draw, body: Body, modulus: float) -> tuple[tuple[Part, ...], FloatArray, FrictionLaw]:
    """Draw one or two contact parts, the direction in which loads press the body on them, and the law."""
    down = draw.direction()
    if body.hole is not None and draw.chance(0.45):
        parts = [_shaft(draw, body, body.hole)]
    else:
        parts = _against(draw, body, down, "contact", ())
    if parts and draw.chance(0.2):
        sides = tuple(side for part in parts for side in part.sides)
        across = np.array([-down[1], down[0]]) * draw.one_of((-1.0, 1.0))
        parts += _against(draw, body, across, "second contact", sides)
    if parts and draw.chance(0.2):
        parts[0] = _narrowed(draw, body, parts[0])
    law = random_law(draw, body, modulus)
    if len(parts) > 1 and draw.chance(0.5):
        own = replace(cast(Contact, parts[1].condition), law=random_law(draw, body, modulus))
        parts[1] = replace(parts[1], condition=own)
    return tuple(parts), down, law


def _against(draw: Draw, body: Body, down: FloatArray, name: str, taken: tuple[str, ...]) -> list[Part]:
    """Draw contact with an obstacle that lies in a direction; none if no free side looks there."""
    facing = [s for s in body.sides if s.name not in taken and (s.normals @ down).max() > _LEAST_FACING]
    if not facing:
        return []
    chosen = draw.some_of(facing)
    obstacle = _obstacle(draw, body, down, chosen)
    return [Part(name, Contact(obstacle), sides=tuple(side.name for side in chosen))]


def _obstacle(draw: Draw, body: Body, down: FloatArray, sides: tuple[SideSample, ...]) -> Obstacle:
    points = np.concatenate([side.points for side in sides])
    lowest = points[int(np.argmax((points - body.centre) @ down))]
    distance = _distance(draw, body.size)
    straight = {"plane": 4.0, "tilted": 1.5, "polygon": 1.5, "gap": 2.0, "directed": 0.5}
    match draw.one_by_weight({**straight, "circle": 2.0, "cavity": 1.0, "bump": 1.0}):
        case "polygon":
            return _polygon(draw, body, down, lowest + distance * down)
        case "directed":
            return Gap(distance, direction=pair(down))
        case "plane":
            return RigidHalfPlane(pair(lowest + distance * down), pair(-down))
        case "tilted":
            down = turned(np.radians(draw.between(-25.0, 25.0))) @ down
            lowest = points[int(np.argmax((points - body.centre) @ down))]
            return RigidHalfPlane(pair(lowest + distance * down), pair(-down))
        case "circle":
            radius = body.size * draw.decades(-1.0, 1.5)
            return RigidCircle(pair(lowest + (radius + distance) * down), radius)
        case "cavity":
            reach = float(np.hypot(*(points - body.centre).T).max())
            radius = reach * (1.0 + draw.decades(-3.0, 1.0))
            return RigidCavity(pair(lowest + (distance - radius) * down), radius)
        case "bump":
            x, y = pair(lowest)
            curve = draw.decades(-4.0, 0.0) / body.size
            return Gap(Expression(f"{distance!r} + {curve!r} * ((x - {x!r})**2 + (y - {y!r})**2)"))
    return Gap(distance)


def _polygon(draw: Draw, body: Body, down: FloatArray, top: FloatArray) -> RigidPolygon:
    """Draw a block whose upper side touches a point, or a wedge whose tip does."""
    across = np.array([-down[1], down[0]])
    width, depth = body.size * draw.between(0.2, 1.5), body.size * draw.between(0.2, 2.0)
    corners: tuple[tuple[float, float], ...] = ((1.0, -0.5), (1.0, 0.5), (0.0, 0.5), (0.0, -0.5))
    if draw.chance(0.4):
        corners = ((1.0, -0.5), (1.0, 0.5), (0.0, 0.0))
    return RigidPolygon(tuple(pair(top + d * depth * down + s * width * across) for d, s in corners))


def _shaft(draw: Draw, body: Body, hole: tuple[float, float, float]) -> Part:
    """Draw a shaft in the round hole of a body, with play or shrunk on it, or a gap all around."""
    x, y, radius = hole
    names = [side.name for side in body.sides if _is_round(side, hole)]
    chosen = tuple(names) if draw.chance(0.6) else draw.some_of(names)
    play = radius * draw.decades(-6.0, -1.5) * draw.one_of((-1.0, 1.0, 1.0))
    if draw.chance(0.3):
        return Part("shaft", Contact(Gap(play)), sides=chosen)
    shift = draw.direction() * max(play, 0.0) * draw.one_of((0.0, 1.0, 1.0))
    return Part("shaft", Contact(RigidCircle((x + float(shift[0]), y + float(shift[1])), radius - play)), sides=chosen)


def _is_round(side: SideSample, hole: tuple[float, float, float]) -> bool:
    x, y, radius = hole
    return bool(np.ptp(np.hypot(*(side.points - np.array([x, y])).T)) < 1e-6 * radius) and bool(
        np.hypot(*(side.points[0] - np.array([x, y]))) < 1.000001 * radius
    )


def _distance(draw: Draw, size: float) -> float:
    """Draw a gap: none, some play, or an overlap."""
    match draw.one_by_weight({"none": 0.5, "play": 0.3, "overlap": 0.2}):
        case "play":
            return size * draw.decades(-8.0, -1.5)
        case "overlap":
            return -size * draw.decades(-6.0, -2.0)
    return 0.0


def _narrowed(draw: Draw, body: Body, part: Part) -> Part:
    """Keep one or two small pieces of a contact part."""
    points = np.concatenate([side.points for side in body.sides if side.name in part.sides])
    reach = body.size * draw.decades(-2.0, -0.5)
    pieces = []
    for _ in range(int(draw.integers(1, 3))):
        x, y = pair(points[int(draw.integers(len(points)))])
        pieces.append(f"hypot(x - {x!r}, y - {y!r}) < {reach!r}")
    return replace(part, where=Expression(" or ".join(pieces)))


def random_law(draw: Draw, body: Body, modulus: float) -> FrictionLaw:
    """Draw a friction law, some of them with coefficients that vary along the boundary."""
    coefficient = draw.one_of((0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.5, 1.0, 2.0, 10.0, draw.decades(-3.0, 2.0)))
    stress = modulus * draw.decades(-7.0, -3.0)
    wave = f"(1 + 0.5 * sin(3 * (x - {float(body.centre[0])!r}) / {body.size!r}))"
    varies = draw.chance(0.2)
    match draw.one_by_weight({"coulomb": 5.0, "frictionless": 2.5, "tresca": 1.5, "cohesive": 1.0}):
        case "coulomb":
            return Coulomb(Expression(f"{coefficient!r} * {wave}") if varies else coefficient)
        case "tresca":
            return Tresca(Expression(f"{stress!r} * {wave}") if varies else stress)
        case "cohesive":
            return CohesiveCoulomb(
                coefficient, cohesion=draw.one_of((0.0, stress)), cap=draw.one_of((float("inf"), 10.0 * stress))
            )
    return Frictionless()


def random_actions(draw: Draw, body: Body, taken: Sequence[str], down: FloatArray, modulus: float) -> tuple[Part, ...]:
    """Draw supports and loads that mostly press the body in a direction."""
    free = [side for side in body.sides if side.name not in taken]
    n_supports = min(len(free), draw.one_of((0, 0, 1, 1, 1, 2)))
    order = [free[k] for k in draw.permutation(len(free)).tolist()]
    stress = modulus * draw.decades(-8.0, -2.0)
    parts = [_part(draw, side, _support(draw, body, down, stress / modulus)) for side in order[:n_supports]]
    for side in order[n_supports:]:
        if draw.chance(0.65):
            parts.append(_part(draw, side, _load(draw, body, down, stress)))
    return tuple(parts)


def _part(draw: Draw, side: SideSample, condition: Condition) -> Part:
    """Put a condition on a side, sometimes on a part of it only."""
    if not draw.chance(0.15):
        return Part(side.name, condition, sides=(side.name,))
    axis = int(np.argmax(np.ptp(side.points, axis=0)))
    place = float(side.points[int(draw.integers(5, 20)), axis])
    where = Expression(f"{'xy'[axis]} {draw.one_of('<>')} {place!r}")
    return Part(side.name, condition, sides=(side.name,), where=where)


def _support(draw: Draw, body: Body, down: FloatArray, strain: float) -> Condition:
    motion = strain * body.size * draw.between(0.1, 10.0)
    x, y = (float(motion * component) for component in down)
    match draw.one_by_weight({"roller": 3.0, "clamped": 2.0, "moved": 2.0, "component": 2.0, "turned": 0.7}):
        case "roller":
            return Roller()
        case "clamped":
            return Clamped()
        case "moved":
            return PrescribedDisplacement(x, y)
        case "component":
            along_x = abs(down[0]) > abs(down[1])
            return PrescribedDisplacement(x=x) if along_x != draw.chance(0.2) else PrescribedDisplacement(y=y)
    middle_x, middle_y = (float(component) for component in body.centre)
    turn = motion / body.size
    return PrescribedDisplacement(
        Expression(f"{x!r} - {turn!r} * (y - {middle_y!r})"), Expression(f"{y!r} + {turn!r} * (x - {middle_x!r})")
    )


def _load(draw: Draw, body: Body, down: FloatArray, stress: float) -> Condition:
    if draw.chance(0.2):
        stress *= draw.decades(-4.0, 0.0)
    x, y = (float(stress * component) for component in down)
    middle = float(body.centre[0])
    slope = f"(1 + {draw.between(-1.5, 1.5)!r} * (x - {middle!r}) / {body.size!r})"
    match draw.one_by_weight({"press": 4.0, "oblique": 1.5, "varying": 2.0, "pressure": 2.0, "any": 1.0}):
        case "press":
            return Traction(x, y)
        case "oblique":
            share = draw.between(-0.5, 0.5)
            return Traction(x - share * y, y + share * x)
        case "varying":
            return Traction(Expression(f"{x!r} * {slope}"), Expression(f"{y!r} * {slope}"))
        case "pressure":
            return Pressure(stress * draw.one_of((1.0, 1.0, -0.3)), draw.one_of((0.0, 0.0, 0.2 * stress)))
    x, y = (float(stress * component) for component in draw.direction())
    return Traction(x, y)
