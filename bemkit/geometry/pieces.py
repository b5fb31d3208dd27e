"""Pieces of a boundary: chords with a bound on how far the boundary strays from them, and whether they keep apart.

The sides of an outline and the elements of a mesh are examined as the same thing: pieces in order along closed
loops, each a chord and the total angle by which its tangent turns. A piece that turns by `turning` strays from its
chord by at most tan(turning / 2) / 2 chord lengths, and leaves its ends within the angle `turning` of the chord.

No test for crossing, touching and folding back compares with an absolute length. Two pieces touch if they come closer
than the round-off of their own coordinates, so that neighbours a millionth of an element apart, and elements 1e-12 of
the size of the body, are seen as they are.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import Any, NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.curves import Curve
from bemkit.geometry.vectors import angles_between, cross, norms

LARGEST_TURNING = np.pi / 4
"""Pieces are split until they turn by less, so that none can meet itself."""
_N_TANGENTS = 9
_TURNING_SAFETY = 1.25  # the turning is sampled, not bounded
_MOST_SPLITS = 24  # the tip of a thin ellipse turns on as little of its length as the square of its slenderness
RESOLUTION = 8 * float(np.finfo(float).eps)
"""Points closer than this times the size of their coordinates are the same point: they differ by round-off only."""
_FEW_BOXES = 64
"""Number of boxes that are compared each with each."""
_TINY = float(np.finfo(float).tiny)
_MOST_HALVED = 1_000_000  # more pairs than this mean two curves that all but coincide


def resolution(start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distances (n,) that the coordinates of the ends (n, 2) cannot resolve [m]."""
    size: FloatArray = np.maximum(np.abs(start).max(axis=1), np.abs(end).max(axis=1))
    return RESOLUTION * size


@dataclass(frozen=True, eq=False)
class Pieces:
    """Pieces of boundary.

    Parameters
    ----------
    curves : tuple of Curve
        Curves that the curved pieces follow.
    start, end : (n, 2) array [m]
        Ends of the chords.
    curve : (n,) int array
        Index into `curves`, -1 for a straight piece.
    span : (n, 2) array
        Parameter interval on that curve, unused where straight.
    turning : (n,) array [rad]
        Angle by which the tangent turns in total, zero where straight.
    owner : (n,) int array
        Number of the side or element that the piece belongs to.
    """

    curves: tuple[Curve, ...]
    start: FloatArray
    end: FloatArray
    curve: IntArray
    span: FloatArray
    turning: FloatArray
    owner: IntArray

    def __len__(self) -> int:
        return len(self.start)

    @property
    def _columns(self) -> tuple[Any, ...]:
        return self.start, self.end, self.curve, self.span, self.turning, self.owner

    @property
    def chord_length(self) -> FloatArray:
        """(n,) array [m]: distance of the ends."""
        return norms(self.end - self.start)

    @property
    def deviation(self) -> FloatArray:
        """(n,) array [m]: bound on the distance of the boundary from the chord."""
        return 0.5 * self.chord_length * np.tan(0.5 * self.turning)

    @property
    def resolution(self) -> FloatArray:
        """(n,) array [m]: distance that the coordinates of the ends cannot resolve."""
        return resolution(self.start, self.end)

    def take(self, index: IntArray) -> "Pieces":
        """Return the pieces with these indices, in this order."""
        return Pieces(self.curves, *(column[index] for column in self._columns))

    def halves(self) -> tuple["Pieces", "Pieces"]:
        """Split curved pieces in the middle of their parameter interval."""
        middle = 0.5 * (self.span[:, 0] + self.span[:, 1])
        point = evaluate_curves(self.curves, self.curve, middle[:, None])[:, 0]
        first = _with_turning(self, self.start, point, np.column_stack([self.span[:, 0], middle]))
        second = _with_turning(self, point, self.end, np.column_stack([middle, self.span[:, 1]]))
        return first, second


class Elements(NamedTuple):
    """The arrays of a boundary mesh; see `BoundaryMesh`."""

    nodes: FloatArray
    elements: IntArray
    parts: Mapping[str, IntArray]
    curves: tuple[Curve, ...]
    element_curve: IntArray | None
    element_span: FloatArray | None


