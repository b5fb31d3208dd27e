"""Figures of a sweep: any column over any other."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from bemkit.pictures.drawing import COLOURS, LINES, Axes, Figure, new_figure, show_grid
from bemkit.studies.sweep.records import NUMBERS, unit_of_column
from bemkit.studies.sweep.table import Sweep


def figure_name(over: str, show: str) -> str:
    """Return the name of a figure's file without its ending."""
    return re.sub(r"[^\w.\-]+", "-", f"{show}-over-{over}").strip("-")


def draw_sweep(sweep: Sweep, over: str, show: str, axes: Axes | None = None) -> Figure:
    """Draw a column of the solved rows over another one, a line for each combination of the other keys.

    Parameters
    ----------
    sweep : Sweep
    over, show : str
        Keys, or names of numerical results.
    axes : matplotlib Axes, optional
        Where to draw; by default in a new figure.

    Raises
    ------
    InputError
        If there is no such column of numbers.
    """
    x, y = sweep.column(over), sweep.column(show)
    if axes is None:
        axes = new_figure(7.0, 4.6).subplots()
    along = over if over in sweep.keys else sweep.keys[0]  # over a result, lines run along the first key
    others = [key for key in sweep.keys if key not in (along, show)]
    series: dict[tuple[float, ...], list[int]] = {}
    for number, row in enumerate(sweep.solved):
        series.setdefault(tuple(sweep.entry(row, key) for key in others), []).append(number)
    for number, (values, rows) in enumerate(series.items()):
        label = ", ".join(f"{key} = {value:g}" for key, value in zip(others, values, strict=True))
        order = np.array(rows)[np.argsort(sweep.column(along)[rows], kind="stable")]
        style: dict[str, Any] = {
            "color": COLOURS[number % len(COLOURS)],
            "linestyle": LINES[number // len(COLOURS) % len(LINES)],
        }
        axes.plot(x[order], y[order], marker="o", markersize=3.5, linewidth=1.2, label=label or None, **style)
    axes.set_xlabel(_named(over, sweep), parse_math=False)
    axes.set_ylabel(_named(show, sweep), parse_math=False)
    failed = f" ({len(sweep.failed)} of {len(sweep.rows)} rows failed)" if sweep.failed else ""
    axes.set_title(sweep.scene.title + failed, parse_math=False, fontsize=11)
    show_grid(axes)
    if others and len(series) <= 24:
        axes.legend(frameon=False, fontsize="small")
    figure: Any = axes.get_figure()
    return figure  # type: ignore[no-any-return]


def draw_all(over: str, shown: Sequence[str], sweep: Sweep) -> dict[str, Figure]:
    """Return a figure for each column that is shown, by the names of their files."""
    return {figure_name(over, show): draw_sweep(sweep, over, show) for show in shown}


def _named(column: str, sweep: Sweep) -> str:
    unit = unit_of_column(column, sweep.scene.result_units)
    return f"{column.replace('_', ' ') if column in NUMBERS else column}{f' [{unit}]' if unit else ''}"
