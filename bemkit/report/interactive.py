"""A drawing to explore inside a page: bodies, obstacles, contact tractions, their values, a slider over load steps.

plotly draws it in the browser. The page holds the library, compressed, and loads nothing from elsewhere.
"""

from __future__ import annotations

import gzip
from base64 import b64encode
from collections.abc import Iterable, Mapping, Sequence
from importlib.util import find_spec
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.contact_nodes import images_of
from bemkit.pictures.drawing import BLUE, GREY, VERMILION
from bemkit.pictures.magnification import magnification
from bemkit.pictures.obstacles import fixed_obstacles, relief_frame, rigid_bodies
from bemkit.pictures.plane import joined_frame
from bemkit.pictures.shown import DrawnScene, shown
from bemkit.pictures.traction_curves import traction_curve
from bemkit.report.html import Element, element
from bemkit.results.solution import Solution
from bemkit.results.tables import in_units, table_of
from bemkit.scene.unit_names import UnitNames, with_unit
from bemkit.stopwatch import announce
from bemkit.table import Column, Table

_COMPONENTS: Mapping[str, tuple[int, ...]] = MappingProxyType(
    {"u_x": (0,), "t_x": (0,), "u_y": (1,), "t_y": (1,), "sigma_xy": (0, 1)}
)
"""Components x and y in a column: those of which an image by symmetry changes the sign."""
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
    """Raise InputError if plotly is not installed."""
    if find_spec("plotly") is None:
        raise InputError('interactive pages need plotly: pip install "bemkit[interactive]"')