def bisected(old: Elements, is_halved: BoolArray, middles: FloatArray) -> Elements:
    """Bisect elements; both halves take the place of the element in its parts and in the order of elements.

    Parameters
    ----------
    old : Elements
    is_halved : (n_elements,) bool array
    middles : (n_elements, 2) array [m]
        Points that become nodes where elements are halved.

    Returns
    -------
    Elements
        The middle of an element is numbered next to its start node.
    """
    n_elements, n_nodes = len(old.elements), len(old.nodes)
    halved = np.flatnonzero(is_halved)
    first = np.arange(n_elements) + np.cumsum(is_halved) - is_halved  # new number of the (first half of the) element
    source = np.repeat(np.arange(n_elements), 1 + is_halved)
    starts_halved = np.zeros(n_nodes, dtype=bool)
    starts_halved[old.elements[halved, 0]] = True
    new_node = np.arange(n_nodes) + np.cumsum(starts_halved) - starts_halved
    middle = new_node[old.elements[halved, 0]] + 1
    nodes = np.empty((n_nodes + len(halved), 2))
    nodes[new_node] = old.nodes
    nodes[middle] = middles[halved]
    elements = new_node[old.elements][source]
    elements[first[halved], 1] = middle
    elements[first[halved] + 1, 0] = middle
    parts = {name: np.flatnonzero(np.isin(source, members)) for name, members in old.parts.items()}
    if old.element_curve is None or old.element_span is None:
        return Elements(nodes, elements, parts, old.curves, None, None)
    span = old.element_span[source]
    span[first[halved], 1] = span[first[halved] + 1, 0] = old.element_span[halved].mean(axis=1)
    return Elements(nodes, elements, parts, old.curves, old.element_curve[source], span)


def make_pieces(
    curves: tuple[Curve, ...], start: FloatArray, end: FloatArray, curve: IntArray, span: FloatArray
) -> Pieces:
    """Make one piece of every side or element; `owner` counts them."""
    n = len(start)
    pieces = Pieces(curves, start, end, curve, span, np.zeros(n), np.arange(n))
    return _with_turning(pieces, start, end, span)


def split_until_flat(pieces: Pieces, describe: Callable[[int], str], least_splits: int = 0) -> Pieces:
    """Split curved pieces, in order, until each turns by less than `LARGEST_TURNING`.

    Parameters
    ----------
    pieces : Pieces
        The pieces.
    describe : callable
        Number of an owner -> how a message calls it.
    least_splits : int
        Least number of splits, so that the sampled tangents resolve a long side.

    Raises
    ------
    GeometryError
        If a curve has a kink, naming the owner by `describe`.
    """
    for n_splits in range(_MOST_SPLITS):
        is_bent = (pieces.turning > LARGEST_TURNING) | ((pieces.curve >= 0) & (n_splits < least_splits))
        if not is_bent.any():
            return pieces
        bent = np.flatnonzero(is_bent)
        first, second = pieces.take(bent).halves()
        order = np.argsort(np.concatenate([np.flatnonzero(~is_bent), bent, bent]), kind="stable")
        pieces = concatenate([pieces.take(np.flatnonzero(~is_bent)), first, second]).take(order)
    kinked = int(np.argmax(pieces.turning))
    raise GeometryError(
        f"the curve of {describe(int(pieces.owner[kinked]))} has a kink near s={pieces.span[kinked].mean():.6g}: "
        "a curve must be smooth; split it into two sides there"
    )


def evaluate_curves(
    curves: tuple[Curve, ...], curve: IntArray, s: FloatArray, *, derivative: bool = False
) -> FloatArray:
    """Evaluate the curve with index `curve[i]`, or its derivative, at the parameters `s[i]`.

    Parameters
    ----------
    curves : tuple of Curve
        The curves.
    curve : (m,) int array
        Indices of curves; rows with -1 are left zero.
    s : (m, q) array
        Parameters.
    derivative : bool

    Returns
    -------
    (m, q, 2) array [m]
    """
    values = np.zeros((*s.shape, 2))
    for index in np.flatnonzero(np.bincount(curve[curve >= 0])):
        rows = np.flatnonzero(curve == index)
        evaluate = curves[index].derivative if derivative else curves[index].point
        values[rows] = evaluate(s[rows].ravel()).reshape(len(rows), s.shape[1], 2)
    return values


