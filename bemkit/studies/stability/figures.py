"""Figures of ``bemkit stability``."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bemkit.pictures.drawing import BLUE, GREEN, GREY, ORANGE, SKY, VERMILION, Figure, new_figure, show_grid
from bemkit.studies.stability.axes import Axis
from bemkit.studies.stability.records import StabilityRecord, Verdict

_SERIES = (
    ("certificate", "certificate", BLUE, "o"),
    ("check", "independent check", GREEN, "s"),
    ("scaled_copy", "difference to the scaled copy", ORANGE, "^"),
    ("deviation", "deviation from the reference", GREY, "x"),
)
_FLOOR = 1e-18


def draw_axes(axes: Sequence[Axis], records: Sequence[StabilityRecord]) -> dict[str, Figure]:
    """Draw one figure for each axis, by file names."""
    return {figure_name(axis): draw_axis(axis, [one for one in records if one.axis == axis.name]) for axis in axes}


def figure_name(axis: Axis) -> str:
    """Return the name of the file, without ``.png``."""
    return f"stability-{axis.name}"


def draw_axis(axis: Axis, records: Sequence[StabilityRecord]) -> Figure:
    """Draw one axis."""
    figure = new_figure(6.4, 4.0)
    plot = figure.add_subplot()
    is_logarithmic = axis.is_logarithmic and any(record.value > 0.0 for record in records)
    if is_logarithmic:
        records = [record for record in records if record.value > 0.0]
    values = np.array([record.value for record in records])
    for name, label, colour, marker in _SERIES:
        numbers = np.maximum([getattr(record, name) for record in records], _FLOOR)
        shown = np.isfinite(numbers)
        plot.plot(
            values[shown], numbers[shown], marker, color=colour, label=label, markersize=5, linestyle="-", linewidth=0.8
        )
    for verdict, colour in ((Verdict.NAMED, SKY), (Verdict.WRONG, VERMILION)):
        marked = [record.value for record in records if record.verdict == verdict.value]
        for k, value in enumerate(marked):
            plot.axvline(value, color=colour, linewidth=4, alpha=0.35, label=verdict.value if k == 0 else None)
    if is_logarithmic:
        plot.set_xscale("log")
    plot.set_yscale("log")
    plot.set_xlabel(axis.label)
    plot.set_ylabel("dimensionless")
    plot.set_title(axis.name, loc="left")
    show_grid(plot)
    plot.legend(fontsize="small", frameon=False)
    return figure
