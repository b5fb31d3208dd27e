"""Common refinement of two sides into pieces on which the functions of both are smooth, with quadrature."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.mortar.projection import bracketed_roots, meeting_points, project
from bemkit.contact.mortar.sides import ContactSide, faces_away
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import cross

_SLIVER = 1e-10
"""Smallest length of a piece in local coordinates; shorter ones are merged with their neighbours."""


@dataclass(frozen=True, eq=False)
class Segments:
    """Pieces of the elements of the non-mortar side, in order.

    Parameters
    ----------
    row : (s,) int array
        Position of the element in the non-mortar side.
    low, high : (s,) arrays
        Ends of the piece within [-1, 1].
    partner : (s,) int array
        Position in the mortar side of the facing element, -1 for none.
    """

    row: IntArray
    low: FloatArray
    high: FloatArray
    partner: IntArray

    @property
    def is_covered(self) -> BoolArray:
        """(s,) bool array: pieces that the mortar side faces."""
        return self.partner >= 0

    def covered(self) -> Segments:
        """Return the pieces that the mortar side faces."""
        chosen = self.is_covered
        return Segments(self.row[chosen], self.low[chosen], self.high[chosen], self.partner[chosen])

    def within(self, pieces: IntArray, low: FloatArray, high: FloatArray) -> Segments:
        """Return parts of pieces (m,) from low (m,) to high (m,), in coordinates from -1 to 1 on each piece."""
        middle, half = 0.5 * (self.high + self.low)[pieces], 0.5 * (self.high - self.low)[pieces]
        return Segments(self.row[pieces], middle + half * low, middle + half * high, self.partner[pieces])

    def cut(self, is_cut: BoolArray, at: FloatArray) -> Segments:
        """Return the pieces; those of marked elements (m,) are cut at the local coordinates `at` (k,)."""
        chosen = np.flatnonzero(is_cut[self.row])
        inside = (at > self.low[chosen, None]) & (at < self.high[chosen, None])
        piece, place = np.nonzero(inside)
        piece = chosen[piece]
        low = np.concatenate([self.low, at[place]])
        row = np.concatenate([self.row, self.row[piece]])
        order = np.lexsort((low, row))
        partner = np.concatenate([self.partner, self.partner[piece]])
        return Segments(row[order], low[order], _ends(row[order], low[order]), partner[order])


@dataclass(frozen=True, eq=False)
class MortarQuadrature:
    """Gauss points on covered pieces, and their projections on the mortar side.

    Parameters
    ----------
    row, partner : (s,) int arrays
        Positions of the elements in the non-mortar side (ascending) and the mortar side.
    xi, eta : (s, q) arrays
        Local coordinates on these elements.
    weights : (s, q) array [m]
        Weights along the non-mortar side.
    gap : (s, q, 2) array [m]
        Vectors from the non-mortar to the mortar side.
    """

    row: IntArray
    partner: IntArray
    xi: FloatArray
    eta: FloatArray
    weights: FloatArray
    gap: FloatArray


def common_refinement(non_mortar: ContactSide, mortar: ContactSide, directions: FloatArray, reach: float) -> Segments:
    """Cut the elements of the non-mortar side at the projections of the ends of mortar elements.

    Parameters
    ----------
    non_mortar, mortar : ContactSide
    directions : (n_knots, 2) array
        Directions of the projection at the knots of the non-mortar side.
    reach : float [m]
        Largest distance of the mortar side from the midpoint of a covered piece, ahead of it or, where the bodies
        overlap, behind it.
    """
    n_rows, all_rows = non_mortar.elements.size, np.arange(non_mortar.elements.size)
    resolution = max(non_mortar.resolution, mortar.resolution)
    ends = mortar.mesh.nodes[np.unique(mortar.mesh.elements[mortar.elements])]
    at_ends = non_mortar.directions(directions, all_rows, np.tile([-1.0, 1.0], (n_rows, 1)))
    start = cross(at_ends[:, 0], ends[:, None] - non_mortar.start)
    end = cross(at_ends[:, 1], ends[:, None] - non_mortar.end)
    # ends that lie between the start and the end of an element along the tangent project into it
    point, row = np.nonzero((start > 0.0) & (end < 0.0))
    elements = non_mortar.elements[row]

    def beside(xi: FloatArray) -> FloatArray:
        along = non_mortar.directions(directions, row, xi[:, None])[:, 0]
        return cross(along, ends[point] - non_mortar.mesh.points(elements, xi[:, None])[:, 0])

    cuts = bracketed_roots(beside, row.size, 0.1 * resolution) if row.size else np.zeros(0)
    tolerance = np.maximum(2.0 * resolution / non_mortar.lengths, _SLIVER)
    is_inside = 1.0 - np.abs(cuts) > tolerance[row]
    row = np.concatenate([all_rows, row[is_inside]])
    low = np.concatenate([np.full(n_rows, -1.0), cuts[is_inside]])
    order = np.lexsort((low, row))
    row, low = row[order], low[order]
    is_new = np.concatenate([[True], (np.diff(row) > 0) | (np.diff(low) > tolerance[row[1:]])])
    row, low = row[is_new], low[is_new]
    high = _ends(row, low)
    middle = (0.5 * (low + high))[:, None]
    along = non_mortar.directions(directions, row, middle)[:, 0]
    points = non_mortar.points(row, middle)[:, 0]
    partner, eta = project(points, along, mortar, reach)
    to_partner = mortar.points(partner, eta[:, None])[:, 0] - points
    distance = np.where(partner < 0, 0.0, np.einsum("sc,sc->s", to_partner, along))
    slack = np.maximum(resolution, 2.0 * (non_mortar.sagittas[row] + mortar.sagittas[partner]))
    partner[faces_away(non_mortar.mesh, mortar.mesh, points + 0.5 * to_partner, distance, slack)] = -1
    return Segments(row, low, high, partner)


def quadrature_on(
    segments: Segments, non_mortar: ContactSide, mortar: ContactSide, directions: FloatArray
) -> MortarQuadrature:
    """Return Gauss points on the covered pieces.

    Notes
    -----
    On straight elements with uniform direction, products of functions of both sides are integrated exactly. Otherwise
    four more points resolve curves and directions.
    """
    is_plane = non_mortar.is_straight and mortar.is_straight and bool(np.all(directions == directions[0]))
    rule = gauss_legendre(max(non_mortar.space.degree, mortar.space.degree) + (2 if is_plane else 6))
    return facing_points(segments, non_mortar, mortar, directions, *rule)


def facing_points(
    segments: Segments,
    non_mortar: ContactSide,
    mortar: ContactSide,
    directions: FloatArray,
    reference: FloatArray,
    reference_weights: FloatArray,
) -> MortarQuadrature:
    """Return the points of covered pieces at reference coordinates (q,) in [-1, 1], and their projections."""
    chosen = np.flatnonzero(segments.is_covered)
    row, partner, low, high = (
        segments.row[chosen],
        segments.partner[chosen],
        segments.low[chosen],
        segments.high[chosen],
    )
    half = 0.5 * (high - low)[:, None]
    xi = 0.5 * (low + high)[:, None] + half * reference
    weights = half * reference_weights * non_mortar.mesh.jacobian(non_mortar.elements[row], xi)
    points, along = non_mortar.points(row, xi), non_mortar.directions(directions, row, xi)
    rows = np.repeat(partner, reference.size)
    eta = meeting_points(points.reshape(-1, 2), along.reshape(-1, 2), mortar, rows).reshape(xi.shape)
    return MortarQuadrature(row, partner, xi, eta, weights, mortar.points(partner, eta) - points)


def _ends(row: IntArray, low: FloatArray) -> FloatArray:
    """Return the ends of pieces that begin at `low`: the beginning of the next piece of the element, or 1."""
    high = np.ones(low.size)
    follows = row[1:] == row[:-1]
    high[:-1][follows] = low[1:][follows]
    return high