def concatenate(parts: list[Pieces]) -> Pieces:
    """Return all pieces in one."""
    return Pieces(parts[0].curves, *map(np.concatenate, zip(*(part._columns for part in parts), strict=True)))


def _with_turning(pieces: Pieces, start: FloatArray, end: FloatArray, span: FloatArray) -> Pieces:
    """Return the pieces with other ends; the turning is sampled anew."""
    turning = np.zeros(len(pieces))
    is_curved = pieces.curve >= 0
    if is_curved.any():
        rows = np.flatnonzero(is_curved)
        fractions = np.linspace(0.0, 1.0, _N_TANGENTS)
        s = span[rows, :1] * (1.0 - fractions) + span[rows, 1:] * fractions
        tangent = evaluate_curves(pieces.curves, pieces.curve[rows], s, derivative=True)
        turning[rows] = _TURNING_SAFETY * np.abs(angles_between(tangent[:, :-1], tangent[:, 1:])).sum(axis=1)
    return replace(pieces, start=start, end=end, span=span, turning=turning)


def find_meeting(pieces: Pieces, following: IntArray, batch: int = 4096) -> tuple[int, int] | None:
    """Find two pieces that cross, touch or fold back onto each other.

    Parameters
    ----------
    pieces : Pieces
        Pieces of closed loops, each of at least three pieces that turn by less than `LARGEST_TURNING`.
    following : (n,) int array
        Index of the piece that starts where this one ends.
    batch : int
        Pairs that are settled at a time.

    Returns
    -------
    (int, int) or None
        The owners of two pieces that meet, or None if the boundary is simple.

    Notes
    -----
    Bounding boxes of contiguous runs of pieces, halved level by level, leave about n pairs to look at. A pair whose
    chords are farther apart than both pieces stray is settled; otherwise the piece that strays more is halved.
    Neighbours are settled when the angle between their chords exceeds what both turn.
    """
    reach = (pieces.deviation + pieces.resolution)[:, None]
    low = np.minimum(pieces.start, pieces.end) - reach
    high = np.maximum(pieces.start, pieces.end) + reach
    first, second = overlapping_boxes(low, high)
    is_apart = (following[first] != second) & (following[second] != first)
    everyone = np.arange(len(pieces))
    first = np.concatenate([first[is_apart], everyone])
    second = np.concatenate([second[is_apart], following])
    is_joint = np.arange(len(first)) >= np.count_nonzero(is_apart)
    return _settle(pieces.take(first), pieces.take(second), is_joint, batch)


def _settle(a: Pieces, b: Pieces, is_joint: BoolArray, batch: int) -> tuple[int, int] | None:
    """Settle pairs (a, b), halving where needed; where `is_joint`, b starts at the end of a.

    Halves go first, a batch at a time: curves that coincide are found out after one descent to round-off.
    """
    waiting = _batches(a, b, is_joint, batch)
    n_halved = 0
    while waiting:
        a, b, is_joint = waiting.pop()
        is_open = ~np.where(is_joint, _neighbours_part(a, b), _keep_apart(a, b))
        rows = np.flatnonzero(is_open)
        if not len(rows):
            continue
        n_halved += len(rows)
        a, b, is_joint = a.take(rows), b.take(rows), is_joint[rows]
        is_final = np.maximum(a.deviation, b.deviation) <= np.maximum(a.resolution, b.resolution)
        if is_final.any() or n_halved > _MOST_HALVED:
            row = int(np.argmax(is_final))
            return int(a.owner[row]), int(b.owner[row])
        waiting += _batches(*_halve_pairs(a, b, is_joint), batch)
    return None


def _batches(a: Pieces, b: Pieces, is_joint: BoolArray, batch: int) -> list[tuple[Pieces, Pieces, BoolArray]]:
    """Cut pairs into batches, the first one last."""
    rows = np.arange(len(a))
    cut = [rows[begin : begin + batch] for begin in range(0, len(a), batch)]
    return [(a.take(each), b.take(each), is_joint[each]) for each in reversed(cut)]


