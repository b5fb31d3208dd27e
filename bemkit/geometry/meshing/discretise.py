"""From an outline to a mesh: the user's parts, the user's number of elements, and how these are spaced along a piece.

Where a long element follows a short one, the nodal force between them belongs to the long one, and the traction that is
found from it on the short one is wrong by a share that grows with the ratio of their lengths. So lengths grow gradually
away from a densely divided neighbour, unless a grading says otherwise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.division import Division, divide
from bemkit.geometry.outline import Outline, Selection

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry

ALIKE = 1.2
"""Largest ratio of two neighbouring element lengths without a gradual transition."""
GROWTH = 0.3
"""Growth of the element length per length of boundary, unless there are too few elements for so little."""
TIE = 1e-6
"""Least relative difference of the lengths of shorter elements: lengths have few digits far from the origin."""
LARGEST_STRETCH = 2.0
"""No element is longer than this many times the mean of its piece."""


class Grading(Protocol):
    """A rule for spacing elements."""

    def positions(self, n: int) -> FloatArray:
        """Return where `n` elements begin and end along a piece.

        Parameters
        ----------
        n : int
            Number of elements, at least one.

        Returns
        -------
        (n + 1,) array
            Fractions of the length of the piece, strictly increasing from 0 to 1.
        """
        ...


@dataclass(frozen=True)
class Uniform:
    """Elements of equal length."""

    def positions(self, n: int) -> FloatArray:
        """Return equidistant fractions."""
        return np.arange(n + 1) / n


@dataclass(frozen=True)
class Algebraic:
    """Elements that shrink towards both ends like a power of the distance.

    Parameters
    ----------
    exponent : float
        Power of grading; 1 is uniform, 2 to 4 suit corners and edges of contact.
    """

    exponent: float = 2.0

    def __post_init__(self) -> None:
        if not (np.isfinite(self.exponent) and self.exponent >= 1.0):
            raise GeometryError(f"Algebraic: exponent is {self.exponent}: give a finite number of at least 1")

    def positions(self, n: int) -> FloatArray:
        """Return fractions (2 t)^exponent / 2 on the first half, mirrored on the second."""
        half = np.arange(n // 2 + 1) / n
        return _mirrored(0.5 * (2.0 * half) ** self.exponent, n)


@dataclass(frozen=True)
class Geometric:
    """Elements that shrink by a constant ratio towards both ends, and are equal between.

    Parameters
    ----------
    ratio : float
        Length of an element over that of its larger neighbour, between 0 and 1.
    levels : int
        Number of times the length shrinks on the way to either end; the ends have elements ratio**levels times as long
        as the middle. With fewer than 2 levels + 1 elements the largest ones are omitted.
    """

    ratio: float = 0.5
    levels: int = 8

    def __post_init__(self) -> None:
        if not 0.0 < self.ratio < 1.0:
            raise GeometryError(f"Geometric: ratio is {self.ratio}: give a number between 0 and 1")
        if not isinstance(self.levels, int | np.integer) or self.levels < 0:
            raise GeometryError(f"Geometric: levels is {self.levels}: give a whole number, zero or more")

    def positions(self, n: int) -> FloatArray:
        """Return the partial sums of the geometric lengths."""
        from_end = np.minimum(np.arange(n), np.arange(n)[::-1])
        lengths = float(self.ratio) ** np.maximum(self.levels - from_end, 0)
        half = np.concatenate([[0.0], np.cumsum(lengths[: n // 2])])
        return _mirrored(half / lengths.sum(), n)


def _mirrored(half: FloatArray, n: int) -> FloatArray:
    """Complete the first n // 2 + 1 of n + 1 fractions, so that both halves mirror each other to round-off."""
    if n % 2 == 0:
        half = np.append(half[:-1], 0.5)
        return np.concatenate([half, 1.0 - half[-2::-1]])
    return np.concatenate([half, 1.0 - half[::-1]])


