"""An outline cut into pieces, each in one boundary part or in none, ready to be divided into elements."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import GeometryError, format_point
from bemkit.geometry.loops import following_in_loops
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import N_SAMPLES, Outline, Selection, Side, breakpoints, merge_breakpoints
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import norms

if TYPE_CHECKING:
    from bemkit.geometry.symmetry.lines import Symmetry

_INNER = np.array([0.25, 0.5, 0.75])
_N_PANELS, _N_POINTS = 64, 6
"""Intervals and points of integrals: twelve digits for arcs, and for splines, which have a bounded third derivative."""


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
    symmetry : Symmetry, optional
        Lines beyond which there are no pieces.
    """

    outline: Outline
    pieces: tuple[Piece, ...]
    part_names: tuple[str, ...]
    symmetry: Symmetry | None = None

    def cut(self, cuts: Mapping[int, Sequence[float]]) -> Division:
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

    def half(self, symmetry: Symmetry) -> Division:
        """Return the pieces on the side x <= a, y <= b of symmetry lines.

        Raises
        ------
        GeometryError
            If the body is an exterior, or a line does not cross it or runs along a side.
        """
        if self.outline.is_exterior:
            raise GeometryError(f"symmetry ({symmetry}): the body is an exterior: remove the symmetry")
        pieces = self.cut(_crossings(self.outline, symmetry)).pieces
        points = np.array([self.outline.sides[piece.side].curve.point(piece.at(_INNER)) for piece in pieces])
        _check_lines(self.outline, symmetry, pieces, points)
        is_kept = ~symmetry.is_beyond(points[:, 1])
        kept = [piece for piece, keep in zip(pieces, is_kept.tolist(), strict=True) if keep]
        return replace(self, pieces=tuple(kept), symmetry=symmetry)

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
            Elements run along each loop in order, node i starts element i; the nodes that start none come last.
        """
        outline = self.outline
        # the node at the start of each element, piece by piece, and the side and part of the element
        along = list(zip(self.pieces, parameters, strict=True))
        nodes = [outline.sides[piece.side].curve.point(s[:-1]) for piece, s in along]
        counts = [len(points) for points in nodes]
        side = np.repeat([piece.side for piece in self.pieces], counts)
        part = np.repeat([piece.part or "" for piece in self.pieces], counts)
        # an element ends where the next one starts; without a next one, on a symmetry line or at the end of a
        # half-plane, at a node of its own
        ends = self.following_elements(counts)
        ends[ends < 0] = ends.size + np.arange(np.count_nonzero(ends < 0))
        nodes += [
            outline.sides[piece.side].curve.point(s[-1:])
            for (piece, s), k in zip(along, self.following.tolist(), strict=True)
            if k < 0
        ]
        # curves are numbered without the straight sides
        is_curved = np.array([not side.curve.is_straight for side in outline.sides])
        return BoundaryMesh(
            np.concatenate(nodes),
            np.column_stack([np.arange(ends.size), ends]),
            {name: np.flatnonzero(part == name) for name in self.part_names},
            tuple(side.curve for side in outline.sides if not side.curve.is_straight),
            np.where(is_curved, np.cumsum(is_curved) - 1, -1)[side] if is_curved.any() else None,
            np.concatenate([np.column_stack([s[:-1], s[1:]]) for s in parameters]) if is_curved.any() else None,
            outline.is_exterior,
            self.symmetry,
            outline.surface,
            follows_outline=True,
        )

    def following_elements(self, counts: Sequence[int]) -> IntArray:
        """Return the next element (n_elements,) along the loop, -1 where there is none, by numbers for each piece."""
        after, following = np.cumsum(counts), self.following
        elements = np.arange(1, after[-1] + 1)
        elements[after - 1] = np.where(following < 0, -1, (after - counts)[following])
        return elements

    @property
    def following(self) -> IntArray:
        """(n_pieces,) array: the piece that starts where each one ends; -1 on a symmetry line or at an end."""
        next_side = following_in_loops(np.array([len(sides) for sides in self.outline.loops]))
        starting = {(piece.side, piece.span[0]): k for k, piece in enumerate(self.pieces)}
        places = [
            (int(next_side[piece.side]), 0.0) if piece.span[1] == 1.0 else (piece.side, piece.span[1])
            for piece in self.pieces
        ]
        following = np.array([starting.get(place, -1) for place in places], dtype=np.intp)
        if self.outline.surface is not None:
            following[-1] = -1
        return following


def _crossings(outline: Outline, symmetry: Symmetry) -> dict[int, list[float]]:
    """Return where sides cross symmetry lines: parameters by the number of the side."""
    cuts: dict[int, list[float]] = {}
    for number, side in enumerate(outline.sides):
        for line in symmetry.lines:
            cuts.setdefault(number, []).extend(breakpoints(side.curve, line.is_beyond_at).tolist())
    return cuts


def _check_lines(outline: Outline, symmetry: Symmetry, pieces: Sequence[Piece], points: FloatArray) -> None:
    """Raise if a line runs along a side or misses the body; `points` (n_pieces, n, 2) lie on the pieces."""
    for line in symmetry.lines:
        on_line = line.meets(points.reshape(-1, 2)).any(axis=1).reshape(len(pieces), -1).all(axis=1)
        for k in np.flatnonzero(on_line).tolist():
            raise GeometryError(
                f"symmetry: side {outline.side_names[pieces[k].side]!r} lies on the line {line}: describe the whole "
                "body, or remove the symmetry and give the side a roller"
            )
        is_beyond = line.is_beyond(points[:, 1])
        if is_beyond.all() or not is_beyond.any():
            corners = np.concatenate(outline.corners)
            low, high = (format_point(corner) for corner in (corners.min(axis=0), corners.max(axis=0)))
            raise GeometryError(
                f"symmetry: the line {line} does not cross the body, whose corners lie between {low} and {high}: "
                "give the middle of the body"
            )


def divide(outline: Outline, parts: Mapping[str, Selection]) -> Division:
    """Cut an outline where its sides and its parts end.

    Parameters
    ----------
    outline : Outline
    parts : mapping of str to Selection
        Boundary parts by name; they must not overlap, and need not cover the boundary.

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


