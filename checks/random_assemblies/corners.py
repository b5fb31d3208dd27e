"""Random arrangements with corners in contact: wedges, notches, slits."""

from __future__ import annotations

from bemkit.geometry.placement import Placement
from bemkit.geometry.shapes import Polygon, Rectangle
from bemkit.scene.contacts import Touching
from checks.random_assemblies.members import Layout, Members, base
from checks.random_scenes.draw import Draw


def wedge(draw: Draw, members: Members) -> Layout:
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
        members.body("block", block, base(draw, "bottom"), Placement((0.0, 1.0))),
        members.body("wedge", wedge, members.loads(["top"], []), Placement((0.0, 1.0 + gap))),
    )
    if draw.chance(0.4):
        return Layout(bodies, touching=Touching(gap + 0.05))
    return Layout(bodies, tuple(members.pair(f"wedge.{s}", f"block.flank {s}", 0.0) for s in ("left", "right")))


def notch(draw: Draw, members: Members) -> Layout:
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
        members.body("corner", corner, base(draw, "bottom")),
        members.body("block", block, loads, Placement((0.5 + draw.one_of((0.0, gap)), 0.5 + gap))),
    )
    if draw.chance(0.5):
        return Layout(bodies, touching=Touching(2.5 * gap + 1e-9))
    pairs = [("bottom", "floor"), ("left", "left wall")] + ([("right", "right wall")] if len(names) == 8 else [])
    return Layout(bodies, tuple(members.pair(f"block.{one}", f"corner.{two}", 0.0) for one, two in pairs))


def split(draw: Draw, members: Members) -> Layout:
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
    bodies = [members.body("split", shape, (*base(draw, "bottom"), *loads))]
    pairs = [law]
    if is_covered:
        bodies.append(members.body("block", Rectangle(0.8, 0.5), members.loads(["top"], []), Placement((0.1, 1.0))))
        pairs.append(members.pair("block.bottom", "split.top", 0.0))
    return Layout(tuple(bodies), tuple(pairs))
