"""Random arrangements of bodies of about unit size and stiffness: stacks, pins, walls, rings, notches, cracks."""

from __future__ import annotations

from collections.abc import Callable

from bemkit.studies.stability.random_assemblies import blocks, corners, round_bodies
from bemkit.studies.stability.random_assemblies.layout import Layout
from bemkit.studies.stability.random_assemblies.members import Members
from bemkit.studies.stability.random_scenes.draw import Draw


def random_layout(draw: Draw, members: Members) -> Layout:
    """Draw an arrangement."""
    kinds: dict[Callable[[Draw, Members], Layout], float] = {
        blocks.stack: 4.0,
        round_bodies.discs: 2.0,
        round_bodies.pin: 2.0,
        corners.wedge: 1.5,
        blocks.wall: 2.0,
        blocks.crossing: 1.5,
        round_bodies.rings: 1.5,
        corners.notch: 2.0,
        corners.split: 1.5,
        round_bodies.tunnel: 1.0,
        blocks.arch: 0.7,
    }
    return draw.one_by_weight(kinds)(draw, members)
