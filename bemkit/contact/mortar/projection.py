"""Projection from one side onto the other along given directions."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.vectors import angles_between, cross, norms, turned_left

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

_MOST_STEPS = 100
_MOST_PASSES = 8
"""Largest number of passes of `mean_directions`; the first projects along normals, others along mean directions."""
_SETTLED = 1e-13
"""Change of directions [rad] in a pass below which the iteration ends."""


def bracketed_roots(function: Callable[[FloatArray], FloatArray], n_roots: int, tolerance: float) -> FloatArray:
    """Return roots of functions in [-1, 1] by the Illinois variant of regula falsi.

    Parameters
    ----------
    function : callable
        (n_roots,) arguments, one for each function -> (n_roots,) values.
    n_roots : int
    tolerance : float
        Largest value that counts as zero.

    Returns
    -------
    (n_roots,) array
        Roots in [-1, 1]; the nearest end if a function does not change sign.
    """
    a, b = np.full(n_roots, -1.0), np.full(n_roots, 1.0)
    f_a, f_b = function(a), function(b)
    # without a change of sign the bracket shrinks to the nearer end
    has_no_root = f_a * f_b > 0.0
    nearer, f_nearer = np.where(np.abs(f_a) < np.abs(f_b), (a, f_a), (b, f_b))
    a, b = np.where(has_no_root, nearer, a), np.where(has_no_root, nearer, b)
    f_a, f_b = np.where(has_no_root, f_nearer, f_a), np.where(has_no_root, f_nearer, f_b)
    for _ in range(_MOST_STEPS):
        slope = f_b - f_a
        c = np.clip(b - f_b * (b - a) / np.where(slope == 0.0, 1.0, slope), -1.0, 1.0)
        f_c = function(c)
        changes = f_c * f_b < 0.0
        a, f_a = np.where(changes, b, a), np.where(changes, f_b, 0.5 * f_a)
        b, f_b = c, f_c
        if np.all((np.abs(f_c) <= tolerance) | (np.abs(b - a) <= np.finfo(float).eps)):
            break
    return b


def project(
    points: FloatArray, directions: FloatArray, side: ContactSide, reach: float, slack: float = 0.0
) -> tuple[IntArray, FloatArray]:
    """Project points onto a side, ahead or behind.

    Parameters
    ----------
    points, directions : (n, 2) arrays [m], [-]
        Directions are unit vectors out of the body of the points, against which the side must face.
    side : ContactSide
    reach : float [m]
        Largest distance along the direction.
    slack : float [m]
        Largest distance from the nearest element of points that meet no element.

    Returns
    -------
    rows : (n,) int array
        Position in the side of the nearest element on the line, -1 if there is none.
    xi : (n,) array
        Local coordinate of the projection.
    """
    to_start, to_end = side.start - points[:, None], side.end - points[:, None]
    # positions along the tangent; a facing side runs against it
    start, end = cross(directions[:, None], to_start), cross(directions[:, None], to_end)
    beside = np.where(end < start, np.maximum(np.maximum(-start, end), 0.0), np.inf)
    share = np.clip(start / np.where(end < start, start - end, 1.0), 0.0, 1.0)
    ahead, ahead_at_end = ((directions[:, None] * to).sum(axis=-1) for to in (to_start, to_end))
    distance = np.abs((1.0 - share) * ahead + share * ahead_at_end)
    is_near = distance <= reach
    rows, all_points = np.argmin(np.where(is_near & (beside == 0.0), distance, np.inf), axis=1), np.arange(len(points))
    missed = np.flatnonzero(~is_near[all_points, rows] | (beside[all_points, rows] > 0.0))
    beside = np.where(is_near, beside, np.inf)[missed]
    rows[missed] = np.where(beside.min(axis=1) <= slack, np.argmin(beside, axis=1), -1)
    hits = np.flatnonzero(rows >= 0)
    xi = np.zeros(len(points))
    xi[hits] = meeting_points(points[hits], directions[hits], side, rows[hits])
    return rows, xi


def meeting_points(points: FloatArray, directions: FloatArray, side: ContactSide, rows: IntArray) -> FloatArray:
    """Return local coordinates (n,) of the intersections of lines with elements `rows` (n,) of a side."""
    if side.is_straight:
        start = cross(directions, side.start[rows] - points)
        end = cross(directions, side.end[rows] - points)
        return np.clip((start + end) / np.where(start == end, 1.0, start - end), -1.0, 1.0)
    elements = side.elements[rows]

    def beside(xi: FloatArray) -> FloatArray:
        return cross(directions, side.mesh.points(elements, xi[:, None])[:, 0] - points)

    return bracketed_roots(beside, rows.size, 0.1 * side.resolution)


def mean_directions(non_mortar: ContactSide, mortar: ContactSide, reach: float) -> FloatArray:
    """Return the mean of the normals of both sides at the knots of the first, towards the second one.

    Returns
    -------
    (n_knots, 2) array
        The normal of the non-mortar side, rotated by half of the angle to the reversed normal of the mortar side at the
        projection. Knots without a projection are rotated like the nearest knots with one.

    Notes
    -----
    With the normals of one side only, two equal cylinders pressed together would have a slip of third order in the
    distance from their common point, which friction resists. The mean is the same for both sides.
    """
    if non_mortar.flat_normal is not None and mortar.flat_normal is not None:
        mean = non_mortar.flat_normal - mortar.flat_normal
        faces = non_mortar.flat_normal @ mortar.flat_normal < 0.0
        return np.tile(mean / norms(mean), (len(non_mortar.normals), 1)) if faces else non_mortar.normals
    rows, local = non_mortar.first_knots
    points = non_mortar.points(rows, non_mortar.knots)[np.arange(rows.size), local]
    normals = directions = non_mortar.normals
    # slack: the end of a side is projected onto the end of the other one, although directions deviate slightly
    slack = float(max(non_mortar.lengths.mean(), mortar.lengths.mean()))
    knots, half_angle = np.arange(rows.size), np.zeros(rows.size)
    for _ in range(_MOST_PASSES):
        partner, eta = project(points, directions, mortar, reach, slack)
        hits = np.flatnonzero(partner >= 0)
        if not hits.size:
            break
        opposite = -mortar.smooth_normals(partner[hits], eta[hits])
        before, half_angle = half_angle, np.interp(knots, hits, 0.5 * angles_between(normals[hits], opposite))
        if np.abs(half_angle - before).max() <= _SETTLED:
            break
        cosine, sine = np.cos(half_angle)[:, None], np.sin(half_angle)[:, None]
        directions = cosine * normals + sine * turned_left(normals)
    return directions


def rays(positions: FloatArray, direction: FloatArray) -> FloatArray:
    """Return unit vectors (n, 2) along positions (n, 2) from a centre, in the sense of directions (n, 2)."""
    along = np.copysign(1.0, np.einsum("nc,nc->n", positions, direction))
    return np.asarray(positions * (along / norms(positions))[:, None])


def on_rays(shares: csr_matrix, unit: FloatArray, points: FloatArray, resolution: float) -> csr_matrix:
    """Move the mean positions of points along their side onto rays from the origin.

    Parameters
    ----------
    shares : (n, k) sparse matrix
        Of points in each mean position; rows sum to one.
    unit : (n, 2) array
        Directions of the rays.
    points : (k, 2) array [m]
    resolution : float [m]
        Round-off of positions.

    Returns
    -------
    (n, k) sparse matrix
        The nearest shares whose rows sum to one. Positions move by a distance of third order in the length of elements.
    """
    n_shares = np.diff(shares.indptr)
    row = np.repeat(np.arange(len(unit)), n_shares)
    beside = cross(unit[row], points[shares.indices])
    off_ray = np.bincount(row, shares.data * beside)
    beside -= (np.bincount(row, beside) / n_shares)[row]
    spread = np.bincount(row, beside**2)
    moved = shares.copy()
    moved.data -= (off_ray / np.where(spread > resolution**2, spread, np.inf))[row] * beside
    return moved
