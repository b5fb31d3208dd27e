"""What ``bemkit study errors`` prints, a table for each series of meshes, then the orders of all; and what it draws."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.text import Text

from bemkit.reference.compare import MEASURES, Reference
from bemkit.results.drawing import BLUE, GREEN, ORANGE, PURPLE, SKY, VERMILION, Axes, Figure, new_figure, show_grid
from bemkit.results.outputs import plain_table, stdout_console
from bemkit.studies.accuracy.records import ErrorRecord, by_series, fitted_rate, orders, pareto_front

WIDE = 100
"""Width of a terminal from which on stages, memory and estimates are shown; the files hold them in any case."""
SHORT = {name: name for name in MEASURES} | {
    "displacement": "displ.",
    "force_normal": "force_n",
    "force_tangential": "force_t",
    "transitions": "transit.",
}
FIGURE = "error-against-run-time"
_COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
_FRONT, _DARK = "#D8D8D8", "#444444"
_MARKERS = ("o", "^", "s", "D", "v", "P")
_LINES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 1, 1, 1)))
_MESHES = ("adaptive", "uniform", "graded")
"""Which line belongs to which meshes, so that figures of several studies agree; others follow."""
_ELEMENTS = ("constant", "linear", "quadratic")


def print_reference(title: str, reference: Reference, console: Console | None = None) -> None:
    """Print what errors are measured against and how far that may be wrong itself."""
    console = _console(console)
    console.print(Text(title, style="bold"))
    console.print(Text(f"reference: {reference.source}"))
    own = [f"{MEASURES[name]} {value:.0e}" for name, value in reference.own_errors.items() if np.isfinite(value)]
    if own:
        console.print(Text(f"its own errors, at most: {', '.join(own)}", style="dim"))
    console.print()


def print_study(records: Sequence[ErrorRecord], measures: Sequence[str], console: Console | None = None) -> None:
    """Print all series, their fitted orders, and what is fastest for which error."""
    console = _console(console)
    fronts = {measure: pareto_front(records, measure) for measure in measures}
    marked: dict[str, set[object]] = {measure: {record.key for record in front} for measure, front in fronts.items()}
    for series in by_series(records):
        _print_series(series, measures, marked, console)
    _print_orders(records, measures, console)
    if any(fronts.values()):
        console.print(Text("* no other run of this study is both faster and more accurate", style="dim"))
    elif records:
        console.print(Text("run times and memory were not measured: the runs were spread over processes", style="dim"))


def _print_series(
    records: Sequence[ErrorRecord], measures: Sequence[str], marked: dict[str, set[object]], console: Console
) -> None:
    """Print the records of one series; each error is followed by its order against the mesh before."""
    first = records[0]
    words = (f"{first.discretisation} elements", first.map, f"{first.meshes} meshes", first.solver)
    console.print(Text(", ".join(words), style="bold"))
    is_wide = console.width >= WIDE
    table = plain_table(right=[*_costs(first, is_wide=is_wide)])
    for measure in measures:
        table.add_column(f"{SHORT[measure]:>6}", no_wrap=True)
    steps = {measure: orders(records, measure) for measure in measures}
    for k, record in enumerate(records):
        errors = [_error(record, measure, steps[measure][k], record.key in marked[measure]) for measure in measures]
        table.add_row(*_costs(record, is_wide=is_wide).values(), *errors)
    console.print(table)
    for record in records:
        if not record.is_certified:
            status = record.status.replace("_", " ")
            console.print(Text(f"  {_aim(record.size)}: {status}: {record.message}", style="red"))
        elif record.message:
            # the first sentence; the rest is in the files
            console.print(Text(f"  {record.message.split('. ')[0]}", style="yellow"))
    console.print()


def _print_orders(records: Sequence[ErrorRecord], measures: Sequence[str], console: Console) -> None:
    console.print(Text("observed rates in the number n of unknowns, fitted to the last meshes", style="bold"))
    table = plain_table(("elements", "map", "meshes", "driver"), [SHORT[measure] for measure in measures])
    for column in table.columns[:3]:
        column.no_wrap = True
    for series in by_series(records):
        first = series[0]
        cells = [str(fitted_rate(series, measure)) for measure in measures]
        table.add_row(first.discretisation, first.map, first.meshes, first.solver, *cells)
    console.print(table)


def _costs(record: ErrorRecord, *, is_wide: bool) -> dict[str, str]:
    """Return what stands before the errors, by the heads of the columns."""
    costs = {"aim": _aim(record.size)} if record.meshes == "adaptive" else {}
    costs |= {"N": str(record.elements or "-"), "it": str(record.linear_solves)}
    if is_wide:
        stages = {"assem.": record.seconds_assemble, "cond.": record.seconds_condense, "solve": record.seconds_solve}
        costs |= {head: _number(seconds, ".3f") for head, seconds in stages.items()}
    costs["total s"] = _number(record.seconds, ".3f")
    if is_wide:
        costs |= {"MB": _number(record.peak_memory / 1e6, ".3g"), "estim.": _short(record.estimated_error)}
    return costs


def _error(record: ErrorRecord, measure: str, order: float, is_best: bool) -> Text:
    value = getattr(record, measure)
    text = "absent" if np.isposinf(value) else _short(value)
    step = f"{order:4.1f}" if np.isfinite(order) else "    "
    return Text(f"{text:>6} {step}{'*' if is_best else ' '}", style="bold green" if is_best else "")


def _short(value: float) -> str:
    """Return two digits, as 1.2e-4."""
    return "-" if not np.isfinite(value) else f"{value:.1e}".replace("e-0", "e-").replace("e+00", "e0")


def _aim(size: float) -> str:
    return f"{size:g}" if size >= 1.0 else f"{size:.0e}".replace("e-0", "e-")


def _number(value: float, form: str) -> str:
    return "-" if not np.isfinite(value) else f"{value:{form}}"


def _console(console: Console | None) -> Console:
    # into a file or a pipe there is room
    return stdout_console(console, width=None if sys.stdout.isatty() else 120)


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
        # drivers reach the same state: the rate is that of elements and meshes
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

    colour = _COLOURS[place(_ELEMENTS, "discretisation") % len(_COLOURS)]
    line = _LINES[place(_MESHES, "meshes") % len(_LINES)]
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
