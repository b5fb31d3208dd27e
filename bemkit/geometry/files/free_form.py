"""Ellipses, Bezier curves and rational B-splines of drawings as strokes, exactly."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.drawn import LineTo, NurbsTo, Point
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.files.strokes import Stroke
from bemkit.geometry.nurbs import conic_arc
from bemkit.geometry.vectors import cross, norms

_STRAIGHT = 1e-9
"""Distance of control points from the chord of what is a line, relative to the chord."""


def ellipse_strokes(
    centre: FloatArray, first: FloatArray, second: FloatArray, start: float, end: float, group: str
) -> list[Stroke]:
    """Return the arc centre + cos(t) first + sin(t) second, t = start ... end [rad], a quarter at a time."""
    n = max(1, math.ceil(abs(end - start) / (0.5 * math.pi) - 1e-9))
    ends = np.linspace(start, end, n + 1)
    strokes = []
    for k in range(n):
        arc = conic_arc(centre, first, second, float(ends[k]), float(ends[k + 1]))
        begin, middle, finish = map(_pair, arc.points)
        weights = tuple(float(weight) for weight in arc.weights)
        strokes.append(Stroke(begin, NurbsTo(finish, (middle,), weights=weights, group=group)))
    return strokes


def bezier_stroke(points: FloatArray, group: str) -> Stroke:
    """Return a Bezier curve of control points (n, 2) [m], as a line if it is one."""
    start, *inner, end = map(_pair, points)
    chord, arms = points[-1] - points[0], points[1:] - points[0]
    along, length = np.append(0.0, arms @ chord), float(norms(chord))
    is_line = (np.diff(along) >= 0.0).all() and np.abs(cross(chord, arms)).max() <= _STRAIGHT * length * length
    return Stroke(start, LineTo(end, group=group) if is_line else NurbsTo(end, tuple(inner), group=group))


def nurbs_strokes(points: FloatArray, degree: int, knots: FloatArray, weights: FloatArray, group: str) -> list[Stroke]:
    """Return a rational B-spline as smooth strokes: cut where its knots let it have a kink.

    Knots need not be repeated at the ends, as those of closed curves are not.
    """
    if len(knots) != len(points) + degree + 1 or (np.diff(knots) < 0.0).any() or not (weights > 0.0).all():
        raise GeometryError(
            f"a spline has {len(knots)} knots for {len(points)} control points and degree {degree}: draw it anew"
        )
    values = np.column_stack([points * weights[:, None], weights])
    low, high = knots[degree], knots[-degree - 1]
    inner = knots[(knots > low) & (knots < high)]
    kinks = sorted({float(knot) for knot in inner if np.count_nonzero(inner == knot) >= degree})
    for knot in (low, *kinks, high):
        knots, values = _inserted(knots, values, degree, float(knot))
    strokes = []
    cuts = [float(low), *kinks, float(high)]
    for begin, end in pairwise(cuts):
        # the first control point that counts from a knot repeated as often as the degree lies on the curve
        first = int(np.searchsorted(knots, begin, side="right")) - degree - 1
        last = int(np.searchsorted(knots, end, side="left")) - 1
        own = values[first : last + 1]
        between = knots[(knots > begin) & (knots < end)]
        own_knots = (begin,) * (degree + 1) + tuple(map(float, between)) + (end,) * (degree + 1)
        own_points, own_weights = own[:, :2] / own[:, 2:], own[:, 2]
        is_plain = bool(np.ptp(own_weights) == 0.0)
        if len(own) == degree + 1 and is_plain:
            strokes.append(bezier_stroke(own_points, group))
            continue
        start, *middle, to = map(_pair, own_points)
        kept = None if is_plain else tuple(map(float, own_weights))
        strokes.append(Stroke(start, NurbsTo(to, tuple(middle), degree, own_knots, kept, group=group)))
    return strokes


def _inserted(knots: FloatArray, values: FloatArray, degree: int, knot: float) -> tuple[FloatArray, FloatArray]:
    """Repeat a knot until its multiplicity is the degree, by Boehm's algorithm; the curve stays the same."""
    while (multiplicity := int(np.count_nonzero(knots == knot))) < degree:
        last = int(np.searchsorted(knots, knot, side="right")) - 1
        changed = np.arange(last - degree + 1, last - multiplicity + 1)
        ratio = ((knot - knots[changed]) / (knots[changed + degree] - knots[changed]))[:, None]
        inner = ratio * values[changed] + (1.0 - ratio) * values[changed - 1]
        values = np.concatenate([values[: changed[0]], inner, values[last - multiplicity :]])
        knots = np.insert(knots, last + 1, knot)
    return knots, values


def _pair(point: FloatArray) -> Point:
    return float(point[0]), float(point[1])
