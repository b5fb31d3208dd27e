"""Scenes for the calibration of error estimates: cheap, always solvable, each a function of two whole numbers."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

from bemkit.contact.laws import Coulomb, FrictionLaw, Frictionless, Tresca
from bemkit.contact.obstacle import Gap, Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.formulas import Expression
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import PlateWithHole, Polygon, Rectangle, Ring, Sector, Shape
from bemkit.operators.material import Material
from bemkit.scene.body import Body
from bemkit.scene.conditions import (
    Clamped,
    Condition,
    Contact,
    Free,
    Part,
    PrescribedDisplacement,
    Pressure,
    Roller,
    Traction,
)
from bemkit.scene.contacts import ContactPair
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.scene import Scene
from checks.random_scenes.draw import Draw

HOLE = tuple(f"hole-{k}" for k in range(1, 5))
INNER = tuple(f"inner-{k}" for k in range(1, 5))
OUTER = tuple(f"outer-{k}" for k in range(1, 5))
ARC = ("arc",)
ON_ARC, ON_TOP = MeshOptions(density={"arc": 4.0}), MeshOptions(density={"top": 4.0})
"""Shorter elements where round bodies touch."""


def one_body(draw: Draw) -> Scene:
    """Draw a body that is held, and pressed on a rigid obstacle."""
    kinds: dict[Callable[[Draw, float], tuple[Shape, tuple[Part, ...]]], float] = {
        _block: 4.0,
        _polygon: 2.0,
        _half_disc: 3.0,
        _ring: 1.5,
        _plate: 1.5,
    }
    strain = draw.decades(-4.0, -2.0)
    shape, parts = draw.one_by_weight(kinds)(draw, strain)
    mesh = ON_ARC if isinstance(shape, Sector) else MeshOptions()
    return Scene(
        title="one body", shape=shape, material=_material(draw), parts=parts, law=_law(draw, strain), mesh=mesh
    )


def two_bodies(draw: Draw) -> Scene:
    """Draw a body that is held, and one that is pressed on it."""
    kinds: dict[Callable[[Draw, float], tuple[list[Body], ContactPair]], float] = {
        _stack: 2.0,
        _cylinder_on_block: 3.0,
        _cylinders: 2.0,
        _pin: 2.0,
        _shrink_fit: 1.0,
    }
    strain = draw.decades(-4.0, -2.0)
    bodies, pair = draw.one_by_weight(kinds)(draw, strain)
    return Scene(title="two bodies", bodies=tuple(bodies), contacts=(pair,), law=_law(draw, strain))


def _material(draw: Draw) -> Material:
    return Material(draw.one_of((1.0, 1.0, draw.decades(-1.0, 1.0))), draw.between(0.0, 0.45))


def _law(draw: Draw, strain: float) -> FrictionLaw:
    coefficient, bound = draw.decades(-1.3, 0.3), strain * draw.decades(-2.0, 0.0)
    return draw.one_by_weight({Frictionless(): 2.0, Coulomb(coefficient): 4.0, Tresca(bound): 1.0})


def _moved(draw: Draw, depth: float) -> Condition:
    """Draw a motion downwards, with some shear."""
    return PrescribedDisplacement(draw.one_of((0.0, draw.between(-1.0, 1.0))) * depth, -depth)


def _floor(draw: Draw, strain: float) -> Obstacle:
    """Draw an obstacle below the origin, which it touches."""
    curve = draw.decades(0.0, 1.0) * strain
    match draw.one_by_weight({"plane": 2.0, "circle": 2.0, "bump": 2.0, "waves": 1.0}):
        case "plane":
            return RigidHalfPlane()
        case "circle":
            return RigidCircle((draw.between(-0.2, 0.2), -0.5 / curve), 0.5 / curve)
        case "bump":
            return Gap(Expression(f"{curve!r} * (x - {draw.between(-0.2, 0.2)!r})**2"))
    return Gap(Expression(f"{0.1 * curve!r} * (1 - cos(6.3 * x))"))


def _block(draw: Draw, strain: float) -> tuple[Shape, tuple[Part, ...]]:
    """Draw a block on a floor: moved from above, or loaded there and held at its sides."""
    height = draw.between(0.4, 1.5)
    shape = Rectangle(1.0, height, (-0.5, 0.0))
    parts = [Part("contact", Contact(_floor(draw, strain)), ("bottom",))]
    if draw.chance(0.5):
        return shape, (*parts, Part("top", _moved(draw, strain), ("top",)))
    supports: tuple[Condition, ...] = (Clamped(), Roller())
    loads: tuple[Condition, ...] = (Pressure(strain), Traction(draw.between(-0.5, 0.5) * strain, -strain))
    parts += [Part("wall", draw.one_of(supports), ("left",)), Part("top", draw.one_of(loads), ("top",))]
    return shape, tuple(parts)


def _polygon(draw: Draw, strain: float) -> tuple[Shape, tuple[Part, ...]]:
    """Draw a trapezoid on a floor, moved from above."""
    left, right = draw.between(-0.7, 0.3), draw.between(0.5, 1.0)
    shape = Polygon(((-0.5, 0.0), (0.5, 0.0), (right, 0.8), (left - 0.3, 0.8)), ("bottom", "right", "top", "left"))
    floor = Part("contact", Contact(_floor(draw, strain)), ("bottom",))
    return shape, (floor, Part("top", _moved(draw, strain), ("top",)))


def _half_disc(draw: Draw, strain: float) -> tuple[Shape, tuple[Part, ...]]:
    """Draw half a disc on a plane, a disc or in a groove."""
    radius = draw.between(1.2, 4.0)
    below, above = RigidCircle((0.0, -radius), radius), RigidCavity((0.0, radius), radius)
    obstacles: tuple[Obstacle, ...] = (RigidHalfPlane(), below, above)
    shape = Sector(1.0, 180.0, 360.0, (0.0, 1.0))
    floor = Part("contact", Contact(draw.one_of(obstacles)), ARC, Expression("y < 0.8"))
    return shape, (floor, Part("top", _moved(draw, draw.decades(-2.3, -1.0)), ("start", "end")))


def _ring(draw: Draw, strain: float) -> tuple[Shape, tuple[Part, ...]]:
    """Draw a ring moved on a shaft with play, or on one that is too large."""
    inner, play = draw.between(0.3, 0.7), strain * draw.one_of((-1.0, 1.0))
    shaft = Part("contact", Contact(RigidCircle((0.0, 0.0), inner * (1.0 - play))), INNER)
    return Ring(inner, 1.0), (shaft, Part("rim", _moved(draw, 2.0 * strain), OUTER))


def _plate(draw: Draw, strain: float) -> tuple[Shape, tuple[Part, ...]]:
    """Draw a plate that is pulled along a shaft in its hole."""
    radius, play = draw.between(0.15, 0.35), draw.decades(-2.0, 0.0) * strain
    shaft = Part("contact", Contact(RigidCircle((0.0, 0.0), radius * (1.0 - play))), HOLE)
    return PlateWithHole(1.5, 1.0, radius, (-0.75, -0.5)), (shaft, Part("right", _moved(draw, strain), ("right",)))


def _stack(draw: Draw, strain: float) -> tuple[list[Body], ContactPair]:
    """Draw a block on a block."""
    width = draw.one_of((1.0, draw.between(0.4, 0.9)))
    lower = _held(draw, Rectangle(1.0, draw.between(0.4, 1.0)), "bottom")
    height = lower.shape.height
    place = Placement((0.5 - 0.5 * width, height))
    upper = _pressed(draw, Rectangle(width, draw.between(0.4, 1.0)), ("top",), strain, place)
    gap = Expression(f"{draw.decades(0.0, 1.0) * strain!r} * (x - 0.5)**2") if draw.chance(0.7) else 0.0
    return [lower, upper], _pair(draw, "upper.bottom", "lower.top", gap)


def _cylinder_on_block(draw: Draw, strain: float) -> tuple[list[Body], ContactPair]:
    lower = replace(_held(draw, Rectangle(2.0, 1.0, (-1.0, -1.0)), "bottom"), mesh=ON_TOP)
    shape = Sector(1.0, 180.0, 360.0, (draw.between(-0.3, 0.3), 1.0))
    upper = _pressed(draw, shape, ("start", "end"), draw.decades(-2.3, -1.0), Placement())
    return [lower, upper], _pair(draw, "upper.arc", "lower.top")


def _cylinders(draw: Draw, strain: float) -> tuple[list[Body], ContactPair]:
    radius = draw.between(0.5, 2.0)
    lower = Body(
        name="lower", shape=Sector(radius, 0.0, 180.0, (0.0, -radius)), material=_material(draw),
        parts=(Part("held", Clamped(), ("start", "end")),), mesh=ON_ARC,
    )  # fmt: skip
    shape = Sector(1.0, 180.0, 360.0, (0.0, 1.0))
    upper = _pressed(draw, shape, ("start", "end"), draw.decades(-2.3, -1.0), Placement())
    return [lower, upper], _pair(draw, "upper.arc", "lower.arc")


def _pin(draw: Draw, strain: float) -> tuple[list[Body], ContactPair]:
    """Draw a hollow pin in the hole of a plate, with play or too large."""
    radius, play = draw.between(0.15, 0.35), draw.decades(-1.0, 0.0) * draw.one_of((1.0, 1.0, -1.0)) * strain
    hole = Part("hole", Free(), HOLE)
    plate = Body(
        name="lower", shape=PlateWithHole(1.5, 1.0, radius, (-0.75, -0.5)), material=_material(draw),
        parts=(hole, Part("held", Clamped(), ("left",))),
    )  # fmt: skip
    outer = radius * (1.0 - play)
    rim, core = Part("rim", Free(), OUTER), Part("core", _moved(draw, strain), INNER)
    pin = Body(name="upper", shape=Ring(0.5 * radius, outer), material=_material(draw), parts=(rim, core))
    return [plate, pin], ContactPair(("upper.rim", "lower.hole"), interference=2.0 * radius * max(-play, 0.0))


def _shrink_fit(draw: Draw, strain: float) -> tuple[list[Body], ContactPair]:
    """Draw a ring on a ring that is too large."""
    inside = (Part("held", Clamped(), INNER), Part("rim", Free(), OUTER))
    load = Pressure(strain, draw.one_of((0.0, 0.2)) * strain)
    outside = (Part("hole", Free(), INNER), Part("rim", load, OUTER))
    lower = Body(name="lower", shape=Ring(0.4, 0.7 + strain), material=_material(draw), parts=inside)
    upper = Body(name="upper", shape=Ring(0.7, 1.0), material=_material(draw), parts=outside)
    return [lower, upper], ContactPair(("upper.hole", "lower.rim"), interference=2.0 * strain)


def _held(draw: Draw, shape: Shape, side: str) -> Body:
    return Body(name="lower", shape=shape, material=_material(draw), parts=(Part("held", Clamped(), (side,)),))


def _pressed(draw: Draw, shape: Shape, sides: tuple[str, ...], depth: float, place: Placement) -> Body:
    parts = (Part("press", _moved(draw, depth), sides),)
    mesh = ON_ARC if isinstance(shape, Sector) else None
    return Body(name="upper", shape=shape, material=_material(draw), parts=parts, placement=place, mesh=mesh)


def _pair(draw: Draw, one: str, two: str, gap: float | Expression = 0.0) -> ContactPair:
    sides = draw.one_of(((one, two), (two, one)))
    return ContactPair(sides, gap=gap)
