"""Supports by the usual symbols: hatching where a body is clamped, rollers, arrows where displacements are given."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.pictures.drawing import GREEN, Axes
from bemkit.pictures.plane import BoundaryPoints, draw_arrows, evenly_spaced
from bemkit.pictures.shown import DrawnScene
from bemkit.scene.conditions import Clamped, PrescribedDisplacement, Roller

_SPACING, _SIZE = 0.035, 0.012
"""Distance of symbols, and their radius, relative to the picture."""
_ARROW, _LEAST = 0.06, 1e-9
"""Length of arrows, relative to the picture, and the least displacement that has one, relative to the largest."""
_COLOUR, _GIVEN = "#333333", "given displacement"


def draw_supports(axes: Axes, shown: DrawnScene, factor: float) -> None:
    """Draw the supports of all bodies where these are drawn, moved by a factor times their displacements."""
    size = shown.size
    for body in shown.bodies:
        for part, elements in body.parts:
            match part.condition:
                case Clamped():
                    places = evenly_spaced(body, elements, 0.6 * _SPACING * size, factor)
                    _draw_clamped(axes, places, _SIZE * size)
                case Roller():
                    places = evenly_spaced(body, elements, _SPACING * size, factor)
                    _draw_rollers(axes, places, _SIZE * size)
                case PrescribedDisplacement() as given:
                    places = evenly_spaced(body, elements, 2.0 * _SPACING * size, factor)
                    _draw_given(axes, places, given.at(places.points), given.is_prescribed, size)


def _draw_clamped(axes: Axes, places: BoundaryPoints, size: float) -> None:
    """Hatch the outside of the boundary."""
    from matplotlib.collections import LineCollection

    tangents = np.stack([-places.normals[:, 1], places.normals[:, 0]], axis=1)
    ends = places.drawn + 1.6 * size * (places.normals - tangents)
    lines = np.stack([places.drawn, ends], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=_COLOUR, linewidths=0.9))
    axes.plot([], [], linestyle="", marker=r"$/\!/\!/$", markersize=13, color=_COLOUR, label="clamped")


def _draw_rollers(axes: Axes, places: BoundaryPoints, size: float) -> None:
    """Draw circles between the boundary and a line on which they roll."""
    from matplotlib.collections import EllipseCollection, LineCollection

    widths = np.full(len(places.drawn), 2.0 * size)
    centres = places.drawn + size * places.normals
    circles = EllipseCollection(
        widths,
        widths,
        np.zeros_like(widths),
        units="xy",
        offsets=centres,
        transOffset=axes.transData,
        facecolors="white",
        edgecolors=_COLOUR,
        linewidths=0.9,
        zorder=2,
    )
    axes.add_collection(circles)
    axes.plot([], [], linestyle="", marker="o", color=_COLOUR, markerfacecolor="white", label="roller")
    tangents = np.stack([-places.normals[:, 1], places.normals[:, 0]], axis=1)
    ground = centres + 1.1 * size * places.normals
    lines = np.stack([ground - 1.6 * size * tangents, ground + 1.6 * size * tangents], axis=1)
    axes.add_collection(LineCollection(list(lines), colors=_COLOUR, linewidths=0.9))


def _draw_given(
    axes: Axes, places: BoundaryPoints, values: FloatArray, is_given: tuple[bool, bool], size: float
) -> None:
    """Draw arrows along given displacements, with their heads on the boundary; bars along what must not move."""
    from matplotlib.collections import LineCollection

    lengths = np.hypot(*values.T)
    largest = float(lengths.max(initial=0.0))
    if largest > 0.0:
        is_moved = lengths > _LEAST * largest
        arrows = _ARROW * size * values[is_moved] / lengths[is_moved, None]
        draw_arrows(axes, places.drawn[is_moved] - arrows, arrows, GREEN, _GIVEN)
        return
    marker = "+" if all(is_given) else "_" if is_given[0] else "|"
    for axis in (axis for axis in (0, 1) if is_given[axis]):
        along = _SIZE * size * np.eye(2)[axis]
        bars = np.stack([places.drawn - along, places.drawn + along], axis=1)
        axes.add_collection(LineCollection(list(bars), colors=GREEN, linewidths=1.6, zorder=3))
    axes.plot([], [], linestyle="", marker=marker, markersize=9, color=GREEN, label=_GIVEN)
