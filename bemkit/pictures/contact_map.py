"""All contacts at once: status by colour, pressure by the length of a comb."""

from __future__ import annotations

import numpy as np

from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.contact_nodes import contact_directions, node_points
from bemkit.pictures.obstacles import draw_obstacles, draw_rigid_bodies
from bemkit.pictures.plane import draw_initial, plane_axes, set_frame
from bemkit.pictures.shown import Result, Shown, shown
from bemkit.results.drawing import Axes, legend_below
from bemkit.scene.unit_names import UnitNames, amount

_TOOTH, _SHARE = 0.1, 1.0 / 3.0
"""Length of the longest tooth: share of the picture, or of a body where there are many."""


def draw_contact_map(solution: Result, axes: Axes | None = None, *, units: UnitNames | None = None) -> Axes:
    """Draw all bodies, and each contact once: its status by colour, its pressure by the length of a comb.

    Parameters
    ----------
    solution : Solution or AssemblySolution
    axes, units : optional
        As for `bemkit.pictures.deformation.draw_deformation`.
    """
    from matplotlib.collections import LineCollection

    scene, table = shown(solution), solution.contact
    units = units or solution.units
    points, pressure = node_points(table), np.maximum(-table.sigma_n, 0.0)
    largest = float(pressure.max(initial=0.0))
    title = f"Contacts, pressure up to {amount(largest, 'stress', units)}\n{scene.title}"
    axes = plane_axes(axes, scene.frame, title, units)
    draw_initial(axes, scene)
    set_frame(axes, scene.frame)
    draw_rigid_bodies(axes, scene, 0.0)
    draw_obstacles(axes, scene)
    length = _longest_tooth(scene) * pressure / (largest or 1.0)
    tips = points - length[:, None] * contact_directions(solution)
    words = np.array(table.status_words())
    for word, colour in STATUS_COLOURS.items():
        own = words == word
        if own.any():
            teeth = np.stack([points, tips], axis=1)[own]
            axes.add_collection(LineCollection(list(teeth), colors=colour, linewidths=1.4))
            axes.scatter(points[own, 0], points[own, 1], s=7.0, color=colour, zorder=3, linewidths=0.0)
            axes.plot([], [], color=colour, marker="o", markersize=4.0, label=word)
    legend_below(axes)
    return axes


def _longest_tooth(scene: Shown) -> float:
    diameters = [body.mesh.diameter for body in scene.bodies if not body.mesh.is_exterior]
    return float(min(_TOOTH * scene.size, _SHARE * np.median(diameters or [np.inf])))
