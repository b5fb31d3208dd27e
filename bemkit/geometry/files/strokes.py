"""Strokes: the lines and curves of a file, free-form ones exactly, in any order and sense, joined to closed loops."""

from __future__ import annotations

import importlib.util
import math
import shlex
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError, counted, format_point
from bemkit.formulas import closest
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, Loop, NurbsTo, Point, SplineTo
from bemkit.geometry.free_form.nurbs import conic_arc
from bemkit.geometry.loops import closed_chains
from bemkit.geometry.vectors import cross, norms, senses_of

StrokeSide: TypeAlias = LineTo | ArcTo | SplineTo | NurbsTo

_SEEN = np.linspace(0.0, 1.0, 17)
_ROUND_OFF = 1e-12
"""Gaps that are closed without a note, relative to the coordinates."""
_STRAIGHT = 1e-9
"""Largest distance of the control points of a line from its chord, relative to the chord."""


@dataclass(frozen=True)
class Stroke:
    """A line or curve of a file.

    Parameters
    ----------
    start : (float, float) [m]
    side : LineTo, ArcTo, SplineTo or NurbsTo
        Its group is its name in the file: a physical group, a layer, an id; empty without a name.
    """

    start: Point
    side: StrokeSide

    @property
    def end(self) -> Point:
        """End point [m]."""
        return self.side.to

    @property
    def is_closed(self) -> bool:
        """Whether it ends where it starts."""
        return self.start == self.end

    def reversed(self) -> Stroke:
        """Return the stroke drawn the other way."""
        side = self.side
        match side:
            case SplineTo():
                side = replace(side, through=side.through[::-1])
            case NurbsTo():
                knots, weights = side.knots, side.weights
                turned = None if knots is None else tuple(knots[0] + knots[-1] - knot for knot in knots[::-1])
                side = replace(
                    side, points=side.points[::-1], knots=turned, weights=None if weights is None else weights[::-1]
                )
        return Stroke(side.to, replace(side, to=self.start))

    def mapped(self, move: Callable[[Point], Point]) -> Stroke:
        """Return the stroke with every point moved by a similarity."""
        side = self.side
        match side:
            case ArcTo():
                side = replace(side, through=move(side.through))
            case SplineTo():
                side = replace(side, through=tuple(move(each) for each in side.through))
            case NurbsTo():
                side = replace(side, points=tuple(move(each) for each in side.points))
        return Stroke(move(self.start), replace(side, to=move(side.to)))

    @cached_property
    def points(self) -> FloatArray:
        """(n, 2) array [m]: points along the stroke, which define its size and its sense."""
        return self.side.curve(self.start).point(_SEEN)


def require_package(name: str, extra: str) -> None:
    """Raise GeometryError with the remedy where a package is missing."""
    if importlib.util.find_spec(name) is None:
        raise GeometryError(f'{name} is not installed: pip install "bemkit[{extra}]"')


def check_only(only: Sequence[str], known: Sequence[str], what: str) -> None:
    """Raise GeometryError unless a file has all that the option `only` names."""
    for name in only:
        if name not in known:
            listed = ", ".join(known) or "none"
            raise GeometryError(f"only names {name!r}: {what} are {listed}{closest(name, known)}")


def extent(strokes: Sequence[Stroke]) -> float:
    """Return the larger of width and height [m] of what strokes end at and pass through."""
    points = np.concatenate([stroke.points for stroke in strokes])
    return float(np.ptp(points, axis=0).max())


def join_strokes(strokes: Sequence[Stroke], tolerance: float) -> tuple[list[list[Stroke]], list[str]]:
    """Join strokes to closed loops.

    Parameters
    ----------
    strokes : sequence of Stroke
    tolerance : float [m]
        Ends no farther apart than this become one point.

    Returns
    -------
    loops : list of list of Stroke
        Each stroke starts where the one before it ends, and the first where the last ends.
    notes : list of str
        What was done to the strokes.

    Raises
    ------
    GeometryError
        If a stroke ends where no other does, or more than two end in one place.
    """
    strokes, notes = _without_repeated(strokes, tolerance)
    closed = [[stroke] for stroke in strokes if stroke.is_closed]
    strokes = [stroke for stroke in strokes if not stroke.is_closed]
    if not strokes:
        return closed, notes
    ends = np.array([point for stroke in strokes for point in (stroke.start, stroke.end)])
    vertices, place_of_end = _merged(ends, tolerance)
    gaps = norms(ends - vertices[place_of_end])
    if gaps.max() > _ROUND_OFF * np.abs(ends).max():
        count = int(np.count_nonzero(np.bincount(place_of_end, weights=gaps) > _ROUND_OFF * np.abs(ends).max()))
        notes.append(f"closed: {counted(count, 'gap')} between ends of lines, of up to {2.0 * gaps.max():.2g}")
    _check_degrees(vertices, place_of_end.reshape(-1, 2), [stroke.side.group for stroke in strokes], tolerance)
    strokes = [
        Stroke(pair(start), replace(stroke.side, to=pair(end)))
        for stroke, (start, end) in zip(strokes, vertices[place_of_end.reshape(-1, 2)], strict=True)
    ]
    chains = closed_chains(place_of_end.reshape(-1, 2))
    return [
        *closed,
        *([strokes[k] if ahead else strokes[k].reversed() for k, ahead in chain] for chain in chains),
    ], notes


