"""Random scenes that are symmetric about one or two lines."""

from __future__ import annotations

from typing import Any

import numpy as np

from bemkit.contact.obstacle import Cavity, Circle, Gap, HalfPlane, Obstacle
from bemkit.formulas import Expression
from bemkit.geometry.shapes import Disk, PlateWithHole, Rectangle, Ring
from bemkit.geometry.symmetry import Symmetry
from bemkit.scene.conditions import Condition, Contact, Part, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.studies.stability.random_scenes.bodies import Body
from bemkit.studies.stability.random_scenes.draw import between, chance, decades, one_of
from bemkit.studies.stability.random_scenes.touching import random_law


def mirrored_layout(random: np.random.Generator, modulus: float) -> dict[str, Any]:
    """Draw shape, parts, law and symmetry lines of a scene about the origin."""
    size = decades(random, -2.0, 2.0)
    stress = modulus * decades(random, -7.0, -2.0)
    make = one_of(random, (_block, _round, _shrunk))
    shape, parts, symmetry = make(random, size, stress, stress / modulus * size)
    law = random_law(random, Body(shape, size, np.array([0.0, 0.0])), modulus)
    return {"shape": shape, "parts": parts, "symmetry": symmetry, "law": _even(law)}


def _even(law: Any) -> Any:
    """Return a law whose coefficients do not vary with x: symmetric about every line."""
    coefficients = {name: value for name, value in vars(law).items() if isinstance(value, Expression)}
    return type(law)(**{**vars(law), **dict.fromkeys(coefficients, 0.3)}) if coefficients else law


def _block(
    random: np.random.Generator, size: float, stress: float, motion: float
) -> tuple[Rectangle | PlateWithHole, tuple[Part, ...], Symmetry]:
    """Draw a block or a plate on a floor or between floors, pressed from above or from the sides."""
    width, height = size, size * between(random, 0.4, 2.0)
    corner = (-0.5 * width, -0.5 * height)
    shape: Rectangle | PlateWithHole = Rectangle(width, height, corner)
    if chance(random, 0.3):
        shape = PlateWithHole(width, height, 0.5 * min(width, height) * between(random, 0.2, 0.8), corner)
    gap = one_of(random, (0.0, 0.0, size * decades(random, -6.0, -2.0), -size * decades(random, -6.0, -3.0)))
    curve = decades(random, -3.0, 0.0) / size
    obstacles: tuple[Obstacle, ...] = (
        HalfPlane((0.0, -0.5 * height - gap)),
        Gap(gap),
        Gap(Expression(f"{gap!r} + {curve!r} * x**2")),
    )
    floor = Part("contact", Contact(one_of(random, obstacles)), sides=("bottom",))
    conditions: tuple[Condition | None, ...] = (None, Roller(), Pressure(0.3 * stress))
    wall = one_of(random, conditions)
    walls = () if wall is None else (Part("walls", wall, sides=("left", "right")),)
    actions: tuple[Condition, ...] = (Traction(y=-stress), Pressure(stress), PrescribedDisplacement(y=-motion))
    return shape, (floor, *walls, Part("top", one_of(random, actions), sides=("top",))), Symmetry(x=0.0)


def _round(
    random: np.random.Generator, size: float, stress: float, motion: float
) -> tuple[Disk | Ring, tuple[Part, ...], Symmetry]:
    """Draw a disc or a ring on a floor or in a cavity, pressed from above."""
    radius = 0.5 * size
    shape: Disk | Ring = Disk(radius)
    name = "arc"
    if chance(random, 0.5):
        shape, name = Ring(radius * between(random, 0.2, 0.9), radius), "outer"
    gap = one_of(random, (0.0, 0.0, size * decades(random, -6.0, -2.0)))
    large = radius * (1.0 + decades(random, -3.0, 0.0))
    obstacles: tuple[Obstacle, ...] = (
        HalfPlane((0.0, -radius - gap)),
        Cavity((0.0, large - radius - gap), large),
    )
    floor = Part("contact", Contact(one_of(random, obstacles)), sides=(f"{name}-3", f"{name}-4"))
    actions: tuple[Condition, ...] = (Traction(y=-stress), PrescribedDisplacement(y=-motion))
    return shape, (floor, Part("top", one_of(random, actions), sides=(f"{name}-1", f"{name}-2"))), Symmetry(x=0.0)


def _shrunk(
    random: np.random.Generator, size: float, stress: float, motion: float
) -> tuple[Ring, tuple[Part, ...], Symmetry]:
    """Draw a ring shrunk on a shaft, with pressure from outside."""
    shape = Ring(0.5 * size * between(random, 0.2, 0.9), 0.5 * size)
    inner = tuple(f"inner-{k}" for k in range(1, 5))
    obstacles: tuple[Obstacle, ...] = (Gap(-motion), Circle((0.0, 0.0), shape.inner_radius + motion))
    shaft = Part("contact", Contact(one_of(random, obstacles)), sides=inner)
    outer = Part("outer", Pressure(stress), sides=tuple(f"outer-{k}" for k in range(1, 5)))
    return shape, (shaft, outer) if chance(random, 0.5) else (shaft,), Symmetry(x=0.0, y=0.0)