def discretise(
    outline: Outline,
    *,
    n_elements: int,
    parts: Mapping[str, Selection] | None = None,
    grading: Grading | None = None,
    density: Mapping[str, float] | None = None,
    part_density: Mapping[str, float] | None = None,
    symmetry: Symmetry | None = None,
) -> BoundaryMesh:
    """Divide an outline into elements.

    Parameters
    ----------
    outline : Outline
        The boundary.
    n_elements : int
        Number of elements of the mesh, shared among sides (and the pieces that the parts cut from them) in proportion
        to their lengths, at least one each.
    parts : mapping of str to Selection, optional
        Boundary parts by name; they must not overlap, and need not cover the boundary.
    grading : Grading, optional
        Spacing of the elements on every piece. By default uniform, but for lengths that grow gradually next to a piece
        with elements of less than half the length.
    density : mapping of str to float, optional
        How densely sides are divided compared with the others, by the name of the side, or else of
        its group; by default 1.
    part_density : mapping of str to float, optional
        The same by the name of a part, positive; both count where both are given.
    symmetry : Symmetry, optional
        Lines of which only the side x <= a, y <= b is divided, into a half or a quarter of `n_elements`.

    Returns
    -------
    BoundaryMesh
        Elements run along each loop in order, node i starts element i; parts end exactly at nodes.

    Raises
    ------
    GeometryError
        If a part is empty, overlaps another or names an unknown side, or there are fewer elements than pieces, or a
        density is not positive or names an unknown side, or one beyond the symmetry lines; or if these do not cross
        the body.
    """
    density = {} if density is None else density
    _check_density(density, outline)
    parts = {} if parts is None else parts
    grading = Uniform() if grading is None else grading
    division = divide(outline, parts)
    if symmetry is not None:
        division = division.half(symmetry)
        n_elements = _share_of_half(n_elements, division, symmetry)
        _check_sides_divided(density, division)
    lengths = division.piece_lengths
    sides = [outline.sides[piece.side] for piece in division.pieces]
    densities = np.array([density.get(side.name, density.get(side.group, 1.0)) for side in sides])
    densities *= [(part_density or {}).get(piece.part or "", 1.0) for piece in division.pieces]
    counts = share_elements(n_elements, lengths * densities)
    if isinstance(grading, Uniform):
        positions = _gradual(division, counts, lengths)
    else:
        positions = [_checked_positions(grading, int(count)) for count in counts]
    return division.mesh([piece.at(p) for piece, p in zip(division.pieces, positions, strict=True)])


def share_elements(n_elements: int, lengths: FloatArray) -> IntArray:
    """Share elements among pieces in proportion to their lengths, by largest remainders, at least one each.

    Raises
    ------
    GeometryError
        If there are fewer elements than pieces.
    """
    if not isinstance(n_elements, int | np.integer) or n_elements < len(lengths):
        raise GeometryError(
            f"discretise: n_elements is {n_elements}, but the outline has {len(lengths)} pieces (sides, cut "
            f"where parts end): give a whole number of at least {len(lengths)}"
        )
    quota: FloatArray = n_elements * lengths / lengths.sum()
    # pieces too short for a whole element get one, and leave the others to share the rest
    is_short = np.zeros(len(lengths), dtype=bool)
    while (quota[~is_short] < 1.0).any():
        is_short |= quota < 1.0
        rest = lengths[~is_short]
        quota[~is_short] = (n_elements - np.count_nonzero(is_short)) * rest / rest.sum()
    quota[is_short] = 1.0
    # halves that differ by round-off, which is large far from the origin, are ties: the order of pieces settles them
    quota = np.round(quota, 6)
    counts: IntArray = np.floor(quota).astype(np.intp)
    by_remainder = np.argsort(counts - quota, kind="stable")
    counts[by_remainder[: n_elements - int(counts.sum())]] += 1
    return counts


def _gradual(division: Division, counts: IntArray, lengths: FloatArray) -> list[FloatArray]:
    """Return positions on each piece that lead gradually to the elements of denser neighbours."""
    sizes = lengths / counts
    following = division.following
    after = np.where(following >= 0, sizes[following], np.inf)  # none on a symmetry line
    before = np.full(counts.size, np.inf)
    before[following[following >= 0]] = sizes[following >= 0]
    ends = zip(counts.tolist(), (before / lengths).tolist(), (after / lengths).tolist(), strict=True)
    return [gradual_positions(*each) for each in ends]