def _without_repeated(strokes: Sequence[Stroke], tolerance: float) -> tuple[list[Stroke], list[str]]:
    """Remove strokes drawn twice, and those shorter than the tolerance."""
    long = [stroke for stroke in strokes if np.ptp(stroke.points, axis=0).max() > tolerance]
    notes = []
    if n_short := len(strokes) - len(long):
        notes.append(f"skipped, because shorter than {tolerance:.2g}: lines, {n_short}")
    if not long:
        return [], notes
    from scipy.spatial import cKDTree

    pairs = cKDTree(np.array([_features(stroke) for stroke in long])).query_pairs(2.0 * tolerance)
    repeated = {max(pair) for pair in pairs}
    if repeated:
        notes.append(f"drawn twice and taken once: lines, {len(repeated)}")
    return [stroke for k, stroke in enumerate(long) if k not in repeated], notes


def _features(stroke: Stroke) -> FloatArray:
    """Return lengths (8,) [m] that are the same for strokes on top of each other, whichever way they are drawn."""
    first, quarter, middle, third, last = stroke.points[::4]
    x, y = last - first
    chord = float(np.hypot(x, y))
    turn = ((x * x - y * y) / chord, 2.0 * x * y / chord) if chord > 0.0 else (0.0, 0.0)
    return np.array([*(0.5 * (first + last)), *middle, *(0.5 * (quarter + third)), *turn])


