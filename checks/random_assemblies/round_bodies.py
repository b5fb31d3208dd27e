"""Random arrangements of discs, pins, rings and tunnels."""

from __future__ import annotations

from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Rectangle, Ring
from bemkit.scene.conditions import Clamped, Condition, Free, Part, PrescribedDisplacement, Pressure, Roller, Traction
from checks.random_assemblies.members import Layout, Members, base
from checks.random_scenes.draw import Draw


def discs(draw: Draw, members: Members) -> Layout:
    """Draw one disc or two side by side, between two plates."""
    n = int(draw.integers(1, 3))
    gap, interference = members.gap()
    radius = 0.5 if draw.chance(0.6) else draw.between(0.2, 1.0)
    width = 2.0 * n * radius + draw.between(0.2, 1.0)
    plate = Rectangle(width, draw.between(0.3, 1.0))
    lower = members.body("lower", plate, base(draw, "top"), Placement((0.0, 0.0), 180.0))
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


def pin(draw: Draw, members: Members) -> Layout:
    """Draw a pin in the hole of a plate, with play, fitting or too large."""
    radius = draw.between(0.1, 0.4)
    gap, interference = members.gap()
    play = 0.5 * (gap - interference)
    hole = Part("hole", Free(), tuple(f"hole-{k}" for k in range(1, 5)))
    plate = members.body(
        "plate", PlateWithHole(1.5, 1.0, radius), (hole, *base(draw, "bottom"), *members.loads([], ["right"]))
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


def rings(draw: Draw, members: Members) -> Layout:
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


def tunnel(draw: Draw, members: Members) -> Layout:
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