def quadrature(outline: Outline, name: str, selection: Selection) -> tuple[FloatArray, FloatArray]:
    """Return points (n, 2) [m] and weights (n,) [m] that integrate over a part along the outline.

    Raises
    ------
    GeometryError
        If the part is empty or names an unknown side.
    """
    xi, weights = gauss_legendre(_N_POINTS)
    points, lengths = [], []
    for piece in divide(outline, {name: selection}).pieces:
        if piece.part == name:
            ends = np.linspace(*piece.span, _N_PANELS + 1)
            half = 0.5 * np.diff(ends)[:, None]
            s = (0.5 * (ends[1:] + ends[:-1])[:, None] + half * xi).ravel()
            curve = outline.sides[piece.side].curve
            points.append(curve.point(s))
            lengths.append((half * weights).ravel() * norms(curve.derivative(s)))
    return np.concatenate(points), np.concatenate(lengths)


def _cut(number: int, side: Side, parts: Mapping[str, Selection]) -> list[Piece]:
    """Cut a side where parts end."""
    predicates = [
        selection.where
        for selection in parts.values()
        if selection.where is not None and selection.names(side.name, side.group)
    ]
    cuts = merge_breakpoints(np.concatenate([np.zeros(0), *(breakpoints(side.curve, where) for where in predicates)]))
    ends = np.concatenate([[0.0], cuts, [1.0]])
    middles = side.curve.point(0.5 * (ends[:-1] + ends[1:]))
    names: list[str | None] = [None] * len(middles)
    for name, selection in parts.items():
        for k in np.flatnonzero(selection.holds(side.name, middles, side.group)):
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
            if side not in outline.selectable_names:
                raise GeometryError(
                    f"discretise: part {name!r} names the side {side!r}: the sides are "
                    f"{', '.join(repr(known) for known in outline.selectable_names)}"
                )


def _empty_part_message(name: str, selection: Selection, outline: Outline) -> str:
    sides = ", ".join(repr(side) for side in selection.sides or outline.side_names)
    return (
        f"discretise: part {name!r} is empty: its predicate holds at none of {N_SAMPLES} points along each of "
        f"the sides {sides}; widen it or name other sides"
    )
