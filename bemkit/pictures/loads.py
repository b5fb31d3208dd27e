"""Loads as arrows: tractions and pressures, the weight, forces on rigid bodies and on parts that move as such."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.vectors import cross
from bemkit.pictures.drawing import VERMILION, Axes
from bemkit.pictures.plane import BoundaryPoints, draw_arrows, evenly_spaced
from bemkit.pictures.shown import DrawnBody, DrawnScene
from bemkit.scene.body_forces import Gravity
from bemkit.scene.conditions import Load, RigidConnection

_SPACING, _LONGEST = 0.04, 0.1
"""Distance of arrows, and length of the longest, relative to the picture."""
_LEAST = 0.02
"""Least load that has an arrow, relative to the largest."""
_POINTS_OF_BAR = 9
"""Points of an element along which a rigid connection is drawn."""
_MANY = 12
"""Least number of bodies whose weight is drawn once for all."""


def draw_loads(axes: Axes, shown: DrawnScene, factor: float) -> FloatArray:
    """Draw the loads on the bodies, moved by a factor times their displacements.

    Returns
    -------
    (n, 2) array [m]
        The ends of the arrows, which the frame should hold.
    """
    loaded: list[tuple[BoundaryPoints, FloatArray]] = []
    for body in shown.bodies:
        for part, elements in body.parts:
            if isinstance(part.condition, Load) and not isinstance(part.condition, RigidConnection):
                places = evenly_spaced(body, elements, _SPACING * shown.size, factor)
                loaded.append((places, part.condition.at(places.points, places.normals)))
    largest = max((float(np.hypot(*load.T).max()) for _, load in loaded), default=0.0)
    ends = [np.zeros((0, 2))]
    for places, load in loaded if largest > 0.0 else ():
        ends.append(_draw_load(axes, places, _LONGEST * shown.size * load / largest, shown.size, "load"))
    drawn = (draw(axes, shown, factor) for draw in (_draw_connections, _draw_weights, _draw_forces))
    return np.concatenate([*ends, *drawn])


def _draw_load(axes: Axes, places: BoundaryPoints, arrows: FloatArray, size: float, label: str) -> FloatArray:
    """Draw arrows whose heads are on the boundary where they press, their tails where they pull; return their ends."""
    seen = np.hypot(*arrows.T) > _LEAST * _LONGEST * size
    arrows, drawn, normals = arrows[seen], places.drawn[seen], places.normals[seen]
    presses = np.sum(arrows * normals, axis=1) <= 0.0
    tails = np.where(presses[:, None], drawn - arrows, drawn)
    draw_arrows(axes, tails, arrows, VERMILION, label)
    return np.concatenate([tails, tails + arrows])


def _draw_connections(axes: Axes, shown: DrawnScene, factor: float) -> FloatArray:
    """Draw rigid connections as bars, with the force or else the moment in their middle; return the ends of arrows."""
    from matplotlib.collections import LineCollection

    ends = [np.zeros((0, 2))]
    connected = [(body, part.condition, elements) for body in shown.bodies for part, elements in body.parts]
    for body, condition, elements in connected:
        if not isinstance(condition, RigidConnection):
            continue
        xi = np.linspace(-1.0, 1.0, _POINTS_OF_BAR)
        lines = body.mesh.points(elements, xi) + factor * body.displacement_at(elements, xi)
        bars = LineCollection(list(lines), colors=VERMILION, linewidths=4.0, zorder=2.5, label="rigid connection")
        axes.add_collection(bars)
        places = evenly_spaced(body, elements, _SPACING * shown.size, factor)
        tractions = condition.at(places.points, places.normals)
        middle = BoundaryPoints(*(values.mean(axis=0)[None] for values in places))
        mean = tractions.mean(axis=0)[None]
        if np.hypot(*mean.T) > _LEAST * np.hypot(*tractions.T).max():
            arrow = _LONGEST * shown.size * mean / np.hypot(*mean.T)
            ends.append(_draw_load(axes, middle, arrow, shown.size, "resultant"))
        elif tractions.any():
            is_left = cross(places.drawn - middle.drawn, tractions).sum() > 0.0
            marker = r"$\circlearrowleft$" if is_left else r"$\circlearrowright$"
            axes.plot(*middle.drawn.T, linestyle="", marker=marker, markersize=18, color=VERMILION, zorder=3)
    return np.concatenate(ends)


def _draw_weights(axes: Axes, shown: DrawnScene, factor: float) -> FloatArray:
    """Draw the direction of gravity in the middle of each body, or beside many bodies once."""
    heavy = [
        (body, force)
        for body in shown.bodies
        for force in body.scene.body_forces
        if isinstance(force, Gravity) and any(force.acceleration)
    ]
    if not heavy:
        return np.zeros((0, 2))
    length = 0.8 * _LONGEST * shown.size
    down = np.array(heavy[0][1].acceleration) / np.hypot(*heavy[0][1].acceleration)
    if len(shown.bodies) <= _MANY:
        directions = [np.array(force.acceleration) / np.hypot(*force.acceleration) for _, force in heavy]
        arrows = length * np.array(directions)
        tails = np.array([_middle(body, factor) for body, _ in heavy]) - 0.5 * arrows
    else:
        beside = shown.frame[:, 1] + 0.03 * shown.size
        tails, arrows = beside[None] - length * down, length * down[None]
    draw_arrows(axes, tails, arrows, VERMILION, "weight", is_hollow=True)
    return np.concatenate([tails, tails + arrows])


def _middle(body: DrawnBody, factor: float) -> FloatArray:
    """Return the middle of the bounding box of a body as it is drawn."""
    loop = body.outlines(factor)[0]
    return np.asarray(0.5 * (loop.min(axis=0) + loop.max(axis=0)))


def _draw_forces(axes: Axes, shown: DrawnScene, factor: float) -> FloatArray:
    """Draw the forces on rigid bodies at their centres."""
    driven = [
        (np.array(body.centre) + factor * np.array([result.x, result.y]), force)
        for body, result in shown.rigid
        if np.any(force := np.array([body.force_x or 0.0, body.force_y or 0.0]))
    ]
    if not driven:
        return np.zeros((0, 2))
    heads, forces = np.array([place for place, _ in driven]), np.array([force for _, force in driven])
    arrows = _LONGEST * shown.size * forces / np.hypot(*forces.T).max()
    draw_arrows(axes, heads - arrows, arrows, VERMILION, "force")
    return np.concatenate([heads, heads - arrows])
