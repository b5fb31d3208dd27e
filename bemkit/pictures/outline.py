"""The picture of an outline: its sides with their names and corners."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.geometry.outline import Outline
from bemkit.geometry.vectors import norms, turned_right
from bemkit.pictures.drawing import COLOURS, Axes, axes_or_new, show_grid
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.text import Annotation
    from matplotlib.transforms import Bbox

_SEEN = np.linspace(0.0, 1.0, 65)
_MANY = 40
"""Sides of which each is still named."""
_DISTANCE, _LINE, _ATTEMPTS = 9.0, 11.0, 30
"""Distance of names from their sides and from each other [points], and how many positions are tried."""


def draw_outline(outline: Outline, title: str, axes: Axes | None = None, *, units: UnitNames | None = None) -> Axes:
    """Draw the sides of an outline in alternating colours, with their names and a dot at the start of each."""
    axes, labels = axes_or_new(axes, 7.0, 5.2), []
    outwards = [1.0 if k == 0 or outline.is_exterior else -1.0 for k, loop in enumerate(outline.loops) for _ in loop]
    for index, (side, sense) in enumerate(zip(outline.sides, outwards, strict=True)):
        points = side.curve.point(_SEEN)
        colour = COLOURS[index % len(COLOURS)]
        axes.plot(*points.T, color=colour, linewidth=2.0)
        axes.plot(*points[0], color="black", marker="o", markersize=3.0)
        if len(outline.sides) <= _MANY:
            tangent = side.curve.derivative(np.array([0.5]))
            (x, y), (right, up) = (
                side.curve.point(np.array([0.5]))[0],
                sense * (turned_right(tangent) / norms(tangent))[0],
            )
            label = axes.annotate(
                side.name,
                (x, y),
                (_DISTANCE * right, _DISTANCE * up),
                textcoords="offset points",
                color=colour,
                fontsize=9,
                parse_math=False,
                ha="left" if right > 0.5 else "right" if right < -0.5 else "center",
                va="bottom" if up > 0.5 else "top" if up < -0.5 else "center",
            )
            labels.append((label, right, up))
    axes.set_aspect("equal")
    axes.margins(0.12)
    axes.set_title(title, parse_math=False, fontsize=11)
    axes.set_xlabel(with_unit("x", "length", units), parse_math=False)
    axes.set_ylabel(with_unit("y", "length", units), parse_math=False)
    show_grid(axes)
    _separate(axes, labels)
    return axes


def _separate(axes: Axes, labels: list[tuple[Annotation, float, float]]) -> None:
    """Move labels away from their sides until none covers another, and join those that moved to their sides."""
    figure = axes.get_figure(root=True)
    figure.draw_without_rendering()  # type: ignore[union-attr]
    placed: list[Bbox] = []
    for label, right, up in labels:
        for attempt in range(1, _ATTEMPTS):
            if not any(label.get_window_extent().overlaps(box) for box in placed):
                break
            aside = _LINE * (attempt // 2 + 1) * (-1.0) ** attempt
            away = _DISTANCE + 0.7 * abs(aside)
            label.xyann = (away * right - aside * up, away * up + aside * right)
        placed.append(label.get_window_extent())
        if attempt > 1:
            line = {"arrowstyle": "-", "color": label.get_color(), "linewidth": 0.6, "shrinkA": 0.0, "shrinkB": 0.0}
            axes.annotate("", label.xy, label.xyann, textcoords="offset points", arrowprops=line)