def _halve_pairs(a: Pieces, b: Pieces, is_joint: BoolArray) -> tuple[Pieces, Pieces, BoolArray]:
    """Replace each pair by two: the piece that strays more is halved."""
    strays_more = a.deviation > b.deviation
    in_a, in_b = np.flatnonzero(strays_more), np.flatnonzero(~strays_more)
    a_first, a_second = a.take(in_a).halves()
    b_first, b_second = b.take(in_b).halves()
    halved_a = concatenate([a_first, a_second, a.take(in_b), a.take(in_b)])
    halved_b = concatenate([b.take(in_a), b.take(in_a), b_first, b_second])
    # b joins the second half of a, or the first half of b joins a
    no_joint_a, no_joint_b = np.zeros(len(in_a), dtype=bool), np.zeros(len(in_b), dtype=bool)
    return halved_a, halved_b, np.concatenate([no_joint_a, is_joint[in_a], is_joint[in_b], no_joint_b])


def _keep_apart(a: Pieces, b: Pieces) -> BoolArray:
    margin = a.deviation + b.deviation + np.maximum(a.resolution, b.resolution)
    return segment_distances(a.start, a.end, b.start, b.end) > margin


def _neighbours_part(a: Pieces, b: Pieces) -> BoolArray:
    """Return whether b leaves the end of a in a direction other than back along a."""
    angle = np.abs(angles_between(a.start - a.end, b.end - b.start)) - a.turning - b.turning
    opening = np.minimum(a.chord_length, b.chord_length) * np.sin(np.clip(angle, 0.0, 0.5 * np.pi))
    return opening > np.maximum(a.resolution, b.resolution)


def segment_distances(a: FloatArray, b: FloatArray, c: FloatArray, d: FloatArray) -> FloatArray:
    """Return the distances of the segments from a to b and from c to d, all (n, 2); zero where they cross."""
    ends = [point_distances(a, c, d), point_distances(b, c, d), point_distances(c, a, b), point_distances(d, a, b)]
    # signs spoilt by round-off belong to ends that lie within round-off of the other line, which `ends` sees
    is_crossing = (_side(a, b, c) * _side(a, b, d) < 0.0) & (_side(c, d, a) * _side(c, d, b) < 0.0)
    return np.where(is_crossing, 0.0, np.minimum.reduce(ends))


def point_distances(p: FloatArray, a: FloatArray, b: FloatArray) -> FloatArray:
    """Return the distances (...) of the points p from the segments from a to b, all (..., 2)."""
    chord = b - a
    fraction = ((p - a) * chord).sum(axis=-1) / np.maximum((chord * chord).sum(axis=-1), _TINY)
    return norms(p - a - np.clip(fraction, 0.0, 1.0)[..., None] * chord)


def _side(a: FloatArray, b: FloatArray, c: FloatArray) -> FloatArray:
    """Return the sign of the side of the line from a to b on which c lies, +1 for the left."""
    return np.sign(cross(b - a, c - a))


def overlapping_boxes(low: FloatArray, high: FloatArray) -> tuple[IntArray, IntArray]:
    """Find all pairs of boxes that overlap.

    Parameters
    ----------
    low, high : (n, 2) array
        Corners of the boxes; neighbours in the list should be neighbours in the plane.

    Returns
    -------
    first, second : (m,) int array
        Indices of the pairs, first < second.
    """
    levels = [(low, high)]
    while len(low) > _FEW_BOXES:
        if len(low) % 2:  # pad with an empty box, which overlaps nothing
            low = np.vstack([low, np.full((1, 2), np.inf)])
            high = np.vstack([high, np.full((1, 2), -np.inf)])
        levels[-1] = (low, high)
        low = low.reshape(-1, 2, 2).min(axis=1)
        high = high.reshape(-1, 2, 2).max(axis=1)
        levels.append((low, high))
    first, second = np.triu_indices(len(low))
    while True:
        low, high = levels.pop()
        meets = (first <= second) & (low[first] <= high[second]).all(axis=1) & (low[second] <= high[first]).all(axis=1)
        first, second = first[meets], second[meets]
        if not levels:
            break
        first = (2 * first + np.array([[0], [0], [1], [1]])).ravel()
        second = (2 * second + np.array([[0], [1], [0], [1]])).ravel()
    is_pair = first < second
    return first[is_pair], second[is_pair]
