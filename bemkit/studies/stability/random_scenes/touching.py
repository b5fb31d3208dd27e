"""Random contact parts: obstacles that a body is close to, or cut into, and friction laws."""

from __future__ import annotations

from dataclasses import replace
from types import MappingProxyType

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import CohesiveCoulomb, Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.obstacle import Cavity, Circle, Gap, HalfPlane, Obstacle
from bemkit.contact.polygon import PolygonalObstacle
from bemkit.errors import InputError
from bemkit.formulas import Expression
from bemkit.scene.conditions import Contact, Part
from bemkit.studies.stability.random_scenes.bodies import Body, SideSample
from bemkit.studies.stability.random_scenes.draw import (
    between,
    chance,
    decades,
    direction,
    one_by_weight,
    one_of,
    some_of,
)

_LEAST_FACING = 0.2
"""Cosine between a side's normal and the way to the obstacle from which on the side may be a contact part."""
_STRAIGHT = {"plane": 4.0, "tilted": 1.5, "polygon": 1.5, "gap": 2.0, "directed": 0.5}
_OBSTACLES = MappingProxyType({**_STRAIGHT, "circle": 2.0, "cavity": 1.0, "bump": 1.0})


def random_contact(
    random: np.random.Generator, body: Body, modulus: float
) -> tuple[tuple[Part, ...], FloatArray, FrictionLaw]:
    """Draw one or two contact parts, the direction in which loads press the body on them, and the law."""
    down = direction(random)
    if body.hole is not None and chance(random, 0.45):
        parts = [_shaft(random, body)]
    else:
        parts = _against(random, body, down, "contact", ())
    if parts and chance(random, 0.2):
        sides = tuple(side for part in parts for side in part.sides)
        across = np.array([-down[1], down[0]]) * one_of(random, (-1.0, 1.0))
        parts += _against(random, body, across, "second contact", sides)
    if parts and chance(random, 0.2):
        parts[0] = _narrowed(random, body, parts[0])
    law = random_law(random, body, modulus)
    if len(parts) > 1 and chance(random, 0.5):
        parts[1] = _with_law(parts[1], random_law(random, body, modulus))
    return tuple(parts), down, law


def _against(
    random: np.random.Generator, body: Body, down: FloatArray, name: str, taken: tuple[str, ...]
) -> list[Part]:
    """Draw contact with an obstacle that lies in a direction; none if no free side looks there."""
    facing = [s for s in body.sides if s.name not in taken and (s.normals @ down).max() > _LEAST_FACING]
    if not facing:
        return []
    chosen = some_of(random, facing)
    obstacle = _obstacle(random, body, down, chosen)
    return [Part(name, Contact(obstacle), sides=tuple(side.name for side in chosen))]


def _obstacle(random: np.random.Generator, body: Body, down: FloatArray, sides: tuple[SideSample, ...]) -> Obstacle:
    points = np.concatenate([side.points for side in sides])
    lowest = points[int(np.argmax((points - body.centre) @ down))]
    distance = _distance(random, body.size)
    match one_by_weight(random, _OBSTACLES):
        case "polygon":
            return _polygon(random, body, down, lowest + distance * down)
        case "directed":
            return Gap(distance, direction=_pair(down))
        case "plane":
            return _plane(lowest, down, distance)
        case "tilted":
            angle = np.radians(between(random, -25.0, 25.0))
            turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
            lowest = points[int(np.argmax((points - body.centre) @ (turn @ down)))]
            return _plane(lowest, turn @ down, distance)
        case "circle":
            radius = body.size * decades(random, -1.0, 1.5)
            return Circle(_pair(lowest + (radius + distance) * down), radius)
        case "cavity":
            reach = float(np.hypot(*(points - body.centre).T).max())
            radius = reach * (1.0 + decades(random, -3.0, 1.0))
            return Cavity(_pair(lowest + (distance - radius) * down), radius)
        case "bump":
            x, y = _pair(lowest)
            curve = decades(random, -4.0, 0.0) / body.size
            return Gap(Expression(f"{distance!r} + {curve!r} * ((x - {x!r})**2 + (y - {y!r})**2)"))
    return Gap(distance)


