"""Random arrangements of blocks: stacks, walls, crossings, arches."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Polygon, Rectangle
from bemkit.scene.conditions import Clamped, Condition, Contact, Part, Pressure, Roller
from bemkit.scene.contacts import Touching
from bemkit.scene.copies import CircleCopies, GridCopies
from checks.random_assemblies.members import Layout, Members, base
from checks.random_scenes.draw import Draw


def stack(draw: Draw, members: Members) -> Layout:
    """Draw blocks of any width on each other, the topmost pressed; contacts are listed or found."""
    n = int(draw.integers(2, 6))
    widths = [draw.one_of((1.0, 1.0, draw.between(0.3, 2.0))) for _ in range(n)]
    gap, interference = members.gap()
    top, bodies, names = 0.0, [], []
    for k, width in enumerate(widths):
        height = draw.one_of((1.0, 0.5, draw.between(0.2, 1.5)))
        left = draw.one_of((0.0, 0.0, draw.between(-0.4, 0.4)))
        parts = base(draw, "bottom") if k == 0 else ()
        if draw.chance(0.15):
            parts += (Part("wall", Roller(), ("left",)),)
        parts += members.loads(["top"] if k == n - 1 else [], ["right"] if draw.chance(0.3) else [])
        name = f"block {k + 1}"
        bodies.append(members.body(name, Rectangle(width, height), parts, Placement((left, top))))
        top += height + gap - (interference if k < n - 1 else 0.0)
        names.append(name)
    if interference == 0.0 and draw.chance(0.3):
        return Layout(tuple(bodies), touching=Touching(1.5 * gap + 1e-9))
    pairs = [members.pair(f"{b}.bottom", f"{a}.top", interference) for a, b in pairwise(names)]
    return Layout(tuple(bodies), tuple(pairs))


def wall(draw: Draw, members: Members) -> Layout:
    """Draw two or three courses of bricks in running bond on a floor, all copies of one: T-junctions everywhere."""
    columns, rows = int(draw.integers(1, 3)), int(draw.integers(1, 3))
    gap, _ = members.gap()
    pitch = (2.0 + gap, 2.0 * (1.0 + gap))
    brick = Rectangle(2.0, 1.0)
    load = members.loads([], ["left"]) if draw.chance(0.2) else ()
    bodies = [
        members.body("floor", Rectangle(2.0 * columns + 2.0, 1.0), base(draw, "bottom")),
        members.body(
            "even", brick, load, Placement((0.5, 1.0 + gap)), copies=GridCopies(columns, rows, pitch), is_heavy=True
        ),
    ]
    if draw.chance(0.6):
        place = Placement((draw.one_of((1.5, 0.5, 0.9)), 2.0 + 2.0 * gap))
        bodies.append(members.body("odd", brick, (), place, copies=GridCopies(columns, rows, pitch), is_heavy=True))
    return Layout(tuple(bodies), touching=Touching(1.5 * gap + 1e-9))


def crossing(draw: Draw, members: Members) -> Layout:
    """Draw four blocks that meet in a point, between rollers or walls, pressed from two sides."""
    gap, _ = members.gap()
    step = 1.0 + gap
    bodies = []
    for name, x, y in (("sw", 0, 0), ("se", 1, 0), ("nw", 0, 1), ("ne", 1, 1)):
        parts: list[Part] = []
        supports: tuple[Condition, ...] = (Roller(), Roller(), Clamped())
        support = draw.one_of(supports)
        if y == 0:
            parts.append(Part("base", support, ("bottom",)))
        if x == 0 and draw.chance(0.9):
            parts.append(Part("wall", Roller(), ("left",)))
        loads = members.loads(["top"] if y else [], [])
        if x and draw.chance(0.8):
            loads += (Part("push", Pressure(0.5 * members.stress), ("right",)),)
        bodies.append(members.body(name, Rectangle(1.0, 1.0), (*parts, *loads), Placement((x * step, y * step))))
    return Layout(tuple(bodies), touching=Touching(1.5 * gap + 1e-9))


def arch(draw: Draw, members: Members) -> Layout:
    """Draw a semicircle of wedges under their weight on a rigid floor, thick enough or not."""
    n, thickness = int(draw.integers(4, 8)), draw.between(0.05, 0.5)
    angle, inner, outer = 180.0 / n, 1.0 - thickness / 2.0, 1.0 + thickness / 2.0
    end = Placement(turn=angle)
    low, high = ((float(x), float(y)) for x, y in end.forward(np.array([[inner, 0.0], [outer, 0.0]])))
    wedge = Polygon(((inner, 0.0), (outer, 0.0), high, low), ("before", "back", "after", "front"))
    first, last = ((Part("floor", Contact(RigidHalfPlane()), (side,)),) for side in ("before", "after"))
    bodies = (
        members.body("first", wedge, first, is_heavy=True),
        members.body("stone", wedge, (), end, copies=CircleCopies(n - 2, angle), is_heavy=True),
        members.body("last", wedge, last, Placement(turn=180.0 - angle), is_heavy=True),
    )
    return Layout(bodies, touching=Touching(1e-3))
