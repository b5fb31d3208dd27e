"""Random arrangements of bodies of about unit size and stiffness: stacks, pins, walls, rings, notches, cracks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np

from bemkit.contact.obstacle import HalfPlane
from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring
from bemkit.scene.assembly import ContactPair, Touching
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
from bemkit.scene.copies import CircleCopies, GridCopies
from bemkit.studies.stability.random_assemblies.members import Members
from bemkit.studies.stability.random_scenes.draw import Draw


@dataclass(frozen=True)
class Layout:
    """Bodies in their places, and what touches what."""

    bodies: tuple[Body, ...]
    contacts: tuple[ContactPair, ...] = field(default_factory=tuple)
    touching: Touching | None = None


def random_layout(draw: Draw, members: Members) -> Layout:
    """Draw an arrangement."""
    kinds: dict[Callable[[Draw, Members], Layout], float] = {
        _stack: 4.0,
        _discs: 2.0,
        _pin: 2.0,
        _wedge: 1.5,
        _wall: 2.0,
        _crossing: 1.5,
        _rings: 1.5,
        _notch: 2.0,
        _split: 1.5,
        _tunnel: 1.0,
        _arch: 0.7,
    }
    return draw.one_by_weight(kinds)(draw, members)


def _base(draw: Draw, side: str) -> tuple[Part, ...]:
    """Draw what holds a body from below: now and then nothing."""
    weights = {"clamped": 6.0, "given": 1.0, "rollers": 0.4, "obstacle": 0.7, "none": 0.2}
    match draw.one_by_weight(weights):
        case "clamped":
            return (Part("base", Clamped(), (side,)),)
        case "given":
            return (Part("base", PrescribedDisplacement(0.0, draw.between(-1e-4, 1e-4)), (side,)),)
        case "rollers":
            return (Part("base", Roller(), (side,)),)
        case "obstacle":
            return (Part("base", Contact(HalfPlane((0.0, 0.0))), (side,)),)
    return ()


def _stack(draw: Draw, members: Members) -> Layout:
    """Draw blocks of any width on each other, the topmost pressed; contacts are listed or found."""
    n = int(draw.integers(2, 6))
    widths = [draw.one_of((1.0, 1.0, draw.between(0.3, 2.0))) for _ in range(n)]
    gap, interference = members.gap()
    top, bodies, names = 0.0, [], []
    for k, width in enumerate(widths):
        height = draw.one_of((1.0, 0.5, draw.between(0.2, 1.5)))
        left = draw.one_of((0.0, 0.0, draw.between(-0.4, 0.4)))
        parts = _base(draw, "bottom") if k == 0 else ()
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


def _discs(draw: Draw, members: Members) -> Layout:
    """Draw one disc or two side by side, between two plates."""
    n = int(draw.integers(1, 3))
    gap, interference = members.gap()
    radius = 0.5 if draw.chance(0.6) else draw.between(0.2, 1.0)
    width = 2.0 * n * radius + draw.between(0.2, 1.0)
    plate = Rectangle(width, draw.between(0.3, 1.0))
    lower = members.body("lower", plate, _base(draw, "top"), Placement((0.0, 0.0), 180.0))
    top = 2.0 * radius + 2.0 * gap - 2.0 * interference
    press = members.loads(["top"], [])
    if draw.chance(0.3):
        press = (Part("press", PrescribedDisplacement(0.0, -1e-3), ("top",)),)
    upper = members.body("upper", plate, press, Placement((-width, top)))
    bodies, pairs = [lower, upper], []
    halves = (Part("low", Free(), ("arc-3", "arc-4")), Part("high", Free(), ("arc-1", "arc-2")))
    for k in range(n):
        x = -0.5 * width + (2.0 * k - n + 1.0) * radius * (1.0 + 1e-9)
        place = Placement((x, radius + gap - interference))
        bodies.append(members.body(f"disc {k + 1}", Disk(radius), halves, place))
        sides = [("low", "lower.bottom"), ("high", "upper.bottom")]
        pairs += [members.pair(f"disc {k + 1}.{own}", other, interference) for own, other in sides]
    return Layout(tuple(bodies), tuple(pairs))


def _pin(draw: Draw, members: Members) -> Layout:
    """Draw a pin in the hole of a plate, with play, fitting or too large."""
    radius = draw.between(0.1, 0.4)
    gap, interference = members.gap()
    play = 0.5 * (gap - interference)
    hole = Part("hole", Free(), tuple(f"hole-{k}" for k in range(1, 5)))
    plate = members.body(
        "plate", PlateWithHole(1.5, 1.0, radius), (hole, *_base(draw, "bottom"), *members.loads([], ["right"]))
    )
    # the part that bears lies below, as drawn, or all around
    below = Placement((0.75, 0.5 - draw.one_of((0.0, 1.0)) * max(play, 0.0)))
    shape: Disk | Ring = Disk(radius - play)
    rim = tuple(f"arc-{k}" for k in range(1, 5))
    parts: tuple[Part, ...] = ()
    if draw.chance(0.4):
        shape, rim = Ring(0.5 * radius, radius - play), tuple(f"outer-{k}" for k in range(1, 5))
        core = tuple(f"inner-{k}" for k in range(1, 5))
        kinds: tuple[Condition, ...] = (Clamped(), Pressure(members.stress), Traction(y=-members.stress))
        condition = draw.one_of(kinds)
        parts = (Part("core", condition, core),)
    pin = members.body("pin", shape, (Part("rim", Free(), rim), *parts), below)
    return Layout((plate, pin), (members.pair("pin.rim", "plate.hole", max(interference, 0.0)),))


def _wedge(draw: Draw, members: Members) -> Layout:
    """Draw a wedge in a notch of nearly the same angle: two contact sides meet at the tip of both bodies."""
    depth, half = draw.between(0.3, 0.7), draw.between(0.1, 0.45)
    block = Polygon(
        ((-1.0, -1.0), (1.0, -1.0), (1.0, 0.0), (half, 0.0), (0.0, -depth), (-half, 0.0), (-1.0, 0.0)),
        ("bottom", "right", "shoulder", "flank right", "flank left", "shoulder left", "left"),
    )
    width = half * draw.one_of((1.0, 1.0, 0.98))
    wedge = Polygon(((0.0, -depth), (width, 0.0), (-width, 0.0)), ("right", "top", "left"))
    gap, _ = members.gap()
    bodies = (
        members.body("block", block, _base(draw, "bottom"), Placement((0.0, 1.0))),
        members.body("wedge", wedge, members.loads(["top"], []), Placement((0.0, 1.0 + gap))),
    )
    if draw.chance(0.4):
        return Layout(bodies, touching=Touching(gap + 0.05))
    return Layout(bodies, tuple(members.pair(f"wedge.{s}", f"block.flank {s}", 0.0) for s in ("left", "right")))


def _wall(draw: Draw, members: Members) -> Layout:
    """Draw two or three courses of bricks in running bond on a floor, all copies of one: T-junctions everywhere."""
    columns, rows = int(draw.integers(1, 3)), int(draw.integers(1, 3))
    gap, _ = members.gap()
    pitch = (2.0 + gap, 2.0 * (1.0 + gap))
    brick = Rectangle(2.0, 1.0)
    load = members.loads([], ["left"]) if draw.chance(0.2) else ()
    bodies = [
        members.body("floor", Rectangle(2.0 * columns + 2.0, 1.0), _base(draw, "bottom")),
        members.body(
            "even", brick, load, Placement((0.5, 1.0 + gap)), copies=GridCopies(columns, rows, pitch), is_heavy=True
        ),
    ]
    if draw.chance(0.6):
        place = Placement((draw.one_of((1.5, 0.5, 0.9)), 2.0 + 2.0 * gap))
        bodies.append(members.body("odd", brick, (), place, copies=GridCopies(columns, rows, pitch), is_heavy=True))
    return Layout(tuple(bodies), touching=Touching(1.5 * gap + 1e-9))


def _crossing(draw: Draw, members: Members) -> Layout:
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


def _rings(draw: Draw, members: Members) -> Layout:
    """Draw rings around each other, shrunk on or loose, pressed from outside."""
    n = int(draw.integers(2, 4))
    gap, interference = members.gap()
    radius, bodies, pairs = 0.4, [], []
    for k in range(n):
        inner, outer = (tuple(f"{side}-{j}" for j in range(1, 5)) for side in ("inner", "outer"))
        wide = radius * draw.between(1.2, 2.0)
        cores: tuple[Condition, ...] = (Clamped(), Clamped(), Free(), Roller())
        parts = [Part("in", Free() if k else draw.one_of(cores), inner)]
        rims: tuple[Condition, ...] = (Pressure(members.stress), Free(), Pressure(members.stress, 0.1 * members.stress))
        last = draw.one_of(rims)
        parts.append(Part("out", Free() if k < n - 1 else last, outer))
        bodies.append(members.body(f"ring {k + 1}", Ring(radius, wide), tuple(parts), Placement(turn=13.0 * k)))
        if k:
            pairs.append(members.pair(f"ring {k}.out", f"ring {k + 1}.in", interference))
        radius = wide + gap - interference
    return Layout(tuple(bodies), tuple(pairs))


def _notch(draw: Draw, members: Members) -> Layout:
    """Draw a block in a corner or a groove: two or three of its sides touch one body, at corners of both."""
    gap, _ = members.gap()
    wall = draw.one_of((0.5, draw.between(0.2, 1.0)))
    height = draw.one_of((1.0, draw.between(0.3, 1.5)))
    if draw.chance(0.5):
        vertices: tuple[tuple[float, float], ...] = (
            *((0, 0), (2, 0), (2, 0.5), (0.5, 0.5), (0.5, 0.5 + wall)),
            (0, 0.5 + wall),
        )
        names: tuple[str, ...] = ("bottom", "end", "floor", "left wall", "rim", "left")
        width = draw.one_of((1.0, 1.5, 0.7))
    else:
        vertices = (
            *((0, 0), (2, 0), (2, 0.5 + wall), (1.5, 0.5 + wall), (1.5, 0.5), (0.5, 0.5), (0.5, 0.5 + wall)),
            (0, 0.5 + wall),
        )
        names = ("bottom", "end", "rim right", "right wall", "floor", "left wall", "rim left", "left")
        width = 1.0 - draw.one_of((0.0, gap, 2.0 * gap))
    corner = Polygon(tuple((float(x), float(y)) for x, y in vertices), names)
    block = Rectangle(width, height)
    loads = members.loads(["top"], []) + (members.loads([], ["right"]) if len(names) == 6 else ())
    bodies = (
        members.body("corner", corner, _base(draw, "bottom")),
        members.body("block", block, loads, Placement((0.5 + draw.one_of((0.0, gap)), 0.5 + gap))),
    )
    if draw.chance(0.5):
        return Layout(bodies, touching=Touching(2.5 * gap + 1e-9))
    pairs = [("bottom", "floor"), ("left", "left wall")] + ([("right", "right wall")] if len(names) == 8 else [])
    return Layout(bodies, tuple(members.pair(f"block.{one}", f"corner.{two}", 0.0) for one, two in pairs))


def _split(draw: Draw, members: Members) -> Layout:
    """Draw a body with a slit whose lips may touch, and sometimes a block on top."""
    opening = draw.decades(-4.0, -1.0)
    low, high = 0.5 - 0.5 * opening, 0.5 + 0.5 * opening
    shape = Polygon(
        ((0.0, 0.0), (1.0, 0.0), (1.0, low), (0.3, low), (0.3, high), (1.0, high), (1.0, 1.0), (0.0, 1.0)),
        ("bottom", "right low", "lip low", "root", "lip high", "right high", "top", "left"),
    )
    gap = draw.one_of((0.0, -opening, -opening - members.stress))
    law = members.pair("split.lip high", "split.lip low", 0.0, gap)
    is_covered = draw.chance(0.3)
    loads = members.loads([] if is_covered else ["top"], [])
    bodies = [members.body("split", shape, (*_base(draw, "bottom"), *loads))]
    pairs = [law]
    if is_covered:
        bodies.append(members.body("block", Rectangle(0.8, 0.5), members.loads(["top"], []), Placement((0.1, 1.0))))
        pairs.append(members.pair("block.bottom", "split.top", 0.0))
    return Layout(tuple(bodies), tuple(pairs))


def _tunnel(draw: Draw, members: Members) -> Layout:
    """Draw a lining or a full disc in a hole of the infinite plane."""
    gap, interference = members.gap()
    rock = members.body("rock", ExteriorOf(Disk(1.0)), (Part("wall", Free(), tuple(f"arc-{k}" for k in range(1, 5))),))
    outer = 1.0 - gap + interference
    if draw.chance(0.5):
        inside = (Part("in", Pressure(members.stress), tuple(f"inner-{k}" for k in range(1, 5))),)
        rim = Part("out", Free(), tuple(f"outer-{k}" for k in range(1, 5)))
        lining = members.body("lining", Ring(0.7, outer), (*inside, rim), Placement())
    else:
        rim = Part("out", Free(), tuple(f"arc-{k}" for k in range(1, 5)))
        lining = members.body("lining", Disk(outer), (rim,), Placement())
    return Layout((rock, lining), (members.pair("lining.out", "rock.wall", interference),))


def _arch(draw: Draw, members: Members) -> Layout:
    """Draw a semicircle of wedges under their weight on a rigid floor, thick enough or not."""
    n, thickness = int(draw.integers(4, 8)), draw.between(0.05, 0.5)
    angle, inner, outer = 180.0 / n, 1.0 - thickness / 2.0, 1.0 + thickness / 2.0
    end = Placement(turn=angle)
    low, high = ((float(x), float(y)) for x, y in end.forward(np.array([[inner, 0.0], [outer, 0.0]])))
    wedge = Polygon(((inner, 0.0), (outer, 0.0), high, low), ("before", "back", "after", "front"))
    first, last = ((Part("floor", Contact(HalfPlane()), (side,)),) for side in ("before", "after"))
    bodies = (
        members.body("first", wedge, first, is_heavy=True),
        members.body("stone", wedge, (), end, copies=CircleCopies(n - 2, angle), is_heavy=True),
        members.body("last", wedge, last, Placement(turn=180.0 - angle), is_heavy=True),
    )
    return Layout(bodies, touching=Touching(1e-3))
