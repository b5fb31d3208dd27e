"""Partitions of an outline into elements, and their refinement from a solution."""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.discretise import share_elements
from bemkit.geometry.meshing.division import Division, Piece, divide
from bemkit.geometry.outline import Outline, Selection
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.geometry.vectors import norms

EXPONENT = 2.5
"""Elements at the distance d from an end of a piece have lengths like d**(1 - 1/2.5) unless more is known. That suits
the logarithms at load jumps and the square roots at ends of contact zones."""
SPREAD = 0.5
"""Share of the elements that is spread over the contact boundary for any error estimate."""
IDLE = 0.2
"""Share of idle pieces in these, relative to other pieces."""
STEEPEST = 4.0
"""Largest ratio of the lengths of two neighbours."""
LEAST = 4
"""Elements of a piece: the error estimate lives on the nodes between elements."""
LEAST_DENSITY = 0.02
"""Smallest target density relative to the largest: elements stay everywhere."""


@dataclass(frozen=True, eq=False)
class Partition:
    """The pieces of an outline, each cut into elements.

    Parameters
    ----------
    base : Division
        The outline cut at corners and ends of parts.
    division : Division
        The same with further cuts.
    parameters : tuple of arrays
        For each piece of the division the parameters of its element ends on its side.
    """

    base: Division
    division: Division
    parameters: tuple[FloatArray, ...]

    @cached_property
    def mesh(self) -> BoundaryMesh:
        """The boundary mesh."""
        return self.division.mesh(self.parameters)

    @cached_property
    def sides(self) -> IntArray:
        """(n_elements,) array: number of the side of each element."""
        return np.repeat([piece.side for piece in self.division.pieces], [len(s) - 1 for s in self.parameters])

    @cached_property
    def spans(self) -> FloatArray:
        """(n_elements, 2) array: parameters of each element on its side."""
        return np.concatenate([np.column_stack([s[:-1], s[1:]]) for s in self.parameters])


def first_partition(
    outline: Outline,
    parts: Mapping[str, Selection],
    n_elements: int,
    *,
    even: Collection[str] = (),
    symmetry: Symmetry | None = None,
) -> Partition:
    """Divide an outline without a known solution.

    Parameters
    ----------
    outline : Outline
    parts : mapping of str to Selection
        Boundary parts by name.
    n_elements : int
        About so many elements, more where `LEAST` or `STEEPEST` ask for them.
    even : collection of str
        Parts with elements of equal length: transitions may lie anywhere on a contact boundary.
    symmetry : Symmetry, optional
        Lines of which only one side is divided.

    Returns
    -------
    Partition
        Graded towards corners and ends of parts; elements are shared like the square roots of lengths.
    """
    base = divide(outline, parts)
    if symmetry is not None:
        base = base.half(symmetry)
    shares = np.sqrt(base.piece_lengths)
    counts = share_elements(max(n_elements, LEAST * len(shares)), shares)
    parameters = []
    for piece, count in zip(base.pieces, counts.tolist(), strict=True):
        y = np.linspace(0.0, 1.0, max(LEAST, count) + 1)
        parameters.append(piece.at(y if piece.part in even else _stretched(y)))
    return _bisected_beside_short(base, base, parameters)


