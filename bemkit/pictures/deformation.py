"""The bodies before and after, with supports, loads and obstacles."""

from __future__ import annotations

import numpy as np

from bemkit.pictures.drawing import Axes, legend_below
from bemkit.pictures.loads import draw_loads
from bemkit.pictures.magnification import magnification
from bemkit.pictures.obstacles import draw_obstacles, draw_rigid_bodies, relief_frame
from bemkit.pictures.plane import draw_bodies, draw_initial, draw_symmetry_lines, joined_frame, plane_axes, set_frame
from bemkit.pictures.shown import Drawable, DrawnScene, shown
from bemkit.pictures.supports import draw_supports
from bemkit.results.solution import Solution


def draw_deformation(solution: Solution, axes: Axes | None = None, *, factor: float | None = None) -> Axes:
    """Draw all bodies before and after, with supports, loads and obstacles.

    Parameters
    ----------
    solution : Solution
    axes : Axes, optional
        Of matplotlib; those of a new figure by default.
    factor : float, optional
        Factor by which displacements are enlarged; by default so small that contacts are drawn closed. The picture
        states it.
    """
    scene = shown(solution)
    if factor is None:  # of a relief that fills the height nothing needs to be enlarged
        factor = magnification(scene) if relief_frame(scene, 1.0) is None else 1.0
    axes = plane_axes(axes, scene.frame, scene.title, scene.units)
    draw_bodies(axes, scene, factor)
    loops = [loop for body in scene.bodies for loop in body.outlines(factor)]
    _complete(axes, scene, factor, loops)
    return axes


def draw_scene(scene: Drawable, axes: Axes | None = None) -> Axes:
    """Draw what a scene states: bodies, supports, loads and obstacles; see `draw_deformation`."""
    stated = shown(scene)
    axes = plane_axes(axes, stated.frame, stated.title, stated.units)
    draw_initial(axes, stated, is_filled=True)
    _complete(axes, stated, 0.0, [])
    return axes


def _complete(axes: Axes, scene: DrawnScene, factor: float, loops: list[np.ndarray]) -> None:
    """Draw what is around bodies whose outlines are drawn, and choose the frame."""
    for body in scene.bodies[:1]:
        draw_symmetry_lines(axes, body.scene.symmetry)
    draw_supports(axes, scene, factor)
    ends = draw_loads(axes, scene, factor)
    relief = relief_frame(scene, factor)
    if relief is None:
        set_frame(axes, joined_frame(scene.frame.T, *loops, ends))
    else:
        axes.set_aspect("auto")
        set_frame(axes, relief, margin=0.0)
    draw_rigid_bodies(axes, scene, factor)
    draw_obstacles(axes, scene)
    legend_below(axes)
