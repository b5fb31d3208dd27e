"""Outlines drawn side by side: straight lines, arcs, curves through points and rational B-splines, in plain numbers."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.curves import Arc, Curve, ParametricCurve, Segment, as_point
from bemkit.geometry.free_form.nurbs import Nurbs, clamped_knots
from bemkit.geometry.outline import Drawing, Outline, Side
from bemkit.geometry.shapes import CheckedShape, reversed_loop
from bemkit.geometry.vectors import circle_centre, cross, norms, senses_of

Point = tuple[float, float]

_FLAT = 100.0
"""Radius over chord above which an arc is a rational B-spline: an angle about a far centre loses digits."""
_SEEN = np.linspace(0.0, 1.0, 33)


class DrawnSide(Protocol):
    """A side that starts where the one before it ends."""

    @property
    def to(self) -> Point:
        """End point [m]."""
        ...

    @property
    def name(self) -> str:
        """Its name; empty for ``side-1``, ``side-2``, ... by its place."""
        ...

    @property
    def group(self) -> str:
        """A name that several sides may have in common, besides their own; may be empty."""
        ...

    def curve(self, start: Point) -> Curve:
        """Return the curve from a point to where it ends; a GeometryError says why there is none."""
        ...


@dataclass(frozen=True)
class LineTo:
    """A straight side.

    Parameters
    ----------
    to : (float, float) [m]
    name, group : str
        See `DrawnSide`.
    """

    to: Point
    name: str = ""
    group: str = ""

    def curve(self, start: Point) -> Curve:
        """Return a segment."""
        return Segment(start, self.to)


@dataclass(frozen=True)
class ArcTo:
    """A circular arc.

    Parameters
    ----------
    to : (float, float) [m]
        Where it ends; where it starts, if it is a whole circle.
    through : (float, float) [m]
        Another point of it, best near the middle; of a whole circle the opposite one.
    name, group : str
        See `DrawnSide`.
    """

    to: Point
    through: Point
    name: str = ""
    group: str = ""

    def curve(self, start: Point) -> Curve:
        """Return an arc; a very flat one as a rational B-spline, which keeps its digits."""
        begin, middle, end = (np.array(as_point(each, "arc")) for each in (start, self.through, self.to))
        to_middle, to_end = middle - begin, end - begin
        if not to_end.any():
            return _arc(begin + 0.5 * to_middle, begin, 2.0 * np.pi)
        centre = circle_centre(begin, middle, end)
        if centre is None:
            raise GeometryError(
                f"arc from {format_point(begin)} through {format_point(middle)} to {format_point(end)} is straight: "
                "write a line"
            )
        angles = np.arctan2(*np.array([begin - centre, end - centre]).T[::-1])
        is_anticlockwise = cross(to_middle, to_end) > 0.0  # the middle lies to the right of the chord
        sweep = float((angles[1] - angles[0]) % (2.0 * np.pi))
        sweep = sweep if is_anticlockwise else sweep - 2.0 * np.pi
        chord = float(norms(to_end))
        if float(norms(begin - centre)) > _FLAT * chord and abs(sweep) < np.pi:
            to_tip = 0.5 * to_end + 0.5 * math.tan(0.5 * sweep) * np.array([to_end[1], -to_end[0]])
            weights = np.array([1.0, math.cos(0.5 * sweep), 1.0])
            return Nurbs(np.array([begin, begin + to_tip, end]), 2, clamped_knots(3, 2), weights).curve()
        return _arc(centre, begin, sweep)


@dataclass(frozen=True)
class SplineTo:
    """A smooth curve through points: a cubic spline by the length of chords, with continuous curvature.

    Parameters
    ----------
    to : (float, float) [m]
        Where it ends; where it starts, if the curve closes smoothly.
    through : tuple of (float, float) [m]
        The points between, in order; at least one, of a closed curve three.
    name, group : str
        See `DrawnSide`.
    """

    to: Point
    through: tuple[Point, ...]
    name: str = ""
    group: str = ""

    def curve(self, start: Point) -> Curve:
        """Return the spline by its arc length."""
        from scipy.interpolate import CubicSpline

        points = np.array([start, *self.through, self.to], dtype=float)
        steps = norms(np.diff(points, axis=0))
        is_closed = tuple(start) == tuple(self.to)
        if len(self.through) < (3 if is_closed else 1):
            raise GeometryError(f"spline through {len(self.through)} points: give more, or write a line or an arc")
        if not (np.isfinite(points).all() and steps.min() > 0.0):
            place = int(np.argmin(steps > 0.0))
            raise GeometryError(f"spline: the point {format_point(points[place])} comes twice in a row: remove one")
        lengths = np.append(0.0, np.cumsum(steps)) / steps.sum()
        spline = CubicSpline(lengths, points, bc_type="periodic" if is_closed else "not-a-knot")
        return ParametricCurve(spline, spline.derivative(), is_analytic=False)


@dataclass(frozen=True)
class NurbsTo:
    """A Bezier curve, or a rational B-spline (NURBS), as drawing programs write them.

    Parameters
    ----------
    to : (float, float) [m]
        The last control point.
    points : tuple of (float, float) [m]
        The control points between the start and the end: two of a cubic Bezier curve.
    degree : int, optional
        By default that of a Bezier curve, the number of control points minus one.
    knots : tuple of float, optional
        As many as control points, degree and one; by default at equal distances.
    weights : tuple of float, optional
        Of all control points, both ends counted; by default all 1.
    name, group : str
        See `DrawnSide`.
    """

    to: Point
    points: tuple[Point, ...]
    degree: int | None = None
    knots: tuple[float, ...] | None = None
    weights: tuple[float, ...] | None = None
    name: str = ""
    group: str = ""

    def curve(self, start: Point) -> Curve:
        """Return the curve by its arc length."""
        points = np.array([start, *self.points, self.to], dtype=float)
        n = len(points)
        degree = n - 1 if self.degree is None else self.degree
        weights = np.ones(n) if self.weights is None else np.array(self.weights)
        knots = clamped_knots(n, min(max(degree, 1), n - 1)) if self.knots is None else np.array(self.knots)
        return Nurbs(points, degree, knots, weights).curve()


@dataclass(frozen=True)
class Loop:
    """A closed loop of sides.

    Parameters
    ----------
    start : (float, float) [m]
        Where the first side starts and the last one ends.
    sides : tuple of DrawnSide
        In order, in either sense.
    """

    start: Point
    sides: tuple[DrawnSide, ...]

    @property
    def starts(self) -> tuple[Point, ...]:
        """Start point of each side."""
        return (self.start, *(side.to for side in self.sides[:-1]))


@dataclass(frozen=True)
class OutlineShape(CheckedShape):
    """A body within a loop of lines, arcs and smooth curves, with or without holes.

    Parameters
    ----------
    loops : tuple of Loop
        The largest bounds the body, the others are holes in it. Each may run in either sense.
    notes : tuple of str
        What the reader of a file had to do or to assume to make it of the file.
    unit : str
        Unit of length that the file states; empty if it states none.

    Raises
    ------
    GeometryError
        If there is no loop, a loop has no side, a side has no curve, or the loops do not bound a body; see `Outline`.
    """

    loops: tuple[Loop, ...]
    notes: tuple[str, ...] = ()
    unit: str = ""

    def __post_init__(self) -> None:
        if not self.loops or not all(loop.sides for loop in self.loops):
            raise GeometryError("outline: a loop without sides bounds no body: give every loop at least one side")

    @cached_property
    def _outline(self) -> Outline:
        """Return the loops, turned so that the body lies on their left."""
        loops, number = [], 0
        for loop in self.loops:
            sides = []
            for start, side in zip(loop.starts, loop.sides, strict=True):
                number += 1
                name = side.name or f"side-{number}"
                try:
                    sides.append(Side(name, side.curve(start), side.group))
                except GeometryError as error:
                    raise GeometryError(f"outline: side {name!r}: {error}") from error
            loops.append(tuple(sides))
        _, senses = senses_of([np.concatenate([side.curve.point(_SEEN) for side in loop]) for loop in loops])
        loops = [loop if is_right else reversed_loop(loop) for loop, is_right in zip(loops, senses, strict=True)]
        return Outline(tuple(loops), drawing=Drawing(self.notes, self.unit))


def _arc(centre: FloatArray, start: FloatArray, sweep: float) -> Arc:
    x, y = start - centre
    angle = math.atan2(y, x)
    return Arc((float(centre[0]), float(centre[1])), math.hypot(x, y), angle, angle + sweep)
