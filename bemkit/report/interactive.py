"""A drawing to explore inside a page: outlines and contact tractions with their values, and a slider over load steps.

plotly draws it in the browser. The page holds the library, compressed, and loads nothing from elsewhere.
"""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Iterable, Sequence
from importlib.util import find_spec
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.drawing import BLUE, GREY, VERMILION
from bemkit.pictures.magnification import magnification
from bemkit.pictures.shown import DrawnScene, Result, shown
from bemkit.pictures.traction_curves import traction_curve
from bemkit.report.html import Element, element
from bemkit.results.tables import in_units, table_of
from bemkit.scene.unit_names import UnitNames, with_unit
from bemkit.stopwatch import announce
from bemkit.table import Column, Table

_UNPACK = """
const packed = document.getElementById("packed-drawing").textContent;
const bytes = Uint8Array.from(atob(packed), (letter) => letter.charCodeAt(0));
const unpacked = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("gzip"));
new Response(unpacked).text().then((text) => {
  document.getElementById("drawing").textContent = "";
  const script = document.createElement("script");
  script.textContent = text;
  document.head.append(script);
});
"""


def check_interactive() -> None:
    """Raise InputError if plotly, or matplotlib, which finds overlaps of bodies as they are drawn, is not installed."""
    if find_spec("plotly") is None or find_spec("matplotlib") is None:
        raise InputError('interactive pages need plotly and matplotlib: pip install "bemkit[interactive]"')


def interactive_elements(result: Result) -> list[Element]:
    """Return the drawing of a result as elements of a page.

    Parameters
    ----------
    result : Solution
        With a load history the slider has an entry for each of its steps, and the last one is shown first.

    Raises
    ------
    InputError
        If plotly or matplotlib is not installed.
    """
    check_interactive()
    from plotly.offline import get_plotlyjs

    announce("draw the interactive page")
    drawing = interactive_figure(result).to_json()
    plot = f"const drawing = {drawing};\nPlotly.newPlot('drawing', drawing).then(() => (window.isDrawn = true));"
    packed = gzip.compress(f"{get_plotlyjs()}\n{plot}".encode(), mtime=0)
    waiting = "The drawing needs JavaScript and a browser of 2023 or later."
    return [
        element("div", waiting, id="drawing", role="img", aria_label=f"Interactive drawing of {result.title}"),
        element("script", b64encode(packed).decode("ascii"), id="packed-drawing", type="text/plain"),
        element("script", _UNPACK),
    ]


def interactive_figure(result: Result) -> Any:
    """Return the drawing as a figure of plotly, with a frame for each load step; see `interactive_elements`."""
    from plotly.graph_objects import Figure, Frame
    from plotly.subplots import make_subplots

    count = 0 if result.loading is None else len(result.loading.steps)
    steps = [result.at_step(1 + k) for k in range(count)] or [result]
    bodies = [shown(step) for step in steps]
    factor = min(map(magnification, bodies))
    parts = tuple(dict.fromkeys(part for step in steps for part in step.contact.parts))
    frames = [_traces(step, body, factor, parts) for step, body in zip(steps, bodies, strict=True)]
    n_rows = 2 if parts else 1
    figure: Figure = make_subplots(rows=n_rows, cols=1, row_heights=[0.6, 0.4][:n_rows], vertical_spacing=0.14)
    figure.add_traces(frames[-1])
    units, name = result.units, f"deformed, displacements \u00d7 {factor:g}"
    figure.update_layout(
        height=450 * n_rows, title=name, hovermode="closest", template="plotly_white", margin={"l": 70, "r": 20}
    )
    figure.update_xaxes(title=with_unit("x", "length", units), row=1, col=1)
    figure.update_yaxes(title=with_unit("y", "length", units), scaleanchor="x", row=1, col=1)
    if parts:
        labels = {Abscissa.along(step, part).label(units) for step in steps for part in step.contact.parts}
        title = labels.pop().replace("$", "") if len(labels) == 1 else with_unit("x or arc length", "length", units)
        figure.update_xaxes(title=title, row=2, col=1)
        values = np.concatenate([trace["y"] for traces in frames for trace in traces if trace["yaxis"] == "y2"])
        low, high = float(values.min()), float(values.max())
        spare = 0.05 * (high - low)
        extent = [low - spare, high + spare] if high > low else None
        figure.update_yaxes(title=with_unit("traction", "stress", units), range=extent, row=2, col=1)
    if count:
        figure.frames = [Frame(name=str(1 + k), data=traces) for k, traces in enumerate(frames)]
        figure.update_layout(sliders=[_slider(count)])
    return figure