def _merged(points: FloatArray, tolerance: float) -> tuple[FloatArray, IntArray]:
    """Return the means (m, 2) of points closer than a tolerance, and the index (n,) of the mean of each point."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(points).query_pairs(tolerance, output_type="ndarray")
    graph = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    n_vertices, vertex = connected_components(graph, directed=False)
    low = np.full((n_vertices, 2), np.inf)
    np.minimum.at(low, vertex, points)
    offsets = [np.bincount(vertex, weights=column) for column in (points - low[vertex]).T]
    counts = np.bincount(vertex)
    return low + np.stack(offsets, axis=1) / counts[:, None], vertex.astype(np.intp)  # exact where points are the same


def _check_degrees(vertices: FloatArray, ends: IntArray, groups: Sequence[str], tolerance: float) -> None:
    """Raise unless two lines meet at each end point; the message names groups that are closed without the others.

    Parameters
    ----------
    vertices : (m, 2) array [m]
    ends : (n, 2) int array
        Indices of the points where each stroke starts and ends.
    groups : sequence of str
        Name of each stroke in the file.
    tolerance : float [m]
    """
    degree = np.bincount(ends.ravel())
    if (degree == 2).all():
        return
    remedy = _groups_that_close(ends, groups)
    if (degree > 2).any():
        crossing = int(np.argmax(degree > 2))
        named = _in_groups(groups[int(k)] for k in np.flatnonzero((ends == crossing).any(axis=1)))
        raise GeometryError(
            f"{degree[crossing]} lines{named} meet at {format_point(vertices[crossing])}, where a boundary has two: "
            + (remedy or "remove lines inside the body and beside it, or name the right ones with only")
        )
    loose = np.flatnonzero(degree == 1)
    first, others = vertices[loose[0]], vertices[loose[1:]]
    named = _in_groups(groups[int(k)] for k in np.flatnonzero((ends == loose[0]).any(axis=1)))
    distances = norms(others - first)
    nearest = int(np.argmin(distances))
    raise GeometryError(
        f"the outline is open: a line{named} ends at {format_point(first)}, and the nearest loose end is "
        f"{distances[nearest]:.3g} away at {format_point(others[nearest])} ({loose.size} ends are loose): "
        + (remedy or f"close the gaps, or give a tolerance above {tolerance:.2g}")
    )


def _in_groups(groups: Iterable[str]) -> str:
    names = sorted({*groups} - {""})
    return f" of {', '.join(map(repr, names))}" if names else ""


def _groups_that_close(ends: IntArray, groups: Sequence[str]) -> str:
    """Return the remedy: groups whose strokes form closed loops without the others; empty if there are none.

    It tries all groups but one, then the groups that are closed by themselves.
    """
    of_group = np.array(groups)
    names = sorted({*groups})

    def is_closed(kept: list[str]) -> bool:
        return bool(kept) and set(np.bincount(ends[np.isin(of_group, kept)].ravel()).tolist()) <= {0, 2}

    candidates = [[name for name in names if name != dropped] for dropped in names if dropped]
    candidates.append([name for name in names if is_closed([name])])
    kept = next(filter(is_closed, candidates), [])
    if not kept:
        return ""
    dropped = _in_groups(set(names) - set(kept))
    listed = ", ".join(map(repr, kept))
    option = shlex.quote(",".join(kept))
    remedy = "name the others with only" if "" in kept else f"write only = [{listed}], or --only {option}"
    return f"without the lines{dropped} the outline is closed: {remedy}"


def named_loops(loops: Sequence[list[Stroke]]) -> tuple[Loop, ...]:
    """Put loops in order, the outer one first and anticlockwise, and name their sides.

    Sides of a name of the file keep it; several of one name are numbered and have it as their group. Sides without
    a name are ``side-1``, ``side-2``, ... along the loops, each of which begins at its lower left corner.
    """
    outer, senses = senses_of([np.concatenate([stroke.points for stroke in loop]) for loop in loops])
    turned = [
        loop if is_right else [stroke.reversed() for stroke in loop[::-1]]
        for loop, is_right in zip(loops, senses, strict=True)
    ]
    begun = [_from_lower_left(loop) for loop in turned]
    holes = sorted((loop for k, loop in enumerate(begun) if k != outer), key=lambda loop: loop[0].start)
    ordered = [begun[outer], *holes]
    groups = [stroke.side.group for loop in ordered for stroke in loop]
    names = iter(_names(groups))

    def named(side: StrokeSide) -> StrokeSide:
        name = next(names)
        return replace(side, name=name, group="" if name == side.group else side.group)

    return tuple(Loop(loop[0].start, tuple(named(stroke.side) for stroke in loop)) for loop in ordered)


def _names(groups: Sequence[str]) -> list[str]:
    """Return a name for each side, by the names that the file has for them."""
    has_choice = len({*groups} - {""}) > 1
    names: list[str] = []
    taken = {*groups} - {""}
    for number, group in enumerate(groups, start=1):
        if group and groups.count(group) == 1:
            names.append(group)
            continue
        stem = group if group and has_choice else "side"
        name = f"{stem}-{number if stem == 'side' else groups[:number].count(group)}"
        while name in taken:  # a layer called side-1
            name += "'"
        taken.add(name)
        names.append(name)
    return names


def _from_lower_left(loop: list[Stroke]) -> list[Stroke]:
    starts = np.array([stroke.start for stroke in loop])
    size = float(np.ptp(starts, axis=0).max()) or 1.0
    low = np.round((starts.sum(axis=1) - starts.sum(axis=1).min()) / size, 9)
    first = int(np.lexsort((starts[:, 1], low))[0])
    return [*loop[first:], *loop[:first]]


def ellipse_strokes(
    centre: FloatArray, first: FloatArray, second: FloatArray, start: float, end: float, group: str
) -> list[Stroke]:
    """Return the arc centre + cos(t) first + sin(t) second, t = start ... end [rad], a quarter at a time."""
    n = max(1, math.ceil(abs(end - start) / (0.5 * math.pi) - 1e-9))
    ends = np.linspace(start, end, n + 1)
    strokes = []
    for k in range(n):
        arc = conic_arc(centre, first, second, float(ends[k]), float(ends[k + 1]))
        begin, middle, finish = map(pair, arc.points)
        weights = tuple(float(weight) for weight in arc.weights)
        strokes.append(Stroke(begin, NurbsTo(finish, (middle,), weights=weights, group=group)))
    return strokes


def bezier_stroke(points: FloatArray, group: str) -> Stroke:
    """Return a Bezier curve of control points (n, 2) [m], as a line if it is one."""
    start, *inner, end = map(pair, points)
    chord, arms = points[-1] - points[0], points[1:] - points[0]
    along, length = np.append(0.0, arms @ chord), float(norms(chord))
    is_line = (np.diff(along) >= 0.0).all() and np.abs(cross(chord, arms)).max() <= _STRAIGHT * length * length
    return Stroke(start, LineTo(end, group=group) if is_line else NurbsTo(end, tuple(inner), group=group))


def nurbs_strokes(points: FloatArray, degree: int, knots: FloatArray, weights: FloatArray, group: str) -> list[Stroke]:
    """Return a rational B-spline as smooth strokes: cut where its knots let it have a kink.

    Knots need not be repeated at the ends, as those of closed curves are not.
    """
    from scipy.interpolate import BSpline

    if len(knots) != len(points) + degree + 1 or (np.diff(knots) < 0.0).any() or not (weights > 0.0).all():
        raise GeometryError(
            f"a spline has {len(knots)} knots for {len(points)} control points and degree {degree}: redraw it"
        )
    spline = BSpline(knots, np.column_stack([points * weights[:, None], weights]), degree)
    low, high = knots[degree], knots[-degree - 1]
    inner = knots[(knots > low) & (knots < high)]
    kinks = sorted({float(knot) for knot in inner if np.count_nonzero(inner == knot) >= degree})
    for knot in (low, *kinks, high):
        if (n_missing := degree - int(np.count_nonzero(spline.t == knot))) > 0:
            spline = spline.insert_knot(knot, n_missing)
    knots, values = spline.t, spline.c
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
        start, *middle, to = map(pair, own_points)
        kept = None if is_plain else tuple(map(float, own_weights))
        strokes.append(Stroke(start, NurbsTo(to, tuple(middle), degree, own_knots, kept, group=group)))
    return strokes


def pair(point: FloatArray) -> Point:
    """Return the coordinates of a point (2,)."""
    return float(point[0]), float(point[1])
