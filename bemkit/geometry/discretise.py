"""From an outline to a mesh: the user's parts, the user's number of elements."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.curve import Curve
from bemkit.geometry.errors import GeometryError, format_point
from bemkit.geometry.grading import Grading, Uniform
from bemkit.geometry.loops import following_in_loops
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.selection import N_SAMPLES, Selection, breakpoints, merge_breakpoints
from bemkit.geometry.vectors import norms

_N_PANELS = 256
_N_PANEL_POINTS = 4
_SPEED_TOLERANCE = 1e-12  # a speed that varies by less is constant up to round-off


@dataclass(frozen=True)
class _Piece:
    """A piece of a side, from one parameter to another, that lies in one part or in none."""

    side: int
    span: tuple[float, float]
    part: str | None


def discretise(
    outline: Outline,
    *,
    n_elements: int,
    parts: Mapping[str, Selection] | None = None,
    grading: Grading | None = None,
    density: Mapping[str, float] | None = None,
) -> BoundaryMesh:
    """Cut an outline into elements.

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
        Spacing of the elements on every piece; uniform if left out.
    density : mapping of str to float, optional
        How densely sides are divided compared with the others, by the name of the side; 1 where left out.

    Returns
    -------
    BoundaryMesh
        Elements run along each loop in order, node i starts element i; parts end exactly at nodes.

    Raises
    ------
    GeometryError
        If a part is empty, overlaps another or names an unknown side, or there are fewer elements than pieces, or a
        density is not positive or names an unknown side.
    """
    density = {} if density is None else density
    _check_density(density, outline)
    parts = {} if parts is None else parts
    grading = Uniform() if grading is None else grading
    _check_sides(outline, parts)
    pieces = [piece for number, side in enumerate(outline.sides) for piece in _cut(number, side, parts)]
    for name, selection in parts.items():
        if not any(piece.part == name for piece in pieces):
            raise GeometryError(_empty_part_message(name, selection, outline))
    rulers = [_Ruler(side.curve) for side in outline.sides]
    weights = [
        density.get(outline.side_names[piece.side], 1.0) * rulers[piece.side].length(*piece.span) for piece in pieces
    ]
    counts = share_elements(n_elements, np.array(weights))
    positions = [_checked_positions(grading, int(count)) for count in counts]
    parameters = [rulers[piece.side].parameters(piece.span, p) for piece, p in zip(pieces, positions, strict=True)]
    return _join(outline, pieces, parameters, tuple(parts))


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
    quota = np.round(quota, 9)  # halves that differ by round-off are ties, settled by the order of pieces
    counts: IntArray = np.floor(quota).astype(np.intp)
    by_remainder = np.argsort(counts - quota, kind="stable")
    counts[by_remainder[: n_elements - int(counts.sum())]] += 1
    return counts


class _Ruler:
    """Measures a curve: parameter <-> arc length."""

    def __init__(self, curve: Curve) -> None:
        self._ends = np.linspace(0.0, 1.0, _N_PANELS + 1)
        xi, weights = gauss_legendre(_N_PANEL_POINTS)
        s = self._ends[:-1, None] + 0.5 / _N_PANELS * (1.0 + xi)
        speed = norms(curve.derivative(s.ravel()))
        self._arc_length = np.concatenate([[0.0], np.cumsum(0.5 / _N_PANELS * (speed.reshape(s.shape) @ weights))])
        self._is_even = bool(np.ptp(speed) <= _SPEED_TOLERANCE * speed.max())

    def length(self, start: float, end: float) -> float:
        """Return the arc length between two parameters."""
        return float(np.diff(np.interp([start, end], self._ends, self._arc_length))[0])

    def parameters(self, span: tuple[float, float], positions: FloatArray) -> FloatArray:
        """Return the parameters at fractions of the arc length of a span."""
        if not self._is_even:
            whole = np.interp(span, self._ends, self._arc_length)
            lengths = whole[0] * (1.0 - positions) + whole[1] * positions
            s: FloatArray = np.interp(lengths, self._arc_length, self._ends)
            return s
        return np.asarray(span[0] * (1.0 - positions) + span[1] * positions)


def _cut(number: int, side: Side, parts: Mapping[str, Selection]) -> list[_Piece]:
    """Cut a side where parts end."""
    predicates = [
        selection.where
        for selection in parts.values()
        if selection.where is not None and (not selection.sides or side.name in selection.sides)
    ]
    cuts = merge_breakpoints(np.concatenate([np.zeros(0), *(breakpoints(side.curve, where) for where in predicates)]))
    ends = np.concatenate([[0.0], cuts, [1.0]])
    middles = side.curve.point(0.5 * (ends[:-1] + ends[1:]))
    names: list[str | None] = [None] * len(middles)
    for name, selection in parts.items():
        for k in np.flatnonzero(selection.holds(side.name, middles)):
            if names[k] is not None:
                raise GeometryError(
                    f"discretise: parts {names[k]!r} and {name!r} overlap on side {side.name!r}, at "
                    f"{format_point(middles[k])}: restrict one of them"
                )
            names[k] = name
    spans = zip(ends[:-1].tolist(), ends[1:].tolist(), strict=True)
    return [_Piece(number, span, name) for span, name in zip(spans, names, strict=True)]


def _join(
    outline: Outline, pieces: list[_Piece], parameters: list[FloatArray], part_names: tuple[str, ...]
) -> BoundaryMesh:
    """Make the mesh whose elements lie between consecutive parameters of each piece."""
    nodes = [outline.sides[piece.side].curve.point(s[:-1]) for piece, s in zip(pieces, parameters, strict=True)]
    counts = [len(points) for points in nodes]
    side = np.repeat([piece.side for piece in pieces], counts)
    part = np.repeat([piece.part or "" for piece in pieces], counts)
    loop = np.repeat(np.arange(len(outline.loops)), [len(sides) for sides in outline.loops])[side]
    is_curved = np.array([not side.curve.is_straight for side in outline.sides])
    return BoundaryMesh(
        np.concatenate(nodes),
        np.column_stack([np.arange(len(loop)), following_in_loops(np.bincount(loop))]),
        {name: np.flatnonzero(part == name) for name in part_names},
        tuple(side.curve for side in outline.sides if not side.curve.is_straight),
        np.where(is_curved, np.cumsum(is_curved) - 1, -1)[side] if is_curved.any() else None,
        np.concatenate([np.column_stack([s[:-1], s[1:]]) for s in parameters]) if is_curved.any() else None,
        outline.is_exterior,
    )


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
        if side not in outline.side_names:
            raise GeometryError(
                f"discretise: density names the side {side!r}: the sides are {', '.join(outline.side_names)}"
            )
        if not 0.0 < value < np.inf:
            raise GeometryError(f"discretise: the density of side {side!r} is {value}: give a positive, finite number")


def _check_sides(outline: Outline, parts: Mapping[str, Selection]) -> None:
    for name, selection in parts.items():
        for side in selection.sides:
            if side not in outline.side_names:
                raise GeometryError(
                    f"discretise: part {name!r} names the side {side!r}: the sides are "
                    f"{', '.join(repr(known) for known in outline.side_names)}"
                )


def _empty_part_message(name: str, selection: Selection, outline: Outline) -> str:
    sides = ", ".join(repr(side) for side in selection.sides or outline.side_names)
    return (
        f"discretise: part {name!r} is empty: its predicate holds at none of {N_SAMPLES} points along each of "
        f"the sides {sides}; widen it or name other sides"
    )
