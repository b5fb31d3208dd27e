"""Partitions into few elements of high degree, in geometric layers towards the ends of their pieces.

Fields are smooth inside a piece and singular at its ends: corners, ends of boundary parts, and places where the contact
status changes, whose pieces move with them. Elements there shrink by a constant factor from layer to layer, which gives
exponential convergence together with a rising degree [BabuskaGuo1986]. Where an error is small nothing is cut.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.curves import Curve
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import share_elements
from bemkit.geometry.meshing.division import Division, Piece
from bemkit.geometry.meshing.partition import LEAST, Partition
from bemkit.geometry.vectors import norms

FACTOR = 0.2
"""Length of a layer over that of the next one."""
FIRST_LAYERS = (1, 2)
"""Layers to begin with: at corners and ends of parts, and where the contact status changes."""
MOST_LAYERS = 3
"""Largest number of layers that an end gains at once, since their number follows from an estimate on the mesh
before."""
SHORTEST = 1e3 * float(np.finfo(float).eps)
"""Least length of an element, relative to the largest coordinate: shorter ones would have less than three digits."""
STEEPEST = 7.0
"""Largest ratio of the lengths of two elements that meet at an end of their pieces. The error of a long one would fall
on a short one as a peak of its traction."""
NEXT_MOTION = 0.1
"""Motion of the transitions from one mesh to the next, relative to the motion before."""
LARGEST_TURN = np.pi / 4.0
"""Angle by which a curve may turn on one element."""


def probing_partition(base: Division, even: Collection[str], n_elements: int) -> Partition:
    """Divide an outline without a known solution, to locate the transitions.

    Parameters
    ----------
    base : Division
        The outline cut at corners and ends of parts.
    even : collection of str
        Parts with elements of equal length besides a layer at their ends: transitions may lie anywhere on a contact
        boundary. Other pieces take two elements and a layer at their ends.
    n_elements : int
        Total that all pieces share in proportion to the square roots of their lengths.
    """
    shares = np.sqrt(base.piece_lengths)
    counts = share_elements(max(n_elements, LEAST * shares.size), shares)
    n_even = np.where([piece.part in even for piece in base.pieces], counts, 2)
    n_layers = FIRST_LAYERS[0] * _singular_ends(base)
    return _layered_at_joints(base, base, [_first_layers(*ends) for ends in np.vstack([n_layers, n_even]).T.tolist()])


def layered_partition(base: Division, cuts: Mapping[int, Sequence[float]], *, n_at_jumps: int = 1) -> Partition:
    """Divide an outline into few elements, with a layer or two at the ends of its pieces.

    Parameters
    ----------
    base : Division
        The outline cut at corners and ends of parts.
    cuts : mapping of int to sequence of float
        Where the contact status changes: parameters by the number of the side.
    n_at_jumps : int
        Layers where parts end inside of a side, as loads jump there.
    """
    division = base.cut(cuts)
    n_layers = np.where(_inside_sides(division), n_at_jumps, FIRST_LAYERS[0])
    n_layers = np.where(_at_cut(base, division), FIRST_LAYERS[1], n_layers) * _singular_ends(division)
    return _layered_at_joints(base, division, [_first_layers(*ends) for ends in n_layers.T.tolist()])


def refined_partition(old: Partition, excess: FloatArray, fresh: Partition, resolution: float) -> Partition:
    """Divide elements with too large errors, and move the ends of pieces to the new transitions.

    Parameters
    ----------
    old : Partition
    excess : (n_elements,) array
        By which factor the error of each element is above its share; what is below 1 stays.
    fresh : Partition
        A `layered_partition` of the same base. Where a piece of the base has other numbers of pieces there, it begins
        anew. Layers go down to what places that move are expected to move again, by which their fields stay within
        them.
    resolution : float
        Length, relative to a piece, below which that makes no difference.

    Returns
    -------
    Partition
        An element at an end of its piece has become layers, others halves.
    """
    is_end = _singular_ends(old.division).T.tolist()
    excesses = np.split(excess, np.cumsum([len(s) - 1 for s in old.parameters])[:-1])
    # coordinates along a piece are fractions of its length
    shortest = np.maximum(shortest_length(old.mesh) / old.division.piece_lengths, SHORTEST).tolist()
    refined = [
        _refined(_fractions(piece, s), own, least, *ends)
        for piece, s, own, least, ends in zip(
            old.division.pieces, old.parameters, excesses, shortest, is_end, strict=True
        )
    ]
    before, now = _owners(old.base, old.division), _owners(old.base, fresh.division)
    fractions = []
    for number in range(len(old.base.pieces)):
        own, new = np.flatnonzero(before == number).tolist(), np.flatnonzero(now == number).tolist()
        if len(own) == len(new):
            fractions += [
                _down_to_motion(refined[k], old.division.pieces[k], fresh.division.pieces[n], resolution)
                for k, n in zip(own, new, strict=True)
            ]
        else:
            fractions += [_fractions(fresh.division.pieces[k], fresh.parameters[k]) for k in new]
    return _layered_at_joints(old.base, fresh.division, fractions)


def shortest_length(mesh: BoundaryMesh) -> float:
    """Return the least length of elements that coordinates still hold."""
    return SHORTEST * float(np.abs(mesh.nodes).max())


def has_same_pieces(old: Partition, new: Partition) -> bool:
    """Whether as many pieces lie on each piece of the base."""
    return np.array_equal(_owners(old.base, old.division), _owners(new.base, new.division))


def origins(old: Partition, new: Partition) -> tuple[IntArray, FloatArray]:
    """Return from which elements of a partition with the same pieces new ones come, and how many layers below.

    Returns
    -------
    old_elements : (n_elements,) int array
    layers : (n_elements,) array
        Logarithm of the length relative to the longest element that comes from the same one, in layers.
    """
    first, found, lengths = 0, [], []
    for old_piece, old_s, piece, s in zip(
        old.division.pieces, old.parameters, new.division.pieces, new.parameters, strict=True
    ):
        before, now = _fractions(old_piece, old_s), _fractions(piece, s)
        found.append(first + np.searchsorted(before, 0.5 * (now[:-1] + now[1:])) - 1)
        lengths.append(np.diff(now))
        first += before.size - 1
    elements, sizes = np.concatenate(found), np.concatenate(lengths)
    longest = np.zeros(first)
    np.maximum.at(longest, elements, sizes)
    return elements, np.log(sizes / longest[elements]) / np.log(FACTOR)


def is_at_end(partition: Partition) -> BoolArray:
    """Return (n_elements,) which elements lie at an end of their piece that is off symmetry lines."""
    result = np.zeros(len(partition.sides), bool)
    counts = np.array([len(s) - 1 for s in partition.parameters])
    at_start, at_end = _singular_ends(partition.division)
    last = np.cumsum(counts) - 1
    result[(last + 1 - counts)[at_start]] = True
    result[last[at_end]] = True
    return result


def _first_layers(n_left: int, n_right: int, n_even: int = 2) -> FloatArray:
    """Return the ends of elements of equal length, the first and the last of them cut into layers."""
    left, right = (FACTOR ** np.arange(n, 0, -1.0) / n_even for n in (n_left, n_right))
    return np.concatenate([[0.0], left, np.arange(1.0, n_even) / n_even, 1.0 - right[::-1], [1.0]])


def _fractions(piece: Piece, parameters: FloatArray) -> FloatArray:
    start, end = piece.span
    fractions: FloatArray = (parameters - start) / (end - start)
    fractions[[0, -1]] = 0.0, 1.0
    return fractions


def _refined(fractions: FloatArray, excess: FloatArray, shortest: float, is_start: bool, is_end: bool) -> FloatArray:
    """Cut the elements of a piece; fields may be singular at its ends if `is_start` and `is_end`."""
    wanted = np.ceil(np.log(np.maximum(excess, 1.0)) / -np.log(FACTOR))
    possible = np.floor(np.log(np.maximum(np.diff(fractions) / shortest, 1.0)) / -np.log(FACTOR))
    layers = np.minimum(wanted, np.minimum(possible, MOST_LAYERS)).astype(int).tolist()
    last, points = len(layers) - 1, [fractions[:1]]
    for number, n_layers in enumerate(layers):
        start, end = fractions[number : number + 2]
        if n_layers == 0:
            inner = np.zeros(0)
        elif last > 0 and is_start and number == 0:
            inner = FACTOR ** np.arange(n_layers, 0, -1.0)
        elif last > 0 and is_end and number == last:
            inner = 1.0 - FACTOR ** np.arange(1.0, n_layers + 1)
        else:
            inner = np.array([0.5])
        points += [start + (end - start) * inner, np.array([end])]
    return np.concatenate(points)


def _down_to_motion(fractions: FloatArray, before: Piece, now: Piece, resolution: float) -> FloatArray:
    """Add layers at ends of a piece that have moved."""
    length = abs(now.span[1] - now.span[0])
    for end in (0, 1):
        motion = abs(now.span[end] - before.span[end]) / length
        longest = max(NEXT_MOTION * motion, resolution)
        while motion > 0.0 and (tip := fractions[1] if end == 0 else 1.0 - fractions[-2]) > longest:
            tip *= FACTOR
            fractions = np.insert(fractions, *((1, tip) if end == 0 else (-1, 1.0 - tip)))
    return fractions


def _layered_at_joints(base: Division, division: Division, fractions: Sequence[FloatArray]) -> Partition:
    """Bisect elements that turn too far, and add layers where a long element meets a short one of another piece."""
    curves = [division.outline.sides[piece.side].curve for piece in division.pieces]
    parameters = [
        _bisected_where_turning(curve, piece.at(f))
        for curve, piece, f in zip(curves, division.pieces, fractions, strict=True)
    ]
    following = division.following
    is_done = False
    while not is_done:
        is_done = True
        for k, after in enumerate(following.tolist()):
            if after < 0:
                continue
            end, start = parameters[k], parameters[after]
            length = norms(np.subtract(*curves[k].point(end[-2:])))
            other = norms(np.subtract(*curves[after].point(start[:2])))
            if length > STEEPEST * other:
                parameters[k], is_done = np.insert(end, -1, end[-1] + FACTOR * (end[-2] - end[-1])), False
            elif other > STEEPEST * length:
                parameters[after], is_done = np.insert(start, 1, start[0] + FACTOR * (start[1] - start[0])), False
    return Partition(base, division, tuple(parameters))


def _bisected_where_turning(curve: Curve, parameters: FloatArray) -> FloatArray:
    while not curve.is_straight:
        middles = 0.5 * (parameters[:-1] + parameters[1:])
        ends, between = (curve.derivative(s) @ np.array([1.0, 1j]) for s in (parameters, middles))
        turn = np.abs(np.angle(between / ends[:-1])) + np.abs(np.angle(ends[1:] / between))
        if not (turn > LARGEST_TURN).any():
            break
        parameters = np.sort(np.concatenate([parameters, middles[turn > LARGEST_TURN]]))
    return parameters


def _owners(base: Division, division: Division) -> IntArray:
    """Return the piece (n_pieces,) of the base that each piece lies on."""
    spans = [(piece.side, *piece.span) for piece in base.pieces]
    middles = [(piece.side, 0.5 * sum(piece.span)) for piece in division.pieces]
    owners = [
        next(k for k, (own, start, end) in enumerate(spans) if own == side and start < middle < end)
        for side, middle in middles
    ]
    return np.array(owners, dtype=np.intp)


def _at_cut(base: Division, division: Division) -> BoolArray:
    """Return (2, n_pieces) whether the start and the end of each piece are not ends of a piece of the base."""
    ends = {(piece.side, end) for piece in base.pieces for end in piece.span}
    return np.array([[(piece.side, piece.span[end]) not in ends for piece in division.pieces] for end in (0, 1)], bool)


def _inside_sides(division: Division) -> BoolArray:
    """Return (2, n_pieces) whether the start and the end of each piece are not ends of a side."""
    return np.array([[piece.span[end] not in (0.0, 1.0) for piece in division.pieces] for end in (0, 1)], bool)


def _singular_ends(division: Division) -> BoolArray:
    """Return (2, n_pieces) whether the start and the end of each piece are off symmetry lines."""
    following = division.following
    has_before = np.isin(np.arange(following.size), following)
    return np.stack([has_before, following >= 0])
