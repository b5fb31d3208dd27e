"""Outlines: named sides joined to closed loops around a body, and the pieces of them in a boundary part."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.curves import CURVE_MEMBERS, Curve
from bemkit.geometry.loops import check_loops
from bemkit.geometry.pieces import RESOLUTION, make_pieces, resolution
from bemkit.geometry.vectors import check_magnitude, norms

_JOINT_TOLERANCE = 64 * RESOLUTION  # times the coordinates: trigonometry and splines lose a few more digits
_N_SEEN = 4  # points of a side that define its size, also of a closed one
_LEAST_SPLITS = 4  # 16 pieces, 9 tangents each: a side with fewer than about 30 waves is seen as it is
N_SAMPLES = 257
"""Number of points at which a predicate is sampled along a side; 2**k + 1, so that halves and quarters are among
them."""
_N_FINER, _N_PASSES = 4097, 5  # 1 / (256 * 4096**4) is less than the spacing of numbers near 1
_END_TOLERANCE = 1e-12  # a part does not begin this close to the end of its side: that is round-off of the predicate
_STRAIGHT = 1e-9
"""Distance of a node from the line between the ends of the strip that is round-off, relative to its length."""

Predicate = Callable[[FloatArray, FloatArray], BoolArray]


@dataclass(frozen=True, eq=False)
class Side:
    """A named smooth piece of an outline.

    Parameters
    ----------
    name : str
        Its name, by which selections find it.
    curve : Curve
        Where it runs, with the body on its left.
    group : str
        Another name, which several sides may have in common; empty for none.
    """

    name: str
    curve: Curve
    group: str = ""

    def __post_init__(self) -> None:
        if not (isinstance(self.name, str) and self.name):
            raise GeometryError(f"Side: name is {self.name!r}: give a non-empty string")
        missing = [name for name in CURVE_MEMBERS if not hasattr(type(self.curve), name)]
        if missing:
            raise GeometryError(
                f"Side: the curve of {self.name!r}, a {type(self.curve).__name__}, has no {', '.join(missing)}: "
                "derive its class from bemkit.geometry.curves.Curve"
            )


@dataclass(frozen=True)
class Drawing:
    """Further properties of an outline from a file.

    Parameters
    ----------
    notes : tuple of str
        Notes and assumptions of the reader of the file.
    unit : str
        Unit of length that the file states; empty if it states none.
    """

    notes: tuple[str, ...]
    unit: str


@dataclass(frozen=True)
class Surface:
    """Marks an outline or a mesh as a strip of the surface of a half-plane, free of traction elsewhere.

    Parameters
    ----------
    is_periodic : bool
        Whether the strip is one period of a periodic surface.
    """

    is_periodic: bool = False

    def check(self, nodes: FloatArray, elements: IntArray, is_exterior: bool) -> None:
        """Raise GeometryError unless the elements are one straight strip, in order, of an unsymmetric exterior."""
        if not is_exterior:
            raise GeometryError("BoundaryMesh: surface is given: a half-plane is an exterior without symmetry lines")
        n = len(elements)
        if not np.array_equal(elements, np.column_stack([np.arange(n), np.arange(1, n + 1)])):
            raise GeometryError(
                "BoundaryMesh: the elements of a half-plane are not in order: let element i join the nodes i and i + 1"
            )
        chord = nodes[-1] - nodes[0]
        length = float(np.hypot(*chord))
        steps = np.diff(nodes, axis=0)
        across = (nodes - nodes[0]) @ np.array([-chord[1], chord[0]]) / length
        worst = int(np.argmax(np.abs(across)))
        if abs(across[worst]) > _STRAIGHT * length or np.any(steps @ chord <= 0.0) or not norms(steps).all():
            raise GeometryError(
                f"BoundaryMesh: the surface of a half-plane is straight, but its node at {format_point(nodes[worst])} "
                f"lies {abs(across[worst]):.3g} beside the line between its ends, or the nodes turn back: give nodes "
                "on a line, in order"
            )


@dataclass(frozen=True, eq=False)
class Outline:
    """The closed loops of sides that bound a body.

    Parameters
    ----------
    loops : tuple of tuple of Side
        Each loop lists its sides in order; the body is always on the left. So the outer loop runs anticlockwise and
        holes run clockwise.
    is_exterior : bool
        Whether the body is the plane outside of the loops, which then all run clockwise.
    surface : Surface, optional
        Given if the body is a half-plane: the only loop is then one straight side with the body on its left, and stays
        open.
    drawing : Drawing, optional
        Given if the sides were drawn one by one.

    Raises
    ------
    GeometryError
        If a loop is not closed or runs the wrong way, sides cross, touch or fold back, a side has a kink or no length,
        a hole is not in the body, or two sides have the same name.
    """

    loops: tuple[tuple[Side, ...], ...]
    is_exterior: bool = False
    surface: Surface | None = None
    drawing: Drawing | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "loops", tuple(tuple(loop) for loop in self.loops))
        if not self.loops or not all(self.loops):
            raise GeometryError(f"Outline: loops is {self.loops}: give at least one loop, each of at least one side")
        names = self.side_names
        for name in names:
            if names.count(name) > 1:
                raise GeometryError(f"Outline: {names.count(name)} sides are named {name!r}: give each its own name")
        if self.surface is not None:
            if len(names) != 1 or not self.sides[0].curve.is_straight:
                raise GeometryError(f"Outline: a half-plane has the sides {', '.join(names)}: give one straight side")
            return
        for side in self.sides:
            if side.group in names and side.group != side.name:
                raise GeometryError(
                    f"Outline: {side.group!r} names a side and a group of sides with {side.name!r}: rename one of them"
                )
        start, end = self._ends()
        loop_of_side = np.repeat(np.arange(len(self.loops)), [len(loop) for loop in self.loops])
        curves = tuple(side.curve for side in self.sides)
        index = np.array([-1 if curve.is_straight else k for k, curve in enumerate(curves)])
        pieces = make_pieces(curves, start, end, index, np.tile([0.0, 1.0], (len(curves), 1)))
        check_loops(pieces, loop_of_side, self.is_exterior, self._describe, self._describe_loop, _LEAST_SPLITS)

    @property
    def sides(self) -> tuple[Side, ...]:
        """All sides, loop after loop."""
        return tuple(side for loop in self.loops for side in loop)

    @property
    def side_names(self) -> tuple[str, ...]:
        """The names of all sides, loop after loop."""
        return tuple(side.name for side in self.sides)

    @property
    def selectable_names(self) -> tuple[str, ...]:
        """The names of groups and of sides, each once: what a selection may name."""
        groups = (side.group for side in self.sides if side.group)
        return tuple(dict.fromkeys([*groups, *self.side_names]))

    @cached_property
    def corners(self) -> tuple[FloatArray, ...]:
        """For each loop the (n_sides, 2) start points [m] of its sides."""
        ends = np.array([0.0, 1.0])
        return tuple(np.array([side.curve.point(ends)[0] for side in loop]) for loop in self.loops)

    def _ends(self) -> tuple[FloatArray, FloatArray]:
        """Return the starts and ends of all sides, joined up; raise if they do not join."""
        start = np.concatenate(self.corners)
        end = np.concatenate([np.roll(corners, -1, axis=0) for corners in self.corners])
        own_end = np.array([side.curve.point(np.array([1.0]))[0] for side in self.sides])
        if not np.isfinite([start, own_end]).all():
            bad = int(np.argmin(np.isfinite(start).all(axis=1) & np.isfinite(own_end).all(axis=1)))
            raise GeometryError(f"Outline: {self._describe(bad)} has an end that is not finite: correct its curve")
        seen = np.linspace(0.0, 1.0, _N_SEEN)
        check_magnitude(np.concatenate([side.curve.point(seen) for side in self.sides]), "Outline")
        tolerance = _JOINT_TOLERANCE * np.abs(start).max()
        followers = [name for loop in self.loops for name in [*[side.name for side in loop[1:]], loop[0].name]]
        for k in np.flatnonzero(norms(own_end - end) > tolerance).tolist():
            raise GeometryError(
                f"Outline: {self._describe(k)} ends at {format_point(own_end[k])}, but side {followers[k]!r} "
                f"starts at {format_point(end[k])}, {norms(own_end - end)[k]:.3g} away: make every side start "
                "where the one before it ends"
            )
        is_straight = np.array([side.curve.is_straight for side in self.sides])
        for k in np.flatnonzero(is_straight & (norms(end - start) <= resolution(start, end))).tolist():
            raise GeometryError(
                f"Outline: {self._describe(k)} at {format_point(start[k])} has no length, or less than the digits of "
                "its coordinates resolve: remove it, or move the body towards the origin"
            )
        return start, end

    def _describe(self, k: int) -> str:
        return f"side {self.side_names[k]!r}"

    def _describe_loop(self, k: int) -> str:
        names = [side.name for side in self.loops[k]]
        shown = names if len(names) <= 4 else [*names[:2], "...", names[-1]]
        return f"loop of sides {', '.join(shown)}"


@dataclass(frozen=True)
class Selection:
    """A selection of the boundary: sides, or the pieces of sides where a predicate holds.

    Parameters
    ----------
    sides : tuple of str
        Names of sides, or of groups of sides; empty for all sides.
    where : callable, optional
        Vectorised predicate: coordinates x and y, each (n,) [m] -> (n,) bool. A piece shorter than 1/256 of its side
        may be overlooked.
    """

    sides: tuple[str, ...] = ()
    where: Predicate | None = None

    def __post_init__(self) -> None:
        if isinstance(self.sides, str):
            raise GeometryError(f"Selection: sides is the string {self.sides!r}: give a tuple, ({self.sides!r},)")
        object.__setattr__(self, "sides", tuple(self.sides))

    def names(self, side_name: str, group: str = "") -> bool:
        """Return whether a side is named, itself or by its group."""
        return not self.sides or side_name in self.sides or group in self.sides

    def holds(self, side_name: str, points: FloatArray, group: str = "") -> BoolArray:
        """Return which points (n, 2) of the named side are selected, (n,)."""
        if not self.names(side_name, group):
            return np.zeros(len(points), dtype=bool)
        return np.ones(len(points), dtype=bool) if self.where is None else evaluate_predicate(self.where, points)


def evaluate_predicate(where: Predicate, points: FloatArray) -> BoolArray:
    """Evaluate a predicate at points (n, 2); a constant answer counts for all.

    Raises
    ------
    GeometryError
        If the answer is not boolean or has another shape.
    """
    answer = np.asarray(where(points[:, 0], points[:, 1]))
    if answer.dtype != np.bool_ or answer.shape not in ((), (len(points),)):
        raise GeometryError(
            f"Selection: where returned an array of {answer.dtype} of shape {answer.shape} for {len(points)} points: "
            f"return booleans of shape ({len(points)},), as in `x < 0.5`"
        )
    return np.full(len(points), answer)


def breakpoints(curve: Curve, where: Predicate) -> FloatArray:
    """Find where along a curve a predicate changes.

    Parameters
    ----------
    curve : Curve
        The curve.
    where : callable
        The predicate, as in `Selection`.

    Returns
    -------
    (n,) array
        Parameters in (0, 1), increasing, to round-off: sampled at 257 points, then between those where it changes.
    """
    low, high = np.zeros(1), np.ones(1)
    for k in range(_N_PASSES):
        samples = np.linspace(low, high, N_SAMPLES if k == 0 else _N_FINER)
        holds = evaluate_predicate(where, curve.point(samples.ravel())).reshape(samples.shape)
        before, interval = np.nonzero(holds[1:] != holds[:-1])
        if k > 0:  # one of each: far from the origin a predicate flickers, and each flicker would bring forth others
            interval, first = np.unique(interval, return_index=True)
            before = before[first]
        low, high = samples[before, interval], samples[before + 1, interval]
        if not low.size:
            break
    return merge_breakpoints(high)


def merge_breakpoints(s: FloatArray) -> FloatArray:
    """Sort parameters, drop those at the ends, and let those that differ by round-off be one."""
    if not s.size:
        return s
    # to 15 decimals, so that x <= 1/2 and x < 1/2 both break at 1/2
    s = np.sort(np.round(s, 15))
    s = s[(s > _END_TOLERANCE) & (s < 1.0 - _END_TOLERANCE)]
    return s[np.diff(s, prepend=-1.0) > _END_TOLERANCE]
