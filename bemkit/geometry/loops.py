"""Checks that closed loops of pieces, or arrays of nodes and elements, bound a body on their left."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.curves import Curve
from bemkit.geometry.pieces import (
    Pieces,
    concatenate,
    evaluate_curves,
    find_meeting,
    point_distances,
    resolution,
    split_until_flat,
)
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import check_magnitude, cross, norms, winding_numbers

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry

_N_AREA_POINTS = 10  # round-off on pieces that turn by less than LARGEST_TURNING
_CURVE_TOLERANCE = 1e-2  # of the chord: finds a wrong curve or span, forgives a body moved here from far away
_N_SPEEDS = 5
_SPEED_TOLERANCE = 1e-10  # forgives the round-off of derivatives given as differences of large numbers, not more


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
        One piece of every side or element, none of zero length; those of a loop are consecutive and in order.
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
    """Return for each piece the index of the next one, where the pieces of each loop are consecutive and in order."""
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
        x = evaluate_curves(pieces.curves, pieces.curve[rows], s) - middle
        dx = evaluate_curves(pieces.curves, pieces.curve[rows], s, derivative=True)
        areas[rows] = 0.25 * (span[:, 1] - span[:, 0]) * (cross(x, dx) @ weights)
    return areas


def is_inside(point: FloatArray, loop: Pieces) -> bool:
    """Return whether a point (2,), not on the loop, lies inside of it, whichever way the loop runs.

    Curved pieces are halved until the point does not lie between them and their chords.
    """
    number = 0
    while len(loop):
        is_near = (point_distances(point, loop.start, loop.end) <= loop.deviation) & (loop.deviation > loop.resolution)
        number += int(winding_numbers(point[None], loop.start[~is_near], loop.end[~is_near])[0])
        loop = concatenate(list(loop.take(np.flatnonzero(is_near)).halves()))
    return number != 0


def _meeting_message(first: int, second: int, describe: Callable[[int], str]) -> str:
    if first == second:
        return f"{describe(first)} meets itself: a boundary must not cross or touch itself; correct its curve"
    return (
        f"{describe(min(first, second))} and {describe(max(first, second))} cross, touch or fold back onto each other, "
        "within round-off: a boundary must not meet itself; move them apart"
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
                "move it into the body or remove it"
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
                    "remove one of the two"
                )


def as_index(values: npt.ArrayLike, name: str) -> IntArray:
    """Return a new integer array; the error names `name`."""
    array = np.array(values)
    if array.size and array.dtype.kind not in "iu":
        raise GeometryError(f"BoundaryMesh: {name} is an array of {array.dtype}: give an array of integers")
    return array.astype(np.intp)


def check_chains(
    nodes: FloatArray, elements: IntArray, symmetry: Symmetry | None = None, *, is_strip: bool = False
) -> None:
    """Raise unless the elements join finite, distinct nodes to chains: closed, between symmetry lines, or one strip."""
    for name, array in (("nodes", nodes), ("elements", elements)):
        if array.ndim != 2 or array.shape[1] != 2 or not len(array):
            raise GeometryError(f"BoundaryMesh: {name} has shape {array.shape}: give an array of shape (n, 2), n >= 2")
    for node in np.flatnonzero(~np.isfinite(nodes).all(axis=1)):
        raise GeometryError(f"BoundaryMesh: node {node} is {format_point(nodes[node])}: coordinates must be finite")
    check_magnitude(nodes, "BoundaryMesh")
    for element in np.flatnonzero(((elements < 0) | (elements >= len(nodes))).any(axis=1)):
        raise GeometryError(
            f"BoundaryMesh: element {element} joins nodes {elements[element].tolist()}, but there are {len(nodes)} "
            f"nodes: use numbers from 0 to {len(nodes) - 1}"
        )
    n_starting, n_ending = (np.bincount(elements[:, column], minlength=len(nodes)) for column in (0, 1))
    is_joint = (n_starting == 1) & (n_ending == 1)
    if symmetry is not None:
        is_joint |= (n_starting + n_ending == 1) & symmetry.meets(nodes).any(axis=1)
    if is_strip:
        is_joint[[0, -1]] |= (n_starting + n_ending == 1)[[0, -1]]
    for node in np.flatnonzero(~is_joint):
        raise GeometryError(
            f"BoundaryMesh: node {node} at {format_point(nodes[node])} starts {n_starting[node]} and ends "
            f"{n_ending[node]} elements: each node must start one and end one, so that the boundary is closed"
            + ("" if symmetry is None else f", or lie on the symmetry line ({symmetry})")
            + (", but for the first and the last one of a half-plane" if is_strip else "")
        )
    chord = norms(nodes[elements[:, 1]] - nodes[elements[:, 0]])
    for element in np.flatnonzero(chord <= resolution(nodes[elements[:, 0]], nodes[elements[:, 1]])):
        raise GeometryError(
            f"BoundaryMesh: {describe_element(nodes, elements, int(element))}, has length {chord[element]:.3g}, no "
            "more than the round-off of its coordinates: join its nodes, grade less, or move the body to the origin"
        )
    order = np.lexsort(nodes.T)
    for k in np.flatnonzero((nodes[order[1:]] == nodes[order[:-1]]).all(axis=1)):
        first, second = sorted((int(order[k]), int(order[k + 1])))
        raise GeometryError(
            f"BoundaryMesh: nodes {first} and {second} are the same point {format_point(nodes[first])}: "
            "a boundary must not touch itself; move them apart, or join them if the elements between have no length"
        )


def check_curves(
    nodes: FloatArray, elements: IntArray, curves: tuple[Curve, ...], element_curve: IntArray, span: FloatArray
) -> None:
    """Raise unless curved elements lie on their curves."""
    n = len(elements)
    if element_curve.shape != (n,) or span.shape != (n, 2):
        raise GeometryError(
            f"BoundaryMesh: element_curve has shape {element_curve.shape} and element_span {span.shape} for {n} "
            f"elements: give shapes ({n},) and ({n}, 2)"
        )
    for element in np.flatnonzero((element_curve < -1) | (element_curve >= len(curves))):
        raise GeometryError(
            f"BoundaryMesh: element {element} follows curve {element_curve[element]} of {len(curves)} curves: "
            "use the index of a curve, or -1 for a straight element"
        )
    is_curved = element_curve >= 0
    for element in np.flatnonzero(is_curved & ~((span[:, 0] >= 0.0) & (span[:, 0] < span[:, 1]) & (span[:, 1] <= 1.0))):
        raise GeometryError(
            f"BoundaryMesh: element {element} has the span {span[element].tolist()} on its curve: "
            "give an increasing pair of parameters in [0, 1]"
        )
    ends = nodes[elements]
    distance = norms(evaluate_curves(curves, element_curve, span) - ends).max(axis=1)
    tolerance = _CURVE_TOLERANCE * norms(ends[:, 1] - ends[:, 0]) + resolution(ends[:, 0], ends[:, 1])
    for element in np.flatnonzero(is_curved & ~(distance <= tolerance)):
        raise GeometryError(
            f"BoundaryMesh: {describe_element(nodes, elements, int(element))}, has ends {distance[element]:.3g} away "
            f"from the points of its curve at {span[element].tolist()}: correct its nodes, curve or span"
        )
    _check_speed(curves, np.flatnonzero(is_curved), element_curve[is_curved], span[is_curved])


def _check_speed(curves: tuple[Curve, ...], elements: IntArray, element_curve: IntArray, span: FloatArray) -> None:
    """Raise unless the speed |dx/ds| is the same all over each curved element."""
    fractions = np.linspace(0.0, 1.0, _N_SPEEDS)
    s = span[:, :1] * (1.0 - fractions) + span[:, 1:] * fractions
    speed = norms(evaluate_curves(curves, element_curve, s, derivative=True))
    for k in np.flatnonzero(~(np.ptp(speed, axis=1) <= _SPEED_TOLERANCE * speed.max(axis=1))):
        raise GeometryError(
            f"BoundaryMesh: element {elements[k]} follows curve {element_curve[k]} with speeds |dx/ds| from "
            f"{speed[k].min():.6g} to {speed[k].max():.6g}: the parameter must be proportional to the arc length; "
            "use ParametricCurve(curve.point, curve.derivative)"
        )


def check_parts(
    parts: Mapping[str, npt.ArrayLike], n_elements: int, *, may_be_empty: bool = False
) -> dict[str, IntArray]:
    """Return the parts, sorted and read-only, or raise unless they are disjoint sets of elements."""
    checked: dict[str, IntArray] = {}
    part_of_element = np.full(n_elements, -1)
    for number, (name, values) in enumerate(parts.items()):
        members = np.sort(as_index(values, f"part {name!r}").ravel())
        if not (isinstance(name, str) and name) or not (len(members) or may_be_empty):
            raise GeometryError(
                f"BoundaryMesh: part {name!r} has {len(members)} elements: give parts a name and at least one element"
            )
        if len(members) and (members[0] < 0 or members[-1] >= n_elements):
            outside = members[0] if members[0] < 0 else members[-1]
            raise GeometryError(
                f"BoundaryMesh: part {name!r} contains element {outside}: use numbers from 0 to {n_elements - 1}"
            )
        for element in members[1:][members[1:] == members[:-1]]:
            raise GeometryError(f"BoundaryMesh: part {name!r} contains element {element} twice: list it once")
        for element in members[part_of_element[members] >= 0]:
            other = list(parts)[part_of_element[element]]
            raise GeometryError(
                f"BoundaryMesh: element {element} is in the parts {other!r} and {name!r}: parts must not overlap"
            )
        part_of_element[members] = number
        checked[name] = read_only(members)
    return checked


def follow_loops(elements: IntArray) -> tuple[IntArray, ...]:
    """Return the elements of each loop in order, starting at its smallest; the nodes must have been checked."""
    return tuple(np.array([element for element, _ in chain], np.intp) for chain in closed_chains(elements))


def closed_chains(ends: IntArray) -> Iterator[list[tuple[int, bool]]]:
    """Yield the closed chains of links whose ends (n, 2) are numbered so that two links share each.

    Each as the numbers of its links in order, and whether the link is followed from its first end to its second.
    """
    by_end = (np.argsort(ends.ravel(), kind="stable").reshape(-1, 2) // 2).tolist()
    pairs, is_seen = ends.tolist(), [False] * len(ends)
    for first in range(len(pairs)):
        chain, number, end = [], first, pairs[first][0]
        while not is_seen[number]:
            is_seen[number] = True
            start, stop = pairs[number]
            is_ahead = start == end
            chain.append((number, is_ahead))
            end = stop if is_ahead else start
            one, other = by_end[end]
            number = other if one == number else one
        if chain:
            yield chain


def restrict_loops(loops: tuple[IntArray, ...], elements: IntArray) -> tuple[IntArray, ...]:
    """Return what loops of a whole body hold of the first elements, each in order from a symmetry line on."""
    restricted = [loop[loop < len(elements)] for loop in loops]
    result = []
    for loop in filter(len, restricted):
        starts_on_line = np.isin(elements[loop, 0], elements[loop, 1], invert=True)
        result.append(np.roll(loop, -int(np.argmax(starts_on_line))))
    return tuple(result)


def check_mesh_loops(
    nodes: FloatArray, elements: IntArray, pieces: Pieces, loops: tuple[IntArray, ...], is_exterior: bool
) -> None:
    """Raise unless the loops bound a body on their left."""
    loop_of_element = np.empty(len(elements), dtype=np.intp)
    for k, loop in enumerate(loops):
        loop_of_element[loop] = k

    def describe_loop(k: int) -> str:
        return f"loop of {len(loops[k])} elements through element {loops[k][0]}"

    describe = partial(describe_element, nodes, elements)
    check_loops(pieces.take(np.concatenate(loops)), loop_of_element, is_exterior, describe, describe_loop)


def describe_element(nodes: FloatArray, elements: IntArray, element: int) -> str:
    """Name an element by its number and its ends."""
    start, end = nodes[elements[element]]
    return f"element {element}, from {format_point(start)} to {format_point(end)}"
