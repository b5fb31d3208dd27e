"""The picture of an outline: its sides with their names and corners."""

from __future__ import annotations

import numpy as np

from bemkit.geometry.outline import Outline
from bemkit.geometry.vectors import norms, turned_right
from bemkit.pictures.drawing import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, Axes, axes_or_new, show_grid
from bemkit.scene.unit_names import UnitNames, with_unit

_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
_SEEN = np.linspace(0.0, 1.0, 65)
_MANY = 40
"""Sides of which each is still named."""


def draw_outline(outline: Outline, title: str, axes: Axes | None = None, *, units: UnitNames | None = None) -> Axes:
    """Draw the sides of an outline in turning colours, their names beside them, and a dot where each begins."""
    axes = axes_or_new(axes, 7.0, 5.2)
    outwards = [1.0 if k == 0 or outline.is_exterior else -1.0 for k, loop in enumerate(outline.loops) for _ in loop]
    for number, (side, sense) in enumerate(zip(outline.sides, outwards, strict=True)):
        points = side.curve.point(_SEEN)
        colour = _COLOURS[number % len(_COLOURS)]
        axes.plot(*points.T, color=colour, linewidth=2.0)
        axes.plot(*points[0], color="black", marker="o", markersize=3.0)
        if len(outline.sides) <= _MANY:
            tangent = side.curve.derivative(np.array([0.5]))
            (x, y), (right, up) = (
                side.curve.point(np.array([0.5]))[0],
                sense * (turned_right(tangent) / norms(tangent))[0],
            )
            axes.annotate(
                side.name,
                (x, y),
                (9.0 * right, 9.0 * up),
                textcoords="offset points",
                color=colour,
                fontsize=9,
                parse_math=False,
                ha="left" if right > 0.5 else "right" if right < -0.5 else "center",
                va="bottom" if up > 0.5 else "top" if up < -0.5 else "center",
            )
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.set_title(title, parse_math=False, fontsize=11)
    axes.set_xlabel(with_unit("x", "length", units), parse_math=False)
    axes.set_ylabel(with_unit("y", "length", units), parse_math=False)
    show_grid(axes)
    return axes
