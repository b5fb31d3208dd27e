"""Chords: a closed chain of short straight pieces, as meshes have them, back to the lines and curves they came from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.geometry.files.strokes import Stroke, StrokeSide, pair
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, SplineTo
from bemkit.geometry.vectors import angles_between, circle_centre, cross, norms

CORNER_ANGLE = 25.0
"""Degrees by which chords of a smooth curve turn at most; 15 chords make a circle."""
_ISOLATED = 3.0
"""A turn so many times those beside it is a corner: on a smooth curve turns change little by little."""
_STRAIGHT = 1e-6
"""Turn [rad] that round-off of coordinates explains."""
_ON_LINE, _ON_CIRCLE = 1e-6, 1e-7
"""Distance of points from the line or circle that they are on, relative to the piece."""
_LEAST_ARC_CHORDS = 4
"""Chords of an arc: fewer points are on a circle by chance."""


@dataclass(frozen=True)
class ChordLoop:
    """A closed chain of chords.

    Parameters
    ----------
    points : (n, 2) array [m]
        Chord k runs from point k to the next, the last one back to the first.
    names : tuple of n str
        The group of each chord, empty for none.
    is_end : (n,) bool array
        Points at which a curve of the file ends.
    is_inner : (n,) bool array
        Points inside an element of higher order, where there is no corner.
    is_within : (n,) bool array
        Points inside a curve of the file, where chords may turn by twice as much.
    """

    points: FloatArray
    names: tuple[str, ...]
    is_end: BoolArray
    is_inner: BoolArray
    is_within: BoolArray


def strokes_of(loop: ChordLoop, corner_angle: float) -> list[Stroke]:
    """Return the lines, arcs and smooth curves that chords are chords of.

    Chords in one line are one stroke; those whose points are on a circle, an arc; those between that turn little by
    little, a cubic spline through their points. No stroke reaches beyond a corner, an end of a curve of the file, or
    a change of name.

    Parameters
    ----------
    loop : ChordLoop
    corner_angle : float [degree]
        Chords that turn by more meet in a corner.
    """
    n = len(loop.points)
    turns = np.abs(_turns(loop.points))
    is_break = loop.is_end | _corners(turns, loop.is_inner, np.radians(corner_angle) * (1.0 + loop.is_within))
    is_break |= np.array([loop.names[k - 1] != name for k, name in enumerate(loop.names)])
    breaks = np.flatnonzero(is_break)
    if breaks.size == 0 and (closed := _closed(loop)) is not None:
        return [closed]
    if breaks.size == 0:
        steps = norms(np.roll(loop.points, -1, axis=0) - loop.points)
        breaks = np.array([int(np.argmax(np.abs(turns / steps - np.roll(turns / steps, 1))))])
    strokes: list[Stroke] = []
    for k, first in enumerate(breaks.tolist()):
        last = int(breaks[k + 1]) if k + 1 < breaks.size else int(breaks[0]) + n
        points = loop.points[np.arange(first, last + 1) % n]
        strokes += fitted_strokes(points, loop.names[first])
    return strokes


def _turns(points: FloatArray) -> FloatArray:
    """Return the angle (n,) [rad] by which the chain turns at each point, anticlockwise positive."""
    chords = np.roll(points, -1, axis=0) - points
    return angles_between(np.roll(chords, 1, axis=0), chords)


def _corners(turns: FloatArray, is_inner: BoolArray, corner_angles: FloatArray) -> BoolArray:
    beside = np.maximum(np.roll(turns, 1), np.roll(turns, -1))
    is_corner: BoolArray = (turns > corner_angles) | ((turns > _ISOLATED * beside) & (turns > _STRAIGHT * 1e3))
    return is_corner & ~is_inner


def _closed(loop: ChordLoop) -> Stroke | None:
    """Return the one closed curve that a chain without corners is, or None if a part of it is straight or an arc."""
    points = loop.points
    group, start = loop.names[0], pair(points[0])
    n = len(points)
    if (centre := _circle(points, (0, n // 3, 2 * n // 3))) is not None:
        opposite = centre * 2.0 - points[0]
        return Stroke(start, ArcTo(start, pair(opposite), group=group))
    pieces = fitted_strokes(np.concatenate([points, points[:1]]), group)
    if len(pieces) == 1 and isinstance(pieces[0].side, SplineTo):
        return Stroke(start, SplineTo(start, tuple(map(pair, points[1:])), group=group))
    return None


def fitted_strokes(points: FloatArray, group: str) -> list[Stroke]:
    """Return the strokes through points (n + 1, 2) [m] in order."""
    strokes: list[Stroke] = []
    rest, first, n = 0, 0, len(points) - 1

    def end_rest(last: int) -> None:
        if last > rest:
            start, *inner, end = map(pair, points[rest : last + 1])
            side: StrokeSide = SplineTo(end, tuple(inner), group=group) if inner else LineTo(end, group=group)
            strokes.append(Stroke(start, side))

    while first < n:
        line = _longest(points, first, _is_straight)
        arc = _longest(points, first, _is_arc)
        if line - first >= 2 and line >= arc:
            side: StrokeSide = LineTo(pair(points[line]), group=group)
            last = line
        elif arc - first >= _LEAST_ARC_CHORDS:
            side = ArcTo(pair(points[arc]), pair(points[(first + arc) // 2]), group=group)
            last = arc
        else:
            first += 1
            continue
        end_rest(first)
        strokes.append(Stroke(pair(points[first]), side))
        rest = first = last
    end_rest(n)
    return strokes


def _longest(points: FloatArray, first: int, fits: Callable[[FloatArray], bool]) -> int:
    """Return the last point that a line or circle from the first one reaches, found by doubling and halving."""
    n = len(points) - 1
    good, step = min(first + 1, n), 2
    while good < n and fits(points[first : min(first + step, n) + 1]):
        good = min(first + step, n)
        step *= 2
    bad = min(first + step, n + 1)
    while bad - good > 1:
        middle = (good + bad) // 2
        good, bad = (middle, bad) if fits(points[first : middle + 1]) else (good, middle)
    return good


def _is_straight(points: FloatArray) -> bool:
    chord, arms = points[-1] - points[0], points - points[0]
    length = float(norms(chord))
    along = arms @ chord
    is_forward = bool((np.diff(along) > 0.0).all())
    return is_forward and float(np.abs(cross(chord, arms)).max()) <= _ON_LINE * length * length


def _is_arc(points: FloatArray) -> bool:
    n = len(points)
    if n < 4:
        return True  # there is a circle through every three points
    turns = angles_between(np.diff(points[:-1], axis=0), np.diff(points[1:], axis=0))
    is_turning = bool((turns > _STRAIGHT).all() or (turns < -_STRAIGHT).all()) and float(np.abs(turns).sum()) < 6.2
    return is_turning and _circle(points, (0, n // 2, n - 1)) is not None


def _circle(points: FloatArray, three: Sequence[int]) -> FloatArray | None:
    """Return the centre of the circle through three of the points if all are on it, else None."""
    centre = circle_centre(*points[list(three)])
    if centre is None or np.ptp(norms(points - centre)) > _ON_CIRCLE * np.ptp(points, axis=0).max():
        return None
    return centre


def note_on_curves(strokes: Sequence[Stroke]) -> str:
    """Say what chords are taken as chords of; an empty text where all are straight."""
    curved = [stroke for stroke in strokes if not isinstance(stroke.side, LineTo)]
    if not curved:
        return ""
    n_arcs = sum(isinstance(stroke.side, ArcTo) for stroke in curved)
    counts = [(n_arcs, "arc"), (len(curved) - n_arcs, "spline")]
    words = " and ".join(f"{count} {word}{'s' if count > 1 else ''}" for count, word in counts if count)
    return f"{words} through the ends of straight pieces of the mesh"
