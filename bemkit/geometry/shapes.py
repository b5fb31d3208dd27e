"""Shapes: bodies given by a few plain numbers, so that scene files can name them."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import Protocol

import numpy as np

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Segment, as_point, require_positive, reverse_curve
from bemkit.geometry.outline import Outline, Side, Surface
from bemkit.geometry.vectors import enclosed_area

_QUADRANTS = np.pi / 2 * np.arange(5)


class Shape(Protocol):
    """Anything with an outline."""

    def outline(self) -> Outline:
        """Return the validated closed loops of named sides that bound the body."""
        ...


class CheckedShape(ABC):
    """A shape whose outline is made and checked once, however many scenes, meshes and messages ask for it."""

    def outline(self) -> Outline:
        """Return the sides of the body."""
        return self._outline

    @cached_property
    @abstractmethod
    def _outline(self) -> Outline: ...


@dataclass(frozen=True)
class Rectangle(CheckedShape):
    """A rectangle with the sides bottom, right, top and left.

    Parameters
    ----------
    width, height : float [m]
        Extents along x and y.
    corner : (float, float) [m]
        Lower left corner, where the boundary starts.
    """

    width: float
    height: float
    corner: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        require_positive("Rectangle", width=self.width, height=self.height)
        object.__setattr__(self, "corner", as_point(self.corner, "Rectangle: corner"))

    @cached_property
    def _outline(self) -> Outline:
        (x, y), x_end, y_end = self.corner, self.corner[0] + self.width, self.corner[1] + self.height
        names = ("bottom", "right", "top", "left")
        return Outline((_polygon_loop(((x, y), (x_end, y), (x_end, y_end), (x, y_end)), names),))


@dataclass(frozen=True)
class Polygon(CheckedShape):
    """A simple polygon.

    Parameters
    ----------
    vertices : tuple of (float, float) [m]
        At least three corners, anticlockwise.
    side_names : tuple of str, optional
        Name of the side that starts at each vertex; by default "side-1", "side-2", ...

    Raises
    ------
    GeometryError
        If the vertices run clockwise, repeat, or make sides that cross or touch.
    """

    vertices: tuple[tuple[float, float], ...]
    side_names: tuple[str, ...] | None = None

    def __post_init__(self) -> None:
        vertices = tuple(as_point(vertex, f"Polygon: vertex {k + 1}") for k, vertex in enumerate(self.vertices))
        if len(vertices) < 3:
            raise GeometryError(f"Polygon: vertices has {len(vertices)} points: give at least three")
        for k, vertex in enumerate(vertices):
            if vertex == vertices[k - 1]:
                raise GeometryError(f"Polygon: vertices repeats the point {vertex} (vertex {k + 1}): remove one")
        if self.side_names is not None:
            object.__setattr__(self, "side_names", tuple(self.side_names))
            if len(self.side_names) != len(vertices):
                raise GeometryError(
                    f"Polygon: side_names has {len(self.side_names)} names for {len(vertices)} sides: name every side"
                )
        is_clockwise = enclosed_area(np.array(vertices)) < 0.0
        object.__setattr__(self, "vertices", vertices[::-1] if is_clockwise else vertices)
        self.outline()  # says first if the sides cross: then their sense is undefined
        if is_clockwise:
            raise GeometryError("Polygon: vertices run clockwise: list the vertices anticlockwise")

    @cached_property
    def _outline(self) -> Outline:
        names = self.side_names or tuple(f"side-{k + 1}" for k in range(len(self.vertices)))
        return Outline((_polygon_loop(self.vertices, names),))


@dataclass(frozen=True)
class Disk(CheckedShape):
    """A disk with the sides arc-1 to arc-4, together arc, one for each quadrant, from angle 0 on.

    Parameters
    ----------
    radius : float [m]
        Its radius.
    centre : (float, float) [m]
        Its centre.
    """

    radius: float
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        require_positive("Disk", radius=self.radius)
        object.__setattr__(self, "centre", as_point(self.centre, "Disk: centre"))

    @cached_property
    def _outline(self) -> Outline:
        return Outline((_circle_loop(self.centre, self.radius, "arc"),))


@dataclass(frozen=True)
class Sector(CheckedShape):
    """A sector of a disk, such as the quarter that symmetry leaves, with the sides arc, end and start.

    Parameters
    ----------
    radius : float [m]
        Of the disk.
    start_angle, end_angle : float [degree]
        Where the arc begins and ends, anticlockwise from the x axis; less than 360 apart.
    centre : (float, float) [m]
        Of the disk, the tip of the sector. The side end leads to it, the side start away from it.
    """

    radius: float
    start_angle: float
    end_angle: float
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        require_positive("Sector", radius=self.radius)
        object.__setattr__(self, "centre", as_point(self.centre, "Sector: centre"))
        if not 0.0 < self.end_angle - self.start_angle < 360.0:
            raise GeometryError(
                f"Sector: the arc runs from {self.start_angle} to {self.end_angle} degrees: end less than 360 degrees "
                "after the start"
            )

    @cached_property
    def _outline(self) -> Outline:
        arc = Arc(self.centre, self.radius, float(np.radians(self.start_angle)), float(np.radians(self.end_angle)))
        begin, end = ((float(x), float(y)) for x, y in arc.point(np.array([0.0, 1.0])))
        sides = (Side("arc", arc), Side("end", Segment(end, self.centre)), Side("start", Segment(self.centre, begin)))
        return Outline((sides,))


@dataclass(frozen=True)
class Ring(CheckedShape):
    """A ring with the sides outer-1 to outer-4, together outer, and inner-1 to inner-4, together inner, by quadrant.

    Parameters
    ----------
    inner_radius, outer_radius : float [m]
        Radii of the hole and of the ring.
    centre : (float, float) [m]
        Common centre.
    """

    inner_radius: float
    outer_radius: float
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        require_positive("Ring", inner_radius=self.inner_radius, outer_radius=self.outer_radius)
        if self.inner_radius >= self.outer_radius:
            raise GeometryError(
                f"Ring: inner_radius is {self.inner_radius}, not less than outer_radius, {self.outer_radius}: "
                "give the smaller radius first"
            )
        object.__setattr__(self, "centre", as_point(self.centre, "Ring: centre"))

    @cached_property
    def _outline(self) -> Outline:
        hole = _hole_loop(self.centre, self.inner_radius, "inner")
        return Outline((_circle_loop(self.centre, self.outer_radius, "outer"), hole))


@dataclass(frozen=True)
class PlateWithHole(CheckedShape):
    """A rectangle with a round hole in the middle: bottom, right, top, left and hole-1 to hole-4, together hole.

    Parameters
    ----------
    width, height : float [m]
        Extents along x and y.
    radius : float [m]
        Radius of the hole, less than half of either extent.
    corner : (float, float) [m]
        Lower left corner.
    """

    width: float
    height: float
    radius: float
    corner: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        require_positive("PlateWithHole", width=self.width, height=self.height, radius=self.radius)
        if 2.0 * self.radius >= min(self.width, self.height):
            raise GeometryError(
                f"PlateWithHole: radius is {self.radius}, but the plate is {self.width} by {self.height}: "
                "give a radius less than half of either"
            )
        object.__setattr__(self, "corner", as_point(self.corner, "PlateWithHole: corner"))

    @cached_property
    def _outline(self) -> Outline:
        centre = (self.corner[0] + 0.5 * self.width, self.corner[1] + 0.5 * self.height)
        plate = Rectangle(self.width, self.height, self.corner).outline()
        return Outline((*plate.loops, _hole_loop(centre, self.radius, "hole")))


@dataclass(frozen=True)
class ExteriorOf(CheckedShape):
    """The infinite plane outside of a shape, with the names of its sides.

    Parameters
    ----------
    shape : Shape
        A bounded shape without holes.
    """

    shape: Shape

    def __post_init__(self) -> None:
        outline = self.shape.outline()
        if outline.is_exterior:
            raise GeometryError("ExteriorOf: shape is already an exterior: give the bounded shape itself")
        if len(outline.loops) > 1:
            raise GeometryError(
                f"ExteriorOf: shape has {len(outline.loops) - 1} hole(s), which are not part of the "
                "exterior: give a shape without holes"
            )

    @cached_property
    def _outline(self) -> Outline:
        outline = self.shape.outline()
        (loop,) = outline.loops
        return Outline((reversed_loop(loop),), is_exterior=True, drawing=outline.drawing)


@dataclass(frozen=True)
class ElasticHalfPlane(CheckedShape):
    """The elastic half-plane y < 0; its only side, surface, is the strip of y = 0 that may carry tractions.

    The rest of its surface is free of traction. A strip that is no longer than needed makes the best use of elements.

    Parameters
    ----------
    left, right : float [m]
        Ends of the strip; it runs from the right to the left, with the body on its left and the normal upward.

    Notes
    -----
    A force displaces the surface by the logarithm of the distance, which has no limit far away. Here the surface is at
    rest at the distance ``right - left`` from the force; any other choice differs by a rigid motion.
    """

    left: float
    right: float

    def __post_init__(self) -> None:
        (left, right) = as_point((self.left, self.right), "ElasticHalfPlane: left and right")
        if left >= right:
            raise GeometryError(f"ElasticHalfPlane: left is {left}, not below right, {right}: give the left end first")

    @cached_property
    def _outline(self) -> Outline:
        return _strip(self.left, self.right)


@dataclass(frozen=True)
class PeriodicHalfPlane(CheckedShape):
    """The elastic half-plane y < 0 under periodic tractions; its only side, surface, is one period of y = 0.

    Parameters
    ----------
    period : float [m]
    left : float [m]
        Where the period begins.

    Notes
    -----
    A resultant force displaces the surface without limit relative to points far below. By definition a mean traction T
    displaces the surface by ``period T / (pi E')`` in the mean, like a wave of the length of the period.
    """

    period: float
    left: float = 0.0

    def __post_init__(self) -> None:
        require_positive("PeriodicHalfPlane", period=self.period)
        as_point((self.left, self.left + self.period), "PeriodicHalfPlane: left and right end")

    @cached_property
    def _outline(self) -> Outline:
        return _strip(self.left, self.left + self.period, is_periodic=True)


def _strip(left: float, right: float, *, is_periodic: bool = False) -> Outline:
    side = Side("surface", Segment((right, 0.0), (left, 0.0)))
    return Outline(((side,),), is_exterior=True, surface=Surface(is_periodic))


def _polygon_loop(vertices: tuple[tuple[float, float], ...], names: tuple[str, ...]) -> tuple[Side, ...]:
    ends = (*vertices[1:], vertices[0])
    return tuple(Side(name, Segment(*pair)) for name, *pair in zip(names, vertices, ends, strict=True))


def _circle_loop(centre: tuple[float, float], radius: float, name: str) -> tuple[Side, ...]:
    """Return a group of four arcs, anticlockwise from angle 0."""
    return tuple(
        Side(f"{name}-{k + 1}", Arc(centre, radius, float(start), float(end)), name)
        for k, (start, end) in enumerate(pairwise(_QUADRANTS))
    )


def _hole_loop(centre: tuple[float, float], radius: float, name: str) -> tuple[Side, ...]:
    """Return four arcs, clockwise from angle 2 pi, so that arc k is that of quadrant k."""
    return reversed_loop(_circle_loop(centre, radius, name))


def reversed_loop(loop: tuple[Side, ...]) -> tuple[Side, ...]:
    """Return the sides traversed the other way, under the same names."""
    return tuple(Side(side.name, reverse_curve(side.curve), side.group) for side in reversed(loop))