def _checked_positions(grading: Grading, n: int) -> FloatArray:
    """Return the positions of a grading, which may be the user's own, or say what is wrong with them."""
    positions = np.asarray(grading.positions(n), dtype=float)
    is_right = positions.shape == (n + 1,) and positions[0] == 0.0 and positions[-1] == 1.0
    if not (is_right and (np.diff(positions) > 0.0).all()):
        raise GeometryError(
            f"discretise: {grading} does not place {n} elements on a piece: its positions({n}) must increase strictly "
            f"from 0 to 1 and have shape ({n + 1},); grade less, or use fewer elements"
        )
    return positions


def _check_density(density: Mapping[str, float], outline: Outline) -> None:
    for side, value in density.items():
        if side not in outline.selectable_names:
            raise GeometryError(
                f"discretise: density names the side {side!r}: the sides are {', '.join(outline.selectable_names)}"
            )
        if not 0.0 < value < np.inf:
            raise GeometryError(f"discretise: the density of side {side!r} is {value}: give a positive, finite number")


def _share_of_half(n_elements: int, half: Division, symmetry: Symmetry) -> int:
    share, n_pieces = -(-n_elements // symmetry.n_images), len(half.pieces)
    if share < n_pieces:
        raise GeometryError(
            f"discretise: n_elements is {n_elements}: symmetry leaves {share} elements for {n_pieces} pieces of "
            f"the boundary (parts divide sides): give at least {n_pieces * symmetry.n_images}"
        )
    return share


def _check_sides_divided(density: Mapping[str, float], half: Division) -> None:
    sides = [half.outline.sides[piece.side] for piece in half.pieces]
    divided = {name for side in sides for name in (side.name, side.group) if name}
    for side in density:
        if side not in divided:
            raise GeometryError(
                f"discretise: density names the side {side!r}, which lies beyond the symmetry lines ({half.symmetry}) "
                f"and mirrors what is divided: name its image among the sides {', '.join(sorted(divided))}"
            )


def gradual_positions(n: int, before: float, after: float) -> FloatArray:
    """Return where `n` elements begin and end along a piece between neighbours that may be divided more densely.

    Parameters
    ----------
    n : int
        Number of elements, at least one.
    before, after : float
        Lengths of the elements next to the piece, in units of its own length; infinite if there are none.

    Returns
    -------
    (n + 1,) array
        Fractions of the length of the piece, increasing from 0 to 1; uniform where the neighbours are alike.

    Notes
    -----
    At the distances s and 1 - s from its ends the elements have the length ``min(H, a + g s, b + g (1 - s))``, where a
    and b are those of the neighbours: with constant tractions, twice that length at a roller costs the pressure there
    an order.
    """
    own = (1.0 - TIE) / n
    if n == 1 or min(before, after) >= own / ALIKE:
        return np.arange(n + 1) / n
    start, end = (length if length < own else LARGEST_STRETCH / n for length in (before, after))
    growth = GROWTH
    while _count(LARGEST_STRETCH / n, start, end, growth) > n:
        growth *= 1.5
    shortest, longest = 1.0 / n, LARGEST_STRETCH / n
    for _ in range(60):  # bisection to round-off
        middle = 0.5 * (shortest + longest)
        shortest, longest = (middle, longest) if _count(middle, start, end, growth) > n else (shortest, middle)
    # the number of elements up to a place is the integral of 1 / length, by sums that crowd where lengths are short
    even = np.linspace(0.0, 1.0, 64 * n + 1)
    near_start, near_end = (size * np.expm1(even * math.log1p(1.0 / size)) for size in (start, end))
    s = np.unique(np.clip(np.concatenate([even, near_start, 1.0 - near_end]), 0.0, 1.0))
    density = 1.0 / np.minimum(longest, np.minimum(start + growth * s, end + growth * (1.0 - s)))
    count = np.concatenate([[0.0], np.cumsum(0.5 * np.diff(s) * (density[1:] + density[:-1]))])
    return np.asarray(np.interp(np.arange(n + 1) / n, count / count[-1], s))


def _count(longest: float, start: float, end: float, growth: float) -> float:
    """Return the number of elements if the longest have a given length."""
    start, end = min(start, longest), min(end, longest)
    level = 1.0 - (2.0 * longest - start - end) / growth
    if level < 0.0:
        peak = 0.5 * (start + end + growth)
        return math.log(peak * peak / (start * end)) / growth
    return math.log(longest * longest / (start * end)) / growth + level / longest
