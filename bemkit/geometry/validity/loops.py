"""Closed loops of pieces: do they bound a body on their left."""

from collections.abc import Callable

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.validity.chords import (
    Pieces,
    concatenate,
    derivative_on,
    evaluate_curves,
    point_on,
    split_until_flat,
)
from bemkit.geometry.validity.self_intersection import find_meeting, point_distances
from bemkit.geometry.vectors import angles_between, cross

_N_AREA_POINTS = 10  # round-off on pieces that turn by less than LARGEST_TURNING


def check_loops(
    pieces: Pieces,
    loop_of_owner: IntArray,
    is_exterior: bool,
    describe: Callable[[int], str],
    describe_loop: Callable[[int], str],
    least_splits: int = 0,
) -> None:
    """Raise unless the loops are simple, disjoint, rightly oriented and rightly nested.

    Parameters
    ----------
    pieces : Pieces
        One piece of every side or element, none of zero length; those of a loop stand together and in order.
    loop_of_owner : (n,) int array
        Number of the loop that each owner belongs to.
    is_exterior : bool
        Whether the body lies outside of all loops.
    describe, describe_loop : callable
        Number of a piece, or of a loop -> how a message calls it.
    least_splits : int
        How often to split curved pieces at least before their tangents are trusted.

    Raises
    ------
    GeometryError
        Naming what is wrong, where, and the remedy.
    """
    loop_sizes = np.bincount(loop_of_owner)
    flat = split_until_flat(pieces, describe, max(least_splits, int(loop_sizes.min() < 3)))
    loop = loop_of_owner[flat.owner]
    meeting = find_meeting(flat, following_in_loops(np.bincount(loop)))
    if meeting is not None:
        raise GeometryError(_meeting_message(*meeting, describe))
    areas: FloatArray = np.bincount(loop, weights=swept_areas(flat)).astype(float)
    members = [flat.take(np.flatnonzero(loop == k)) for k in range(len(loop_sizes))]
    if is_exterior:
        _check_cavities(areas, describe_loop)
        holes = list(range(len(members)))
    else:
        holes = _check_body(areas, members, describe_loop)
    _check_holes_apart(holes, members, describe_loop)


def following_in_loops(loop_sizes: IntArray) -> IntArray:
    """Return for each piece the index of the next one, where the pieces of each loop stand together and in order."""
    after = np.cumsum(loop_sizes)
    following = np.arange(1, after[-1] + 1)
    following[after - 1] = after - loop_sizes
    return following


def swept_areas(pieces: Pieces) -> FloatArray:
    """Return the area [m^2] that the ray from the middle of the body to each piece sweeps, anticlockwise positive.

    Over a closed loop they add up to its signed area.
    """
    middle = 0.5 * (pieces.start.min(axis=0) + pieces.start.max(axis=0))  # keeps the digits of a body far away
    areas = 0.5 * cross(pieces.start - middle, pieces.end - middle)
    rows = np.flatnonzero(pieces.curve >= 0)
    if len(rows):
        xi, weights = gauss_legendre(_N_AREA_POINTS)
        span = pieces.span[rows]
        s = span[:, :1] * (0.5 - 0.5 * xi) + span[:, 1:] * (0.5 + 0.5 * xi)
        x = evaluate_curves(pieces.curves, pieces.curve[rows], s, point_on) - middle
        dx = evaluate_curves(pieces.curves, pieces.curve[rows], s, derivative_on)
        areas[rows] = 0.25 * (span[:, 1] - span[:, 0]) * (cross(x, dx) @ weights)
    return areas


def is_inside(point: FloatArray, loop: Pieces) -> bool:
    """Tell whether a point (2,), not on the loop, lies inside of it, whichever way the loop runs.

    The winding number is the sum of the angles under which the pieces are seen. That of a curved piece is that of its
    chord unless the point lies between them; then the piece is halved.
    """
    total = 0.0
    while len(loop):
        p = np.broadcast_to(point, loop.start.shape)
        is_near = (point_distances(p, loop.start, loop.end) <= loop.deviation) & (loop.deviation > loop.resolution)
        total += float(angles_between(loop.start - point, loop.end - point)[~is_near].sum())
        loop = concatenate(list(loop.take(np.flatnonzero(is_near)).halves()))
    return round(total / (2.0 * np.pi)) != 0


def _meeting_message(first: int, second: int, describe: Callable[[int], str]) -> str:
    if first == second:
        return f"{describe(first)} meets itself: a boundary must not cross or touch itself; correct its curve"
    return (
        f"{describe(min(first, second))} and {describe(max(first, second))} cross, touch or fold back onto each other, "
        "as far as their digits tell: a boundary must not meet itself; move them apart"
    )


def _check_cavities(areas: FloatArray, describe_loop: Callable[[int], str]) -> None:
    for k in np.flatnonzero(areas > 0.0):
        raise GeometryError(
            f"{describe_loop(int(k))} runs anticlockwise, but the body lies outside of it (is_exterior=True): "
            "list its vertices clockwise, so that the body lies on the left"
        )


def _check_body(areas: FloatArray, members: list[Pieces], describe_loop: Callable[[int], str]) -> list[int]:
    """Check the outer loop and that the holes lie inside it; return the holes."""
    outer = int(np.argmax(np.abs(areas)))
    if areas[outer] < 0.0:
        raise GeometryError(
            f"the outer {describe_loop(outer)} runs clockwise: list its vertices anticlockwise, so that the body lies "
            "on the left (or set is_exterior=True if the body lies outside)"
        )
    holes = [k for k in range(len(areas)) if k != outer]
    for hole in holes:
        if areas[hole] > 0.0:
            raise GeometryError(
                f"{describe_loop(hole)} runs anticlockwise inside or beside the outer {describe_loop(outer)}: "
                "list the vertices of a hole clockwise, and give a second body an outline of its own"
            )
        if not is_inside(members[hole].start[0], members[outer]):
            raise GeometryError(
                f"{describe_loop(hole)} is a hole that lies outside of the outer {describe_loop(outer)}: "
                "move it into the body or leave it out"
            )
    return holes


def _check_holes_apart(holes: list[int], members: list[Pieces], describe_loop: Callable[[int], str]) -> None:
    """Raise if a hole lies in another one."""
    if len(holes) < 2:
        return
    low = np.array([(members[k].start - members[k].deviation[:, None]).min(axis=0) for k in holes])
    high = np.array([(members[k].start + members[k].deviation[:, None]).max(axis=0) for k in holes])
    for row, hole in enumerate(holes):
        point = members[hole].start[0]
        is_candidate: BoolArray = ((low <= point) & (point <= high)).all(axis=1)
        is_candidate[row] = False
        for other in np.array(holes)[is_candidate]:
            if is_inside(point, members[other]):
                raise GeometryError(
                    f"{describe_loop(hole)} lies inside {describe_loop(int(other))}, where there is no body: "
                    "leave one of the two out"
                )
