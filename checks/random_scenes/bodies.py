"""Random bodies of every shape, and what the rest of a scene must know of their sides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from itertools import chain

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring, Sector, Shape
from checks.random_scenes.draw import Draw

_SAMPLES = np.linspace(0.02, 0.98, 25)


@dataclass(frozen=True, eq=False)
class SideSample:
    """Points along a side, (n, 2) arrays [m], and unit normals [-] that point out of the body."""

    name: str
    points: FloatArray
    normals: FloatArray


@dataclass(frozen=True, eq=False)
class Body:
    """A shape of a known size.

    Parameters
    ----------
    shape : Shape
    size : float [m]
        Of the order of its extent.
    centre : (2,) array [m]
        Somewhere in the middle.
    hole : (float, float, float) or None [m]
        Centre and radius of a round hole.
    """

    shape: Shape
    size: float
    centre: FloatArray
    hole: tuple[float, float, float] | None = None

    @cached_property
    def sides(self) -> tuple[SideSample, ...]:
        """Samples of all sides."""
        result = []
        for side in chain(*self.shape.outline().loops):
            tangents = side.curve.derivative(_SAMPLES)
            normals = np.column_stack([tangents[:, 1], -tangents[:, 0]])
            unit = normals / np.hypot(*normals.T)[:, None]
            result.append(SideSample(side.name, side.curve.point(_SAMPLES), unit))
        return tuple(result)


def random_body(draw: Draw) -> Body:
    """Draw a body of any size, sometimes far from the origin."""
    size = 1.0 if draw.chance(0.4) else draw.decades(-3.0, 3.0)
    far = draw.decades(0.0, 5.0) if draw.chance(0.1) else draw.between(0.0, 2.0)
    angle = draw.between(0.0, 2.0 * np.pi)
    centre = np.zeros(2) if draw.chance(0.4) else size * far * np.array([np.cos(angle), np.sin(angle)])
    kinds: dict[Callable[[Draw, float, FloatArray], Body], float] = {
        _rectangle: 4.0,
        _tilted_block: 2.0,
        _polygon: 2.0,
        _disk: 2.0,
        _sector: 1.5,
        _ring: 2.0,
        _plate: 2.0,
        _exterior: 1.0,
    }
    return draw.one_by_weight(kinds)(draw, size, centre)


def _rectangle(draw: Draw, size: float, centre: FloatArray) -> Body:
    slenderness = draw.decades(-1.0, 1.0) if draw.chance(0.3) else draw.between(0.5, 2.0)
    corner = centre - 0.5 * size * np.array([1.0, slenderness])
    return Body(Rectangle(size, size * slenderness, pair(corner)), size * max(slenderness, 1.0), centre)


def _tilted_block(draw: Draw, size: float, centre: FloatArray) -> Body:
    turn = turned(np.radians(draw.between(-60.0, 60.0))).T
    corners = 0.5 * size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [1.0, draw.between(0.4, 2.0)]
    vertices = tuple(pair(vertex) for vertex in centre + corners @ turn)
    return Body(Polygon(vertices, ("bottom", "right", "top", "left")), size, centre)


def _polygon(draw: Draw, size: float, centre: FloatArray) -> Body:
    """Draw a convex polygon; with three corners it is a wedge."""
    turns = np.cumsum(draw.uniform(0.4, 1.0, int(draw.integers(3, 7))))
    angles = 2.0 * np.pi * (turns / turns[-1] + draw.random())
    vertices = tuple(pair(centre + 0.5 * size * np.array([np.cos(a), np.sin(a)])) for a in angles)
    return Body(Polygon(vertices), size, centre)


def _disk(draw: Draw, size: float, centre: FloatArray) -> Body:
    return Body(Disk(0.5 * size, pair(centre)), size, centre)


def _sector(draw: Draw, size: float, centre: FloatArray) -> Body:
    start = float(draw.integers(4)) * 90.0 if draw.chance(0.7) else draw.between(-180.0, 180.0)
    opening = draw.one_of((90.0, 90.0, 180.0, draw.between(20.0, 300.0)))
    return Body(Sector(0.5 * size, start, start + opening, pair(centre)), size, centre)


def _ring(draw: Draw, size: float, centre: FloatArray) -> Body:
    inner = 0.5 * size * (draw.between(0.2, 0.8) if draw.chance(0.7) else 1.0 - draw.decades(-1.5, -0.5))
    return Body(Ring(inner, 0.5 * size, pair(centre)), size, centre, (*pair(centre), inner))


def _plate(draw: Draw, size: float, centre: FloatArray) -> Body:
    height = size * draw.between(0.5, 1.0)
    radius = 0.5 * height * (draw.between(0.2, 0.8) if draw.chance(0.8) else draw.decades(-2.0, -0.7))
    shape = PlateWithHole(size, height, radius, pair(centre - 0.5 * np.array([size, height])))
    outline_centre = shape.corner[0] + 0.5 * size, shape.corner[1] + 0.5 * height
    return Body(shape, size, centre, (*outline_centre, radius))


def _exterior(draw: Draw, size: float, centre: FloatArray) -> Body:
    if draw.chance(0.6):
        shape = ExteriorOf(Disk(0.5 * size, pair(centre)))
        return Body(shape, size, centre, (*pair(centre), 0.5 * size))
    inner = draw.one_of((_rectangle, _polygon))(draw, size, centre)
    return Body(ExteriorOf(inner.shape), size, centre)


def pair(point: FloatArray) -> tuple[float, float]:
    """Return a point as plain numbers."""
    return float(point[0]), float(point[1])


def turned(angle: float) -> FloatArray:
    """Return the (2, 2) matrix of a rotation by an angle [rad]."""
    return np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
