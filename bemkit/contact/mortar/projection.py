"""Projection from one side onto the other along given directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.vectors import angles_between, cross, norms, turned_left

_MOST_STEPS = 100
_MOST_PASSES = 8
"""Passes of `mean_directions`: the first projects along normals, the others along the mean directions of the last."""
_SETTLED = 1e-13
"""Change of directions [rad] from one pass to the next below which there is no further pass."""


def bracketed_roots(function: Callable[[FloatArray], FloatArray], n_roots: int, tolerance: float) -> FloatArray:
    """Return where functions of [-1, 1] vanish, by the Illinois variant of regula falsi.

    Parameters
    ----------
    function : callable
        (n_roots,) arguments, one of each function -> (n_roots,) values.
    n_roots : int
    tolerance : float
        Values of this size are zero.

    Returns
    -------
    (n_roots,) array
        In [-1, 1]; the nearest end where a function does not change sign.
    """
    a, b = np.full(n_roots, -1.0), np.full(n_roots, 1.0)
    f_a, f_b = function(a), function(b)
    # without a change of sign both ends of the bracket become the nearer one
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
    """Find the points of a side that lie ahead of, or behind, other points.

    Parameters
    ----------
    points, directions : (n, 2) arrays [m], [-]
        Directions are unit vectors out of the body of the points; the side has to run against them.
    side : ContactSide
    reach : float [m]
        Largest distance along the direction.
    slack : float [m]
        How far points that meet no element may lie beside the nearest one.

    Returns
    -------
    rows : (n,) int array
        Position in the side of the nearest element that is met, -1 if there is none.
    xi : (n,) array
        Where it is met.
    """
    to_start, to_end = side.start - points[:, None], side.end - points[:, None]
    # along the tangent, against which a side that faces the direction runs
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
    """Return where (n,) the lines through points (n, 2) along directions (n, 2) meet elements `rows` (n,) of a side."""
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
        The normal of the non-mortar side, turned by half of the angle to the reversed normal of the mortar side where
        it is met. Knots that meet nothing turn like the nearest ones that do.

    Notes
    -----
    With the normals of only one side, two equal cylinders that are pressed together seem to slide by as much as the
    cube of the distance from their common point, which friction resists; the mean is the same from both sides.
    """
    if non_mortar.flat_normal is not None and mortar.flat_normal is not None:
        mean = non_mortar.flat_normal - mortar.flat_normal
        faces = non_mortar.flat_normal @ mortar.flat_normal < 0.0
        return np.tile(mean / norms(mean), (len(non_mortar.normals), 1)) if faces else non_mortar.normals
    rows, local = non_mortar.first_knots
    points = non_mortar.points(rows, non_mortar.knots)[np.arange(rows.size), local]
    normals = directions = non_mortar.normals
    # the end of a side is met from its end, however the first directions deviate by a small angle
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
