"""Rigid obstacles in figures; those that move in their final position."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.obstacle import Obstacle, RigidCavity, RigidCircle, RigidHalfPlane, measure_contact
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.signed_distance import SignedDistance
from bemkit.contact.spline import RigidSpline
from bemkit.errors import InputError
from bemkit.formulas import evaluate_field
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import along_boundary
from bemkit.pictures.drawing import GREY, Axes
from bemkit.pictures.plane import set_frame
from bemkit.pictures.shown import DrawnScene
from bemkit.scene.conditions import Contact
from bemkit.scene.plane_motion import RigidBody

if TYPE_CHECKING:
    from matplotlib.patches import Patch

_EDGE, _HATCH = "#555555", "#B0B0B0"
_FILLED: dict[str, Any] = {"facecolor": "#EDEDED", "edgecolor": "#A8A8A8", "linewidth": 1.0, "zorder": 0}
_BEFORE: dict[str, Any] = {"fill": False, "edgecolor": GREY, "linewidth": 1.0, "linestyle": "--", "zorder": 0}
_POINTS_OF_CIRCLE, _POINTS_OF_SPAN, _POINTS_OF_GRID, _POINTS_OF_ELEMENT = 181, 12, 301, 5
_LEVEL, _RELIEF = 1e-9, 0.1
"""Horizontal part of a normal that is round-off, and height of a relief that is flat, relative to its length."""
_BAND = 0.04
"""Thickness of the hatched part of an obstacle along its surface, relative to the picture."""


def draw_obstacles(axes: Axes, shown: DrawnScene) -> None:
    """Draw the fixed obstacles of all contact parts, within the frame of the axes.

    One that is given by its gap is drawn where it faces the body: at the distance of the gap from each point.
    """
    frame = _frame(axes)
    for loops, is_whole in fixed_obstacles(shown, frame):
        if is_whole:
            _draw_hatched(axes, loops, frame, "obstacle")
        else:
            _draw(axes, loops, _FILLED | {"hatch": "//", "edgecolor": _HATCH, "linewidth": 0.0}, "obstacle")
            for band in loops:
                axes.plot(*band[: len(band) // 2].T, color=_EDGE, linewidth=1.0, zorder=0.5)
    set_frame(axes, frame, margin=0.0)


def fixed_obstacles(shown: DrawnScene, frame: FloatArray) -> Iterator[tuple[list[FloatArray], bool]]:
    """Yield the loops (n, 2) [m] that the obstacles of all contact parts fill, and whether they are their outlines.

    The outline of an obstacle of several parts is yielded once. Others are bands where they face a part.
    """
    drawn: list[object] = []
    for body in shown.bodies:
        for part, elements in body.parts:
            if not isinstance(part.condition, Contact):
                continue
            obstacle = part.condition.obstacle
            if loops := outline_of(obstacle, frame):
                if not any(obstacle is other for other in drawn):
                    drawn.append(obstacle)
                    yield _with_outside(loops, obstacle, frame), True
            elif bands := facing_bands(obstacle, body.mesh, elements, _BAND * shown.size):
                yield bands, False


def facing_bands(obstacle: Obstacle, mesh: BoundaryMesh, elements: IntArray, thickness: float) -> list[FloatArray]:
    """Return bands (2 n, 2) [m] along an obstacle where it faces some elements.

    The first half of each lies on the obstacle, at the gap from points of the elements along the direction of contact;
    the second half, traversed backwards, behind it. There are none where the gap is infinite.
    """
    elements = along_boundary(mesh, elements)
    xi = np.linspace(-1.0, 1.0, _POINTS_OF_ELEMENT)
    points = mesh.points(elements, xi).reshape(-1, 2)
    gap, directions = measure_contact(obstacle, points, mesh.normals_at(elements, xi).reshape(-1, 2))
    is_seen = np.isfinite(gap) & (np.abs(gap) < mesh.diameter)
    surface = points + np.where(is_seen, gap, 0.0)[:, None] * directions
    is_end = ~is_seen | np.append(np.hypot(*(points[1:] - points[:-1]).T) > mesh.lengths.max(), True)
    bands = []
    for run in np.split(np.arange(len(points)), np.flatnonzero(is_end) + 1):
        run = run[is_seen[run]]
        if run.size > 1:
            bands.append(np.concatenate([surface[run], (surface[run] + thickness * directions[run])[::-1]]))
    return bands


def relief_frame(shown: DrawnScene, factor: float) -> FloatArray | None:
    """Return the frame (2, 2) [m] of a horizontal surface whose relief is flat beside its length, None of others.

    It shows the surface, moved by a factor times its displacement, and what it faces, across the whole height: axes
    with equal scales would show lines.
    """
    (body, *others) = shown.bodies
    if others or shown.rigid or body.mesh.surface is None or abs(body.mesh.normals[0, 0]) > _LEVEL:
        return None
    surfaces = body.outlines(factor)
    for part, elements in body.parts:
        if isinstance(part.condition, Contact):
            bands = facing_bands(part.condition.obstacle, body.mesh, elements, 0.0)
            surfaces += [band[: len(band) // 2] for band in bands]
    heights = np.concatenate(surfaces)[:, 1]
    relief, length = float(np.ptp(heights)), float(np.ptp(shown.frame[0]))
    if not 0.0 < relief < _RELIEF * length:
        return None
    below, above = (0.6, 0.3) if body.mesh.normals[0, 1] > 0.0 else (0.3, 0.6)
    return np.array([shown.frame[0], [heights.min() - below * relief, heights.max() + above * relief]])


def draw_rigid_bodies(axes: Axes, shown: DrawnScene, factor: float) -> None:
    """Draw rigid bodies whose shape is known, before they move and after it, their motions times a factor.

    The frame grows to hold them, by half its size at most.
    """
    frame = _frame(axes)
    farthest = 0.5 * float(np.ptp(frame, axis=1).max())
    widest = np.stack([frame[:, 0] - farthest, frame[:, 1] + farthest], axis=1)
    for body, loops, moved in rigid_bodies(shown, factor, widest):
        _draw(axes, loops, _BEFORE, "")
        _draw_hatched(axes, _with_outside(moved, body.obstacle, widest), frame, "rigid body")
        if not _is_endless(body.obstacle):
            places = np.clip(np.concatenate([*loops, *moved]), widest[:, 0], widest[:, 1])
            frame = np.stack(
                [np.minimum(frame[:, 0], places.min(axis=0)), np.maximum(frame[:, 1], places.max(axis=0))], axis=1
            )
    set_frame(axes, frame, margin=0.0)


def rigid_bodies(
    shown: DrawnScene, factor: float, frame: FloatArray
) -> Iterator[tuple[RigidBody, list[FloatArray], list[FloatArray]]]:
    """Yield rigid bodies of known shape with their loops (n, 2) [m], and those moved by a factor times their motion."""
    for body, result in shown.rigid:
        if loops := outline_of(body.obstacle, frame):
            motion = factor * np.array([result.x, result.y, result.turn])
            yield body, loops, [loop + body.motions_at(loop) @ motion for loop in loops]


def outline_of(obstacle: object, frame: FloatArray) -> list[FloatArray]:
    """Return the closed loops (n, 2) [m] of an obstacle, as far as they are near a frame; none if they are not known.

    Parameters
    ----------
    obstacle : object
    frame : (2, 2) array [m]
        Least and largest x, least and largest y. Unbounded obstacles are cut far outside the frame.
    """
    reach = 4.0 * float(np.hypot(*np.ptp(frame, axis=1)))
    match obstacle:
        case RigidHalfPlane(point=point, normal=normal):
            inward = -np.array(normal) / np.hypot(*normal)
            along = np.array([-inward[1], inward[0]])
            centre = np.array(point) + ((frame.mean(axis=1) - np.array(point)) @ along) * along
            surface = np.array([centre - reach * along, centre + reach * along])
            return [np.concatenate([surface, surface[::-1] + reach * inward])]
        case RigidCircle(centre=centre, radius=radius) | RigidCavity(centre=centre, radius=radius):
            return [_circle(np.array(centre), radius, frame)]
        case RigidPolygon(vertices=vertices):
            return [np.array(vertices, dtype=float)]
        case RigidSpline(is_closed=True):
            return [obstacle.curve(_POINTS_OF_SPAN)]
        case RigidSpline():
            curve = obstacle.curve(_POINTS_OF_SPAN)
            first, last = curve[0] - curve[1], curve[-1] - curve[-2]
            begin = curve[0] + reach * first / np.hypot(*first)
            end = curve[-1] + reach * last / np.hypot(*last)
            chord = (end - begin) / np.hypot(*(end - begin))
            left = reach * np.array([-chord[1], chord[0]])
            return [np.concatenate([[begin], curve, [end], [end + left], [begin + left]])]
        case SignedDistance(distance=distance):
            return _where_negative(distance, frame)
    return []


def _circle(centre: FloatArray, radius: float, frame: FloatArray) -> FloatArray:
    """Return a circle (n, 2) [m], with more points where a small frame shows a part of it."""
    angle = np.linspace(0.0, 2.0 * np.pi, _POINTS_OF_CIRCLE)
    across, up = frame.mean(axis=1) - centre
    spread = float(np.hypot(*np.ptp(frame, axis=1))) / radius
    if spread < 1.0:
        near = np.arctan2(up, across) + np.linspace(-spread, spread, _POINTS_OF_CIRCLE)
        angle = np.unique(np.concatenate([angle, near % (2.0 * np.pi)]))
    return centre + radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def _where_negative(distance: Any, frame: FloatArray) -> list[FloatArray]:
    """Return the loops around where a function is negative in a frame; none if it is not defined all over it."""
    from contourpy import FillType, contour_generator

    x, y = (np.linspace(low, high, _POINTS_OF_GRID) for low, high in frame.tolist())
    points = np.stack(np.meshgrid(x, y), axis=2).reshape(-1, 2)
    try:
        values = evaluate_field(distance, points).reshape(y.size, x.size)
    except InputError:
        return []
    filled: Any = contour_generator(x, y, values, fill_type=FillType.OuterOffset).filled(-np.inf, 0.0)
    return [
        np.asarray(loop) for polygon, bounds in zip(*filled, strict=True) for loop in np.split(polygon, bounds[1:-1])
    ]


def _is_hollow(obstacle: object) -> bool:
    """Whether an obstacle fills the outside of its outline."""
    if isinstance(obstacle, RigidSpline) and obstacle.is_closed:
        return not _is_anticlockwise(obstacle.curve())
    return isinstance(obstacle, RigidCavity)


def _with_outside(loops: list[FloatArray], obstacle: object, frame: FloatArray) -> list[FloatArray]:
    """Return the loops of an obstacle, of one that fills their outside with a rectangle far beyond a frame.

    It runs against them, so that they are holes in it.
    """
    if not _is_hollow(obstacle):
        return loops
    reach = 4.0 * float(np.hypot(*np.ptp(frame, axis=1)))
    outside = frame.mean(axis=1) + reach * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return [*loops, outside[::-1] if _is_anticlockwise(loops[0]) else outside]


def _is_anticlockwise(loop: FloatArray) -> bool:
    x, y = np.vstack([loop, loop[:1]]).T
    return bool(np.sum(x[:-1] * np.diff(y) - y[:-1] * np.diff(x)) > 0.0)


def _is_endless(obstacle: object) -> bool:
    return isinstance(obstacle, RigidHalfPlane) or (isinstance(obstacle, RigidSpline) and not obstacle.is_closed)


def _draw_hatched(axes: Axes, loops: list[FloatArray], frame: FloatArray, label: str) -> None:
    """Fill loops, and hatch what lies close to them: a zoom shows more of an obstacle than of the body."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    outline = _draw(axes, loops, _FILLED, label)
    reach = _BAND * float(np.hypot(*np.ptp(frame, axis=1)))
    strips = []
    for loop in loops:
        ways = np.diff(loop, axis=0, append=loop[:1])
        lengths = np.hypot(*ways.T)
        starts, ends, along = (each[lengths > 0.0] for each in (loop, loop + ways, ways))
        along = reach * along / lengths[lengths > 0.0, None]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1)
        low, high = starts - along, ends + along  # longer than the edges, so that no corner stays open
        strips += [*np.stack([low - across, high - across, high + across, low + across, low - across], axis=1)]
    band = Path.make_compound_path(*(Path(strip, closed=True) for strip in strips))
    hatching = PatchCollection(
        [PathPatch(band)], facecolor="none", hatch="//", edgecolor=_HATCH, linewidths=0.0, zorder=0
    )
    axes.add_artist(hatching)
    hatching.set_clip_path(outline)


def _draw(axes: Axes, loops: list[FloatArray], style: dict[str, Any], label: str) -> Patch:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    outline = Path.make_compound_path(*(Path(np.vstack([loop, loop[:1]]), closed=True) for loop in loops))
    return axes.add_patch(PathPatch(outline, label=label, **style))


def _frame(axes: Axes) -> FloatArray:
    return np.array([axes.get_xlim(), axes.get_ylim()])