def _polygon(random: np.random.Generator, body: Body, down: FloatArray, top: FloatArray) -> PolygonalObstacle:
    """Draw a block whose upper side touches a point, or a wedge whose tip does."""
    across = np.array([-down[1], down[0]])
    width, depth = body.size * between(random, 0.2, 1.5), body.size * between(random, 0.2, 2.0)
    corners: tuple[tuple[float, float], ...] = ((1.0, -0.5), (1.0, 0.5), (0.0, 0.5), (0.0, -0.5))
    if chance(random, 0.4):
        corners = ((1.0, -0.5), (1.0, 0.5), (0.0, 0.0))
    return PolygonalObstacle(tuple(_pair(top + d * depth * down + s * width * across) for d, s in corners))


def _plane(lowest: FloatArray, down: FloatArray, distance: float) -> HalfPlane:
    return HalfPlane(_pair(lowest + distance * down), _pair(-down))


def _shaft(random: np.random.Generator, body: Body) -> Part:
    """Draw a shaft in the round hole of a body, with play or shrunk on it, or a gap all around."""
    if body.hole is None:
        raise InputError(f"the shape {body.shape} has no round hole: draw another one")
    x, y, radius = body.hole
    names = [side.name for side in body.sides if _is_round(side, body.hole)]
    chosen = tuple(names) if chance(random, 0.6) else some_of(random, names)
    play = radius * decades(random, -6.0, -1.5) * one_of(random, (-1.0, 1.0, 1.0))
    if chance(random, 0.3):
        return Part("shaft", Contact(Gap(play)), sides=chosen)
    shift = direction(random) * max(play, 0.0) * one_of(random, (0.0, 1.0, 1.0))
    return Part("shaft", Contact(Circle((x + float(shift[0]), y + float(shift[1])), radius - play)), sides=chosen)


def _is_round(side: SideSample, hole: tuple[float, float, float]) -> bool:
    x, y, radius = hole
    return bool(np.ptp(np.hypot(*(side.points - np.array([x, y])).T)) < 1e-6 * radius) and bool(
        np.hypot(*(side.points[0] - np.array([x, y]))) < 1.000001 * radius
    )


def _distance(random: np.random.Generator, size: float) -> float:
    """Draw a gap: none, some play, or an overlap."""
    kinds = {"none": 0.5, "play": 0.3, "overlap": 0.2}
    match one_by_weight(random, kinds):
        case "play":
            return size * decades(random, -8.0, -1.5)
        case "overlap":
            return -size * decades(random, -6.0, -2.0)
    return 0.0


def _narrowed(random: np.random.Generator, body: Body, part: Part) -> Part:
    """Keep one or two small pieces of a contact part."""
    points = np.concatenate([side.points for side in body.sides if side.name in part.sides])
    reach = body.size * decades(random, -2.0, -0.5)
    pieces = []
    for _ in range(int(random.integers(1, 3))):
        x, y = _pair(points[int(random.integers(len(points)))])
        pieces.append(f"hypot(x - {x!r}, y - {y!r}) < {reach!r}")
    return replace(part, where=Expression(" or ".join(pieces)))


def random_law(random: np.random.Generator, body: Body, modulus: float) -> FrictionLaw:
    """Draw a friction law, some of them with coefficients that vary along the boundary."""
    coefficient = one_of(random, (0.0, 0.05, 0.1, 0.2, 0.3, 0.5, 0.5, 1.0, 2.0, 10.0, decades(random, -3.0, 2.0)))
    stress = modulus * decades(random, -7.0, -3.0)
    wave = f"(1 + 0.5 * sin(3 * (x - {float(body.centre[0])!r}) / {body.size!r}))"
    varies = chance(random, 0.2)
    match one_by_weight(random, {"coulomb": 5.0, "frictionless": 2.5, "tresca": 1.5, "cohesive": 1.0}):
        case "coulomb":
            return Coulomb(Expression(f"{coefficient!r} * {wave}") if varies else coefficient)
        case "tresca":
            return Tresca(Expression(f"{stress!r} * {wave}") if varies else stress)
        case "cohesive":
            return CohesiveCoulomb(
                coefficient, cohesion=one_of(random, (0.0, stress)), cap=one_of(random, (float("inf"), 10.0 * stress))
            )
    return Frictionless()


def _with_law(part: Part, law: FrictionLaw) -> Part:
    if not isinstance(part.condition, Contact):
        raise TypeError(f"part {part.name!r} is no contact part: give one that is")
    return replace(part, condition=replace(part.condition, law=law))


def _pair(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