def _slider(count: int) -> dict[str, Any]:
    options = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
    entries = [{"label": str(k), "method": "animate", "args": [[str(k)], options]} for k in range(1, 1 + count)]
    return {"active": count - 1, "currentvalue": {"prefix": "load step "}, "steps": entries, "pad": {"t": 50}}


def _traces(step: Result, bodies: DrawnScene, factor: float, parts: Sequence[str]) -> list[dict[str, Any]]:
    """Return outlines, centres of elements and, for each contact, its tractions: as many for each step."""
    boundary = table_of(step, "boundary")
    at = np.array([boundary.values("x"), boundary.values("y")])
    at += factor * np.array([boundary.values("u_x"), boundary.values("u_y")])
    initial, deformed = (_joined(loop for body in bodies.bodies for loop in body.outlines(by)) for by in (0.0, factor))
    without_hover = {"type": "scatter", "mode": "lines", "hoverinfo": "skip", "xaxis": "x", "yaxis": "y"}
    traces: list[dict[str, Any]] = [
        without_hover | _along(initial) | {"name": "initial", "line": {"color": GREY, "dash": "dash", "width": 1}},
        without_hover | _along(deformed) | {"name": "deformed", "line": {"color": BLUE}},
        _markers(at[0], at[1], _texts(boundary, step.units), "elements", "y") | {"marker": {"size": 5, "color": BLUE}},
    ]
    for part in parts:
        traces += _contact_traces(step, part)
    return traces


def _contact_traces(step: Result, part: str) -> list[dict[str, Any]]:
    """Return pressure and tangential traction along a contact, as curves and at its nodes."""
    table, rows = table_of(step, "contact"), np.flatnonzero(step.contact.rows(part))
    abscissa, along, pressure, friction = None, np.zeros(0), np.zeros(0), np.zeros(0)
    if rows.size:
        abscissa, curve = Abscissa.along(step, part), traction_curve(step, part)
        along, pressure, friction = abscissa.at(curve.s), -curve.normal, abscissa.sign * curve.tangential
    sign, nodes = (1.0, along) if abscissa is None else (abscissa.sign, abscissa.at(step.contact.s[rows]))
    heads, lines = table.columns, tuple(table.rows[row] for row in rows.tolist())
    if step.motion is not None:
        heads = (*heads, in_units(Column("slip", "m"), step))
        lines = tuple((*line, slip) for line, slip in zip(lines, step.motion.slip[rows].tolist(), strict=True))
    texts = _texts(Table(heads, lines), step.units)
    words = np.array(step.contact.status_words(), dtype=object)[rows]
    colours = [STATUS_COLOURS[word] for word in words]
    traces = []
    for name, values, at_nodes, colour in (
        ("pressure", pressure, -step.contact.sigma_n[rows], BLUE),
        ("tangential traction", friction, sign * step.contact.sigma_t[rows], VERMILION),
    ):
        curve_of = {"x": along, "y": values, "name": f"{name}, {part}", "line": {"color": colour}}
        traces.append(
            {"type": "scatter", "mode": "lines", "hoverinfo": "skip", "xaxis": "x2", "yaxis": "y2"} | curve_of
        )
        marker = {"size": 6, "color": colours, "line": {"color": colour, "width": 1}}
        traces.append(
            _markers(nodes, at_nodes, texts, f"nodes of {part}", "y2") | {"marker": marker, "showlegend": False}
        )
    return traces


def _markers(x: FloatArray, y: FloatArray, texts: Sequence[str], name: str, yaxis: str) -> dict[str, Any]:
    own = {"x": x, "y": y, "text": texts, "name": name, "xaxis": yaxis.replace("y", "x"), "yaxis": yaxis}
    return {"type": "scatter", "mode": "markers", "hovertemplate": "%{text}<extra></extra>"} | own


def _texts(table: Table, units: UnitNames | None) -> list[str]:
    """Return each row of a table as lines of names and values with units."""
    return ["<br>".join(_lines(table, row, units)) for row in table.rows]


def _lines(table: Table, row: Sequence[Any], units: UnitNames | None) -> Iterable[str]:
    for head, value in zip(table.columns, row, strict=True):
        if isinstance(value, float):
            yield f"{head.name} = {value:.4g} {'' if units is None else head.unit}".rstrip()
        elif value != "":
            yield f"{head.name} {value}".replace("&", "&amp;").replace("<", "&lt;")


def _joined(loops: Iterable[FloatArray]) -> FloatArray:
    """Return loops (n, 2) one after the other, with a gap after each."""
    return np.concatenate([np.concatenate([loop, np.full((1, 2), np.nan)]) for loop in loops])


def _along(points: FloatArray) -> dict[str, FloatArray]:
    return {"x": points[:, 0].astype(np.float32), "y": points[:, 1].astype(np.float32)}