def better_partition(
    old: Partition,
    density: FloatArray,
    n_elements: int,
    *,
    cuts: Mapping[int, Sequence[float]],
    spread_over: Collection[str],
    spread: float = SPREAD,
    idle: BoolArray | None = None,
) -> Partition:
    """Divide an outline anew, by a target density on the elements of an old partition.

    Parameters
    ----------
    old : Partition
    density : (n_elements_old,) array
        How many new elements should lie in each old one, up to a factor.
    n_elements : int
        About so many elements, more where `LEAST` or `STEEPEST` ask for them.
    cuts : mapping of int to sequence of float
        Where pieces shall end besides corners and ends of parts: parameters by the number of the side.
    spread_over : collection of str
        Parts that share some of the elements among their pieces by the square roots of lengths, each graded
        towards its ends; the rest follows the density.
    spread : float
        Which part of all elements that is.
    idle : (n_elements_old,) bool array, optional
        Old elements without errors: their pieces take part in the spread by `IDLE` only.
    """
    division = old.base.cut(cuts)
    shares = np.sqrt(division.piece_lengths) * [piece.part in spread_over for piece in division.pieces]
    if idle is not None:
        shares *= [1.0 - (1.0 - IDLE) * _covered(piece, old, idle) for piece in division.pieces]
    shares *= spread / shares.sum() if shares.any() else 0.0
    density = np.maximum(density, LEAST_DENSITY * density.max()) if density.any() else np.ones_like(density)
    density = density * (1.0 - shares.sum()) / density.sum()
    parameters = []
    for piece, share in zip(division.pieces, shares.tolist(), strict=True):
        y, wanted = _density_along(piece, old, density)
        wanted += share * y
        count = max(LEAST, round(n_elements * float(wanted[-1])))
        parameters.append(piece.at(_stretched(np.interp(np.linspace(0.0, wanted[-1], count + 1), wanted, y))))
    return _bisected_beside_short(old.base, division, parameters)


def _covered(piece: Piece, old: Partition, chosen: BoolArray) -> float:
    """Return the part of a piece that some elements cover."""
    own = chosen & (old.sides == piece.side)
    (start, end), (starts, ends) = piece.span, old.spans[own].T
    return float(np.maximum(np.minimum(ends, end) - np.maximum(starts, start), 0.0).sum()) / (end - start)


def _density_along(piece: Piece, old: Partition, density: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the density summed up along a piece, as values at increasing stretched positions y from 0 to 1.

    In the coordinate y the piece is graded towards its ends already, so that an old element there is not merely cut
    into equal parts.
    """
    own = np.flatnonzero(old.sides == piece.side)
    own = own[np.argsort(old.spans[own, 0])]
    spans = (old.spans[own] - piece.span[0]) / (piece.span[1] - piece.span[0])
    ends = np.append(spans[:, 0], spans[-1, 1])
    x = np.concatenate([[0.0], ends[(ends > 0.0) & (ends < 1.0)], [1.0]])
    sums = np.interp(x, ends, np.append(0.0, np.cumsum(density[own])))
    return _flattened(x), sums - sums[0]


def _stretched(y: FloatArray) -> FloatArray:
    """Map [0, 1] to itself, graded towards both ends."""
    x = 0.5 * (2.0 * np.minimum(y, 1.0 - y)) ** EXPONENT
    return np.where(y <= 0.5, x, 1.0 - x)


def _flattened(x: FloatArray) -> FloatArray:
    """Invert `_stretched`."""
    y = 0.5 * (2.0 * np.minimum(x, 1.0 - x)) ** (1.0 / EXPONENT)
    return np.where(x <= 0.5, y, 1.0 - y)


def _bisected_beside_short(base: Division, division: Division, parameters: Sequence[FloatArray]) -> Partition:
    """Bisect elements until none is more than `STEEPEST` times as long as a neighbour, also around corners.

    Where a short contact element meets a long one around a corner, the error of the long one falls on the short one
    as a peak of its traction.
    """
    curves = [division.outline.sides[piece.side].curve for piece in division.pieces]
    while True:
        chords = [norms(np.diff(curve.point(s), axis=0)) for curve, s in zip(curves, parameters, strict=True)]
        lengths, after = np.concatenate(chords), division.following_elements([len(each) for each in chords])
        before, after = np.flatnonzero(after >= 0), after[after >= 0]
        shortest = np.full(lengths.size, np.inf)
        shortest[before] = lengths[after]
        shortest[after] = np.minimum(shortest[after], lengths[before])
        is_long = lengths > STEEPEST * shortest
        if not is_long.any():
            return Partition(base, division, tuple(parameters))
        chosen = np.split(is_long, np.cumsum([len(each) for each in chords])[:-1])
        parameters = [
            np.sort(np.concatenate([s, 0.5 * (s[:-1] + s[1:])[own]])) for s, own in zip(parameters, chosen, strict=True)
        ]