def interactive_elements(result: Solution) -> list[Element]:
    """Return the drawing of a result as elements of a page.

    Parameters
    ----------
    result : Solution
        With a load history the slider has an entry for each of its steps, and the last one is shown first.

    Raises
    ------
    InputError
        If plotly is not installed.
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


def interactive_figure(result: Solution) -> Any:
    """Return the drawing as a figure of plotly, with a frame for each load step; see `interactive_elements`."""
    from plotly.graph_objects import Figure, Frame
    from plotly.subplots import make_subplots

    steps = result.each_step()
    bodies = [shown(step) for step in steps]
    factor = min(map(magnification, bodies))
    parts = tuple(dict.fromkeys(part for step in steps for part in step.contact.parts))
    relief = relief_frame(bodies[-1], factor)
    frame = _with_margin(_frame(bodies, factor) if relief is None else relief)
    frames = [
        [*_obstacle_traces(body, factor, frame), *_traces(step, body, factor, parts)]
        for step, body in zip(steps, bodies, strict=True)
    ]
    n_rows = 2 if parts else 1
    figure: Figure = make_subplots(rows=n_rows, cols=1, row_heights=[0.6, 0.4][:n_rows], vertical_spacing=0.14)
    figure.add_traces(frames[-1])
    units, name = result.units, f"deformed, displacements \u00d7 {factor:g}"
    figure.update_layout(
        height=450 * n_rows, title=name, hovermode="closest", template="plotly_white", margin={"l": 70, "r": 20}
    )
    along_x, along_y = frame.tolist()
    figure.update_xaxes(title=with_unit("x", "length", units), range=along_x, row=1, col=1)
    equal = "x" if relief is None else None
    figure.update_yaxes(title=with_unit("y", "length", units), range=along_y, scaleanchor=equal, row=1, col=1)
    if parts:
        labels = {Abscissa.along(step, part).label(units) for step in steps for part in step.contact.parts}
        title = labels.pop().replace("$", "") if len(labels) == 1 else with_unit("x or arc length", "length", units)
        figure.update_xaxes(title=title, row=2, col=1)
        values = np.concatenate([trace["y"] for traces in frames for trace in traces if trace["yaxis"] == "y2"])
        low, high = float(values.min()), float(values.max())
        spare = 0.05 * (high - low)
        extent = [low - spare, high + spare] if high > low else None
        figure.update_yaxes(title=with_unit("traction", "stress", units), range=extent, row=2, col=1)
    if result.loading is not None:
        figure.frames = [Frame(name=str(1 + k), data=traces) for k, traces in enumerate(frames)]
        figure.update_layout(sliders=[_slider(len(steps))])
    return figure


def _slider(count: int) -> dict[str, Any]:
    options = {"mode": "immediate", "frame": {"duration": 0, "redraw": True}, "transition": {"duration": 0}}
    entries = [{"label": str(k), "method": "animate", "args": [[str(k)], options]} for k in range(1, 1 + count)]
    return {"active": count - 1, "currentvalue": {"prefix": "load step "}, "steps": entries, "pad": {"t": 50}}


def _traces(step: Solution, bodies: DrawnScene, factor: float, parts: Sequence[str]) -> list[dict[str, Any]]:
    """Return outlines, centres of elements, also of images by symmetry, and tractions of each contact."""
    boundary = _with_images(table_of(step, "boundary"), step)
    at = np.array([boundary.values("x"), boundary.values("y")])
    at += factor * np.array([boundary.values("u_x"), boundary.values("u_y")])
    initial, deformed = (_joined(loop for body in bodies.bodies for loop in body.outlines(by)) for by in (0.0, factor))
    traces: list[dict[str, Any]] = [
        _line(initial, "initial", {"color": GREY, "dash": "dash", "width": 1}),
        _line(deformed, "deformed", {"color": BLUE}),
        _markers(at[0], at[1], _texts(boundary, step.units), "elements", "y") | {"marker": {"size": 5, "color": BLUE}},
    ]
    for part in parts:
        traces += _contact_traces(step, part)
    return traces


def _frame(steps: Sequence[DrawnScene], factor: float) -> FloatArray:
    """Return the frame (2, 2) [m] of all bodies, elastic and rigid, in all steps; unbounded bodies are cut."""
    widest = steps[0].frame + 0.5 * np.ptp(steps[0].frame, axis=1).max() * np.array([-1.0, 1.0])
    loops = [loop for step in steps for body in step.bodies for loop in body.outlines(factor)]
    for step in steps:
        for _, before, moved in rigid_bodies(step, factor, widest):
            loops += [np.clip(loop, widest[:, 0], widest[:, 1]) for loop in (*before, *moved)]
    return joined_frame(steps[0].frame.T, *loops)


def _with_margin(frame: FloatArray) -> FloatArray:
    return np.asarray(frame + 0.06 * np.ptp(frame, axis=1)[:, None] * np.array([-1.0, 1.0]))


def _obstacle_traces(bodies: DrawnScene, factor: float, frame: FloatArray) -> list[dict[str, Any]]:
    """Return the obstacles and the rigid bodies of a scene, if it has any, filled."""
    fixed = [loop for loops, _ in fixed_obstacles(bodies, frame) for loop in loops]
    rigid = [loop for _, _, moved in rigid_bodies(bodies, factor, frame) for loop in moved]
    named, filled = {"obstacles": fixed, "rigid bodies": rigid}, {"fill": "toself", "fillcolor": "#EDEDED"}
    edge = {"color": "#555555", "width": 1}
    return [_line(_joined(loops), name, edge) | filled for name, loops in named.items() if loops]


def _with_images(boundary: Table, step: Solution) -> Table:
    """Return the table of elements with the images by symmetry of those of each body."""
    columns = {head.name: np.array(boundary.values(head.name)) for head in boundary.columns}
    tables, first = [], 0
    for body in step.bodies.values():
        rows, first = slice(first, first + body.mesh.n_elements), first + body.mesh.n_elements
        own = {name: column[rows] for name, column in columns.items()}
        tables.append(own)
        for image, places in images_of(body.mesh.symmetry, np.stack([own["x"], own["y"]], axis=1)):
            signs = {name: image[list(components)].prod() for name, components in _COMPONENTS.items()}
            reflected = {name: sign * own[name] for name, sign in signs.items()}
            tables.append(own | {"x": places[:, 0], "y": places[:, 1]} | reflected)
    return Table.from_arrays(
        boundary.columns, {name: np.concatenate([each[name] for each in tables]) for name in columns}
    )


def _contact_traces(step: Solution, part: str) -> list[dict[str, Any]]:
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
        traces.append(_line(np.stack([along, values], axis=1), f"{name}, {part}", {"color": colour}, "2"))
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


def _line(points: FloatArray, name: str, style: dict[str, Any], panel: str = "") -> dict[str, Any]:
    """Return the trace of a line through points (n, 2), without texts under the pointer."""
    x, y = points.astype(np.float32).T
    own = {"x": x, "y": y, "name": name, "line": style, "xaxis": f"x{panel}", "yaxis": f"y{panel}"}
    return {"type": "scatter", "mode": "lines", "hoverinfo": "skip"} | own
