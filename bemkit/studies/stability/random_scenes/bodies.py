"""Random bodies of every shape, and what the rest of a scene must know of their sides."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring, Sector, Shape
from bemkit.studies.stability.random_scenes.draw import between, chance, decades, one_by_weight, one_of

_SAMPLES = np.linspace(0.02, 0.98, 25)


@dataclass(frozen=True, eq=False)
class SideSample:
    """Points along a side.

    Parameters
    ----------
    name : str
    points, normals : (n, 2) arrays [m], [-]
        The normals point out of the body.
    """

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
        for loop in self.shape.outline().loops:
            for side in loop:
                tangents = side.curve.derivative(_SAMPLES)
                normals = np.column_stack([tangents[:, 1], -tangents[:, 0]])
                unit = normals / np.hypot(*normals.T)[:, None]
                result.append(SideSample(side.name, side.curve.point(_SAMPLES), unit))
        return tuple(result)


def random_body(random: np.random.Generator) -> Body:
    """Draw a body of any size, sometimes far from the origin."""
    size = 1.0 if chance(random, 0.4) else decades(random, -3.0, 3.0)
    far = decades(random, 0.0, 5.0) if chance(random, 0.1) else between(random, 0.0, 2.0)
    angle = between(random, 0.0, 2.0 * np.pi)
    centre = np.zeros(2) if chance(random, 0.4) else size * far * np.array([np.cos(angle), np.sin(angle)])
    kinds: dict[Callable[[np.random.Generator, float, FloatArray], Body], float] = {
        _rectangle: 4.0,
        _tilted_block: 2.0,
        _polygon: 2.0,
        _disk: 2.0,
        _sector: 1.5,
        _ring: 2.0,
        _plate: 2.0,
        _exterior: 1.0,
    }
    return one_by_weight(random, kinds)(random, size, centre)


def _rectangle(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    slenderness = decades(random, -1.0, 1.0) if chance(random, 0.3) else between(random, 0.5, 2.0)
    corner = centre - 0.5 * size * np.array([1.0, slenderness])
    return Body(Rectangle(size, size * slenderness, _pair(corner)), size * max(slenderness, 1.0), centre)


def _tilted_block(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    angle = np.radians(between(random, -60.0, 60.0))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    corners = 0.5 * size * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * [1.0, between(random, 0.4, 2.0)]
    vertices = tuple(_pair(vertex) for vertex in centre + corners @ turn)
    return Body(Polygon(vertices, ("bottom", "right", "top", "left")), size, centre)


def _polygon(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    """Draw a convex polygon; with three corners it is a wedge."""
    turns = np.cumsum(random.uniform(0.4, 1.0, int(random.integers(3, 7))))
    angles = 2.0 * np.pi * (turns / turns[-1] + random.random())
    vertices = tuple(_pair(centre + 0.5 * size * np.array([np.cos(a), np.sin(a)])) for a in angles)
    return Body(Polygon(vertices), size, centre)


def _disk(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    return Body(Disk(0.5 * size, _pair(centre)), size, centre)


def _sector(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    start = float(random.integers(4)) * 90.0 if chance(random, 0.7) else between(random, -180.0, 180.0)
    opening = one_of(random, (90.0, 90.0, 180.0, between(random, 20.0, 300.0)))
    return Body(Sector(0.5 * size, start, start + opening, _pair(centre)), size, centre)


def _ring(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    inner = 0.5 * size * (between(random, 0.2, 0.8) if chance(random, 0.7) else 1.0 - decades(random, -1.5, -0.5))
    return Body(Ring(inner, 0.5 * size, _pair(centre)), size, centre, (*_pair(centre), inner))


def _plate(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    height = size * between(random, 0.5, 1.0)
    radius = 0.5 * height * (between(random, 0.2, 0.8) if chance(random, 0.8) else decades(random, -2.0, -0.7))
    shape = PlateWithHole(size, height, radius, _pair(centre - 0.5 * np.array([size, height])))
    outline_centre = shape.corner[0] + 0.5 * size, shape.corner[1] + 0.5 * height
    return Body(shape, size, centre, (*outline_centre, radius))


def _exterior(random: np.random.Generator, size: float, centre: FloatArray) -> Body:
    if chance(random, 0.6):
        shape = ExteriorOf(Disk(0.5 * size, _pair(centre)))
        return Body(shape, size, centre, (*_pair(centre), 0.5 * size))
    inner = one_of(random, (_rectangle, _polygon))(random, size, centre)
    return Body(ExteriorOf(inner.shape), size, centre)


def _pair(point: FloatArray) -> tuple[float, float]:
    return float(point[0]), float(point[1])
