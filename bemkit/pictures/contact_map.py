"""Contacts in the plane: all at once, and the zone of contact from near by with the tractions of its nodes."""

from __future__ import annotations

from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.contact_nodes import Nodes, contact_nodes
from bemkit.pictures.crowds import marked, seen_apart
from bemkit.pictures.drawing import VERMILION, Axes, legend_below
from bemkit.pictures.magnification import magnification
from bemkit.pictures.obstacles import draw_obstacles, draw_rigid_bodies
from bemkit.pictures.plane import draw_arrows, draw_bodies, draw_initial, joined_frame, plane_axes, set_frame
from bemkit.pictures.shown import DrawnScene, shown
from bemkit.results.contact_table import ContactTable
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import amount

_TOOTH, _SHARE, _SHORTEST = 0.1, 1.0 / 3.0, 0.03
"""Length of the longest tooth, relative to the picture or to the smallest body, and its lower limit, relative to the
picture."""
SHORT = 0.4
"""Largest zone of contact that has a picture of its own, relative to the bodies."""
_LONGEST, _LEAST = 0.25, 0.01
"""Length of the longest arrow, relative to the zone, and of the shortest, relative to the longest."""
_ARROWS = 40
"""Arrows along a straight zone at most."""
_NODES_AROUND = 3.0
"""Size of the frame around a zone of a single node, in distances of neighbouring nodes."""


def draw_contact_map(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw all bodies, and each contact once: its status by colour, its pressure by the length of a comb.

    Parameters
    ----------
    solution : Solution
    axes : optional
        As for `bemkit.pictures.deformation.draw_deformation`.
    """
    from matplotlib.collections import LineCollection

    scene, table, units = shown(solution), solution.contact, solution.units
    nodes = contact_nodes(solution, scene, 0.0)
    points, pressure = nodes.points, np.maximum(-table.sigma_n, 0.0)[nodes.rows]
    largest = float(pressure.max(initial=0.0))
    title = f"Contacts, pressure up to {amount(largest, 'stress', units)}\n{scene.title}"
    axes = plane_axes(axes, scene.frame, title, units)
    draw_initial(axes, scene, is_filled=True)
    set_frame(axes, scene.frame)
    draw_rigid_bodies(axes, scene, 0.0)
    draw_obstacles(axes, scene)
    length = _longest_tooth(scene) * pressure / (largest or 1.0)
    tips = points - length[:, None] * nodes.directions
    words = np.array(table.status_words())[nodes.rows]
    for word, colour in STATUS_COLOURS.items():
        has_status = words == word
        if has_status.any():
            teeth = np.stack([points, tips], axis=1)[has_status]
            axes.add_collection(LineCollection(list(teeth), colors=colour, linewidths=1.4))
            axes.scatter(points[has_status, 0], points[has_status, 1], s=7.0, color=colour, zorder=3, linewidths=0.0)
            axes.plot([], [], color=colour, marker="o", markersize=4.0, label=word)
    legend_below(axes)
    return axes


def _longest_tooth(scene: DrawnScene) -> float:
    smallest = min((body.mesh.diameter for body in scene.bodies if not body.mesh.is_exterior), default=np.inf)
    return float(np.clip(_SHARE * smallest, _SHORTEST * scene.size, _TOOTH * scene.size))


def is_short(solution: Solution) -> bool:
    """Return whether the contact that is closed takes a small share of the picture of all bodies."""
    scene = shown(solution)
    frame = _zone(scene.contact, contact_nodes(solution, scene, 0.0))
    return frame is not None and float(np.hypot(*np.ptp(frame, axis=1))) < SHORT * scene.size


def draw_zoom(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw the zone of contact from near by, with the tractions on the contact nodes as arrows.

    Parameters
    ----------
    solution : Solution
        With contact; where nothing touches, the whole contact boundary is shown.
    axes : optional
        As for `bemkit.pictures.deformation.draw_deformation`.
    """
    scene = shown(solution)
    frame = _zone(scene.contact, contact_nodes(solution, scene, 0.0))
    if frame is None:
        frame = joined_frame(scene.contact.points)
    size = max(float(np.ptp(frame, axis=1).max()), _NODES_AROUND * float(scene.contact.weight.max()))
    middle = frame.mean(axis=1)
    frame = np.stack([middle - 0.8 * size, middle + 0.8 * size], axis=1)
    factor = magnification(scene, size)
    axes = plane_axes(axes, frame, f"Zone of contact\n{scene.title}", scene.units)
    draw_bodies(axes, scene, factor)
    set_frame(axes, frame, margin=0.0)
    draw_rigid_bodies(axes, scene, factor)
    set_frame(axes, frame, margin=0.0)
    draw_obstacles(axes, scene)
    nodes = contact_nodes(solution, scene, factor)
    _draw_nodes(axes, nodes, np.array(scene.contact.status_words())[nodes.rows], size)
    legend_below(axes)
    return axes


def _zone(contact: ContactTable, nodes: Nodes) -> FloatArray | None:
    """Return the frame of the nodes that touch, with images not farther away than its size; None if there are none."""
    closed = contact.is_closed
    if not closed.any():
        return None
    frame = joined_frame(contact.points[closed])
    reach = np.ptp(frame, axis=1).max()
    is_near = np.all((nodes.points >= frame[:, 0] - reach) & (nodes.points <= frame[:, 1] + reach), axis=1)
    return joined_frame(nodes.points[closed[nodes.rows] & is_near])


def _draw_nodes(axes: Axes, nodes: Nodes, words: Any, size: float) -> None:
    """Mark the contact nodes by their status, where they are drawn, with the tractions on their body."""
    sizes = np.hypot(*nodes.tractions.T)
    largest = float(sizes.max(initial=0.0))
    if largest > 0.0:
        shown = seen_apart(nodes.drawn, sizes, size / _ARROWS)
        shown = shown[sizes[shown] > _LEAST * largest]
        arrows = _LONGEST * size * nodes.tractions[shown] / largest
        draw_arrows(axes, nodes.drawn[shown] - arrows, arrows, VERMILION, "traction on the body")
    for word, colour in STATUS_COLOURS.items():
        own = np.flatnonzero(words == word)
        if own.size:
            x, y = nodes.drawn[own[marked(nodes.drawn[own], sizes[own], size)]].T
            axes.scatter(x, y, s=16.0, color=colour, edgecolors="black", linewidths=0.4, zorder=4, label=word)
