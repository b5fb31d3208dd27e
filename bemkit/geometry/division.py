"""An outline cut into pieces, each in one boundary part or in none, ready to be divided into elements."""

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.errors import GeometryError, format_point
from bemkit.geometry.loops import following_in_loops
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.selection import N_SAMPLES, Selection, breakpoints, merge_breakpoints
from bemkit.geometry.vectors import norms


@dataclass(frozen=True)
class Piece:
    """A piece of a side, from one parameter to another, that lies in one part or in none.

    Parameters
    ----------
    side : int
        Number of the side in `Outline.sides`.
    span : (float, float)
        Parameters on its curve.
    part : str or None
    """

    side: int
    span: tuple[float, float]
    part: str | None

    def at(self, positions: FloatArray) -> FloatArray:
        """Return the parameters at fractions of the span."""
        return np.asarray(self.span[0] * (1.0 - positions) + self.span[1] * positions)


@dataclass(frozen=True)
class Division:
    """The pieces of an outline, in order along its loops.

    Parameters
    ----------
    outline : Outline
    pieces : tuple of Piece
    part_names : tuple of str
    """

    outline: Outline
    pieces: tuple[Piece, ...]
    part_names: tuple[str, ...]

    def cut(self, cuts: Mapping[int, Sequence[float]]) -> "Division":
        """Return the division with further cuts.

        Parameters
        ----------
        cuts : mapping of int to sequence of float
            Parameters at which pieces shall end, by the number of the side; those at ends of pieces change nothing.
        """
        pieces = []
        for piece in self.pieces:
            start, end = piece.span
            inner = merge_breakpoints((np.array(cuts.get(piece.side, ()), dtype=float) - start) / (end - start))
            ends = [start, *(start + inner * (end - start)).tolist(), end]
            pieces += [replace(piece, span=span) for span in itertools.pairwise(ends)]
        return replace(self, pieces=tuple(pieces))

    @property
    def piece_lengths(self) -> FloatArray:
        """(n_pieces,) array [m]: lengths of the pieces, to a few digits."""
        middles = np.linspace(0.5, 31.5, 32) / 32.0
        return np.array(
            [
                np.diff(piece.span)[0]
                * norms(self.outline.sides[piece.side].curve.derivative(piece.at(middles))).mean()
                for piece in self.pieces
            ]
        )

    def mesh(self, parameters: Sequence[FloatArray]) -> BoundaryMesh:
        """Return the mesh whose elements lie between consecutive parameters of each piece.

        Parameters
        ----------
        parameters : sequence of arrays
            For each piece, increasing from the start to the end of its span.

        Returns
        -------
        BoundaryMesh
            Elements run along each loop in order, node i starts element i.
        """
        outline = self.outline
        along = list(zip(self.pieces, parameters, strict=True))
        nodes = [outline.sides[piece.side].curve.point(s[:-1]) for piece, s in along]
        counts = [len(points) for points in nodes]
        side = np.repeat([piece.side for piece in self.pieces], counts)
        part = np.repeat([piece.part or "" for piece in self.pieces], counts)
        loop = np.repeat(np.arange(len(outline.loops)), [len(sides) for sides in outline.loops])[side]
        is_curved = np.array([not side.curve.is_straight for side in outline.sides])
        return BoundaryMesh(
            np.concatenate(nodes),
            np.column_stack([np.arange(len(loop)), following_in_loops(np.bincount(loop))]),
            {name: np.flatnonzero(part == name) for name in self.part_names},
            tuple(side.curve for side in outline.sides if not side.curve.is_straight),
            np.where(is_curved, np.cumsum(is_curved) - 1, -1)[side] if is_curved.any() else None,
            np.concatenate([np.column_stack([s[:-1], s[1:]]) for s in parameters]) if is_curved.any() else None,
            outline.is_exterior,
        )


def divide(outline: Outline, parts: Mapping[str, Selection]) -> Division:
    """Cut an outline where its sides and its parts end.

    Parameters
    ----------
    outline : Outline
    parts : mapping of str to Selection
        Boundary parts by name; they must not overlap, and need not cover the boundary.

    Returns
    -------
    Division

    Raises
    ------
    GeometryError
        If a part is empty, overlaps another or names an unknown side.
    """
    _check_sides(outline, parts)
    pieces = [piece for number, side in enumerate(outline.sides) for piece in _cut(number, side, parts)]
    for name, selection in parts.items():
        if not any(piece.part == name for piece in pieces):
            raise GeometryError(_empty_part_message(name, selection, outline))
    return Division(outline, tuple(pieces), tuple(parts))


def _cut(number: int, side: Side, parts: Mapping[str, Selection]) -> list[Piece]:
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
    return [Piece(number, span, name) for span, name in zip(spans, names, strict=True)]


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
