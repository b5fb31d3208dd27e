"""Figure of an error study: errors over run time, or over the number of unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from bemkit.pictures.drawing import COLOURS, LINES, Axes, Figure, new_figure, show_grid
from bemkit.reference.compare import MEASURES
from bemkit.studies.accuracy.records import ErrorRecord, by_series, fitted_rate, pareto_front

FIGURE = "error-against-run-time"
_FRONT, _DARK = "#D8D8D8", "#444444"
_MARKERS = ("o", "^", "s", "D", "v", "P")
_MESHES = ("adaptive", "uniform", "graded")
"""Line style of each kind of meshes, the same in all figures; other kinds follow."""
_ELEMENTS = ("constant", "linear", "quadratic")


def draw_errors(records: Sequence[ErrorRecord], measures: Sequence[str], *, title: str = "") -> Figure:
    """Draw errors over run time, or over the number of unknowns where no times were measured, one panel for each."""
    n_columns = min(len(measures), 2)
    n_rows = -(-len(measures) // n_columns)
    figure = new_figure(5.2 * n_columns, 3.9 * n_rows + 1.1)
    axes = figure.subplots(n_rows, n_columns, squeeze=False).ravel()
    for panel, measure in zip(axes, measures, strict=False):
        _draw_panel(panel, records, measure)
    for panel in axes[len(measures) :]:
        panel.set_visible(False)
    figure.legend(handles=_legend(records), loc="outside lower center", ncols=4, frameon=False, fontsize="small")
    figure.suptitle(title, fontsize=11, parse_math=False)
    return figure


def _is_timed(records: Sequence[ErrorRecord]) -> bool:
    return any(np.isfinite(record.seconds) for record in records)


def _draw_panel(panel: Axes, records: Sequence[ErrorRecord], measure: str) -> None:
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    abscissa = "seconds" if _is_timed(records) else "unknowns"
    front = pareto_front(records, measure)
    if front:
        x, y = _points(front, "seconds", measure)
        style: dict[str, Any] = {"color": _FRONT, "linewidth": 5, "solid_capstyle": "round", "zorder": 0}
        panel.step(x, y, where="post", **style)
    named, n_points = set(), 0
    for series in by_series(records):
        x, y = _points(series, abscissa, measure)
        n_points += x.size
        colour, line, marker = _style(records, series[0])
        panel.plot(x, y, color=colour, linestyle=line, marker=marker, markersize=4.5, linewidth=1.2)
        rate = fitted_rate(series, measure)
        # solvers reach the same state: the rate is that of elements and meshes
        if x.size and np.isfinite(rate.value) and series[0].series[:2] not in named:
            named.add(series[0].series[:2])
            _write_order(panel, str(rate), (x[-1], y[-1]), colour)
    if not n_points:
        panel.set(xlim=(1.0, 10.0), ylim=(1e-3, 1.0))
        panel.text(0.5, 0.5, "no finite error", transform=panel.transAxes, ha="center", va="center")
    panel.set_xscale("log")
    panel.set_yscale("log")
    panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
    panel.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    panel.xaxis.set_minor_formatter(NullFormatter())
    panel.set_xlabel("run time [s]" if abscissa == "seconds" else "number of unknowns")
    panel.set_title(f"relative error: {MEASURES[measure]}", loc="left", fontsize=10)
    show_grid(panel)


def _write_order(panel: Axes, text: str, place: tuple[float, float], colour: str) -> None:
    from matplotlib.patheffects import withStroke

    halo = [withStroke(linewidth=2.5, foreground="white")]
    style: dict[str, Any] = {"color": colour, "fontsize": 8, "va": "top", "path_effects": halo, "zorder": 5}
    panel.annotate(text, place, xytext=(3, -3), textcoords="offset points", **style)


def _points(records: Sequence[ErrorRecord], abscissa: str, measure: str) -> tuple[Any, Any]:
    x = np.array([float(getattr(record, abscissa)) for record in records])
    y = np.array([getattr(record, measure) for record in records], dtype=float)
    shown = np.isfinite(x) & np.isfinite(y) & (y > 0.0)
    return x[shown], y[shown]


def _style(records: Sequence[ErrorRecord], record: ErrorRecord) -> tuple[str, Any, str]:
    def place(known: Sequence[str], name: str) -> int:
        names = dict.fromkeys([*known, *(str(getattr(other, name)) for other in records)])
        return list(names).index(getattr(record, name))

    colour = COLOURS[place(_ELEMENTS, "discretisation") % len(COLOURS)]
    line = LINES[place(_MESHES, "meshes") % len(LINES)]
    return colour, line, _MARKERS[place((), "solver") % len(_MARKERS)]


def _legend(records: Sequence[ErrorRecord]) -> list[Any]:
    from matplotlib.lines import Line2D

    elements, meshes, drivers = {}, {}, {}
    for record in records:
        colour, line, marker = _style(records, record)
        elements[f"{record.discretisation} elements ({record.map})"] = {"color": colour, "linewidth": 3}
        meshes[f"{record.meshes} meshes"] = {"color": _DARK, "linestyle": line, "linewidth": 1.2}
        drivers[record.solver] = {"color": _DARK, "marker": marker, "linestyle": "none", "markersize": 5}
    styles: dict[str, dict[str, Any]] = elements | meshes | drivers
    if _is_timed(records):
        styles["no run is faster and more accurate"] = {"color": _FRONT, "linewidth": 5}
    return [Line2D([], [], label=name, **style) for name, style in styles.items()]
