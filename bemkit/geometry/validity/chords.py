"""Pieces of a boundary: chords with a bound on how far the boundary strays from them.

The sides of an outline and the elements of a mesh are examined as the same thing: pieces in order along closed
loops, each a chord and the total angle by which its tangent turns. A piece that turns by `turning` strays from its
chord by at most tan(turning / 2) / 2 chord lengths, and leaves its ends within the angle `turning` of the chord.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.curves import Curve
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.vectors import angles_between, norms

LARGEST_TURNING = np.pi / 4
"""Pieces are split until they turn by less, so that none can meet itself."""
_N_TANGENTS = 9
_TURNING_SAFETY = 1.25  # the turning is sampled, not bounded
_MOST_SPLITS = 24  # the tip of a thin ellipse turns on as little of its length as the square of its slenderness
RESOLUTION = 8 * float(np.finfo(float).eps)
"""Points closer than this times the size of their coordinates are the same point: they differ by round-off only."""


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
        point = evaluate_curves(self.curves, self.curve, middle[:, None], point_on)[:, 0]
        first = _with_turning(self, self.start, point, np.column_stack([self.span[:, 0], middle]))
        second = _with_turning(self, point, self.end, np.column_stack([middle, self.span[:, 1]]))
        return first, second


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
        Split this often in any case, so that the sampled tangents see what a long side does.

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


def point_on(curve: Curve, s: FloatArray) -> FloatArray:
    """Return the points of a curve."""
    return curve.point(s)


def derivative_on(curve: Curve, s: FloatArray) -> FloatArray:
    """Return the derivatives of a curve."""
    return curve.derivative(s)


def evaluate_curves(
    curves: tuple[Curve, ...],
    curve: IntArray,
    s: FloatArray,
    evaluate: Callable[[Curve, FloatArray], FloatArray],
) -> FloatArray:
    """Evaluate the curve with index `curve[i]` at the parameters `s[i]`.

    Parameters
    ----------
    curves : tuple of Curve
        The curves.
    curve : (m,) int array
        Indices of curves; rows with -1 are left zero.
    s : (m, q) array
        Parameters.
    evaluate : callable
        `point_on` or `derivative_on`.

    Returns
    -------
    (m, q, 2) array [m]
    """
    values = np.zeros((*s.shape, 2))
    for index in np.unique(curve[curve >= 0]):
        rows = np.flatnonzero(curve == index)
        values[rows] = evaluate(curves[index], s[rows].ravel()).reshape(len(rows), s.shape[1], 2)
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
        tangent = evaluate_curves(pieces.curves, pieces.curve[rows], s, derivative_on)
        turning[rows] = _TURNING_SAFETY * np.abs(angles_between(tangent[:, :-1], tangent[:, 1:])).sum(axis=1)
    return replace(pieces, start=start, end=end, span=span, turning=turning)
