"""The interactive page: its values are those of the result, and a browser shows them under the pointer."""

from __future__ import annotations

import dataclasses
import json
import re
import subprocess
from collections.abc import Callable
from html import unescape
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.errors import InputError
from bemkit.report.page import report, save_report
from bemkit.scene.toml import with_overrides
from tests.report.test_page import CHROMIUM, QUIET, Page

pytest.importorskip("plotly")
from bemkit.report.interactive import interactive_figure

PRESSED = """
title = "die"
mesh = { elements = 40 }
law = { kind = "coulomb", friction_coefficient = 0.3 }
[bodies.block]
shape = { kind = "rectangle", width = 1.0, height = 1.0 }
material = { youngs_modulus = 100.0, poisson_ratio = 0.3 }
parts.base = { sides = ["bottom"], condition = "clamped" }
[rigid.die]
obstacle = { kind = "circle", centre = [0.5, 1.5], radius = 0.5 }
y = -1e-4
[[contacts]]
sides = ["block.top", "die"]
"""


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    scene = with_overrides(bk.load_scene("paper-1"), elements=24)
    return bk.run(dataclasses.replace(scene, load_factors=(0.5, 1.0), units=bk.UnitNames("mm", "MPa")))


@pytest.fixture(scope="module")
def figure(solution: bk.Solution) -> Any:
    return interactive_figure(solution)


@pytest.fixture(scope="module")
def text(solution: bk.Solution) -> str:
    return report(solution, interactive=True)


def lines(text: str) -> dict[str, str]:
    """Return names and values of a text under the pointer."""
    return dict(line.split(" = ") for line in text.split("<br>") if " = " in line)


def test_texts_have_the_values_of_the_result_with_units(figure: Any, solution: bk.Solution) -> None:
    elements = next(trace for trace in figure.data if trace.name == "elements")
    assert len(elements.text) == 24
    for k, traction in enumerate(solution.boundary.traction):
        values = lines(elements.text[k])
        assert values["t_x"] == f"{traction[0]:.4g} MPa"
        assert values["t_y"] == f"{traction[1]:.4g} MPa"
        assert values["u_y"].endswith(" mm")
    nodes = [trace for trace in figure.data if trace.name.startswith("nodes of")]
    contact = solution.contact
    assert len(nodes) == 2
    np.testing.assert_array_equal(nodes[0].y, -contact.sigma_n)
    # the foundation is below and is run along x
    np.testing.assert_array_equal(nodes[1].y, contact.sigma_t)
    np.testing.assert_allclose(nodes[1].x, contact.x, atol=1e-15)  # sums of arc lengths round
    assert solution.motion is not None
    for k, text in enumerate(nodes[0].text):
        columns = {"sigma_n": "MPa", "sigma_t": "MPa", "gap": "mm", "clearance": "mm", "u_t": "mm"}
        expected = {name: f"{getattr(contact, name)[k]:.4g} {unit}" for name, unit in columns.items()}
        expected["slip"] = f"{solution.motion.slip[k]:.4g} mm"
        assert expected.items() <= lines(text).items()
        assert f"status {contact.status_words()[k]}" in text


def test_the_slider_has_an_entry_for_each_step(figure: Any, solution: bk.Solution) -> None:
    (slider,) = figure.layout.sliders
    assert [step.label for step in slider.steps] == [frame.name for frame in figure.frames] == ["1", "2"]
    for number, frame in enumerate(figure.frames, 1):
        pressure = next(trace for trace in frame.data if trace.name == "nodes of foundation")
        np.testing.assert_array_equal(pressure.y, -solution.at_step(number).contact.sigma_n)
        assert pressure.y.max() <= figure.layout.yaxis2.range[1]
    single = interactive_figure(bk.run(with_overrides(bk.load_scene("two-cylinders"), elements=40)))
    assert not single.frames
    assert not single.layout.sliders


def test_bodies_without_contact_have_one_panel() -> None:
    figure = interactive_figure(bk.run(with_overrides(bk.load_scene("bending"), elements=20)))
    assert len(figure.data) == 3
    assert len(figure.data[2].text) == 20


def named(figure: Any, name: str) -> Any:
    return next(trace for trace in figure.data if trace.name == name)


def test_obstacles_are_drawn_where_they_are(figure: Any) -> None:
    floor = named(figure, "obstacles")
    assert floor.fill == "toself"
    assert np.nanmax(floor.y) == 0.0
    low, high = figure.layout.xaxis.range
    assert np.nanmin(floor.x) < low < 0.0 < 1.0 < high < np.nanmax(floor.x)
    assert figure.layout.yaxis.scaleanchor == "x"


def test_rigid_bodies_are_drawn_where_they_move() -> None:
    """A rigid circle is pushed down into a block; displacements are drawn as large as the title states."""
    scene = bk.scene_from_toml(PRESSED)
    solution = bk.run(scene)
    figure = interactive_figure(solution)
    factor = float(figure.layout.title.text.split("\u00d7")[1])
    circle = named(figure, "rigid bodies")
    moved = solution.rigid["die"]
    assert factor > 1.0
    assert moved.y < 0.0
    points = np.stack([circle.x, circle.y], axis=1).astype(float)
    distance = np.hypot(*(points[~np.isnan(points[:, 0])] - [0.5, 1.5 + factor * moved.y]).T)
    np.testing.assert_allclose(distance, 0.5, atol=1e-6)  # single precision


def test_images_by_symmetry_have_values() -> None:
    block = bk.scene_from_toml(PRESSED).bodies[0]
    half = bk.Scene(
        title="half",
        shape=block.shape,
        material=block.material,
        parts=(*block.parts, bk.Part("load", bk.Traction(y=-1.0), ("top",), bk.Expression("abs(x - 0.5) < 0.25"))),
        symmetry=bk.Symmetry(x=0.5),
        mesh=bk.MeshOptions(elements=40),
    )
    solution = bk.run(half)
    elements = named(interactive_figure(solution), "elements")
    n = solution.mesh.n_elements
    assert len(elements.x) == len(elements.text) == 2 * n
    np.testing.assert_allclose(elements.x[n:], 1.0 - elements.x[:n], atol=1e-15)
    np.testing.assert_array_equal(elements.y[n:], elements.y[:n])
    for text, image in zip(elements.text[:n], elements.text[n:], strict=True):
        own, other = lines(text), lines(image)
        assert float(other["x"]) == pytest.approx(1.0 - float(own["x"]), abs=1e-4)  # four digits
        for name, sign in (("u_x", -1), ("t_x", -1), ("sigma_xy", -1), ("u_y", 1), ("t_y", 1), ("von_mises", 1)):
            assert float(other[name]) == sign * float(own[name])


def test_a_rough_surface_fills_the_height() -> None:
    figure = interactive_figure(bk.run(with_overrides(bk.load_scene("rough-surface"), elements=128)))
    assert figure.layout.yaxis.scaleanchor is None
    low, high = figure.layout.yaxis.range
    assert high - low < 0.05


@pytest.mark.slow
def test_a_page_of_320_elements_is_below_3_megabytes() -> None:
    scene = with_overrides(bk.load_scene("paper-1"), elements=320)
    steps = tuple(k / 10 for k in range(1, 11))
    for factors in ((1.0,), steps):
        assert len(report(bk.run(dataclasses.replace(scene, load_factors=factors)), interactive=True)) < 3_000_000


def test_the_page_loads_nothing(text: str) -> None:
    page = Page(text)
    assert not any("src" in attributes or tag == "link" for tag, attributes in page.elements)
    assert len(text) < 3_000_000


def test_the_page_needs_no_matplotlib(solution: bk.Solution, without: Callable[..., None]) -> None:
    without("matplotlib")
    assert interactive_figure(solution).data


@pytest.mark.usefixtures("here")
def test_without_plotly_a_sentence_says_what_to_install(
    solution: bk.Solution, without: Callable[..., None], capsys: pytest.CaptureFixture[str]
) -> None:
    without("plotly")
    with pytest.raises(InputError, match=r"need plotly: pip install \"bemkit\[interactive\]\""):
        save_report("r.html", solution, interactive=True)
    with pytest.raises(SystemExit, match="2"):
        main(["report", "paper-1", "--interactive"])
    assert 'pip install "bemkit[interactive]"' in capsys.readouterr().err
    assert not list(Path().iterdir())


PROBE = """
<script>
const told = {};
const pause = (time) => new Promise((resolve) => setTimeout(resolve, time));
const until = async (holds) => { for (let k = 0; k < 100 && !holds(); k++) await pause(50); };
const mouse = (target, kind, x, y) =>
  target.dispatchEvent(new MouseEvent(kind, {bubbles: true, view: window, clientX: x, clientY: y}));
(async () => {
 try {
  while (!window.isDrawn) await pause(50);
  const plot = document.getElementById("drawing");
  const layer = plot.querySelectorAll(".nsewdrag")[1];
  const box = layer.getBoundingClientRect();
  const nodes = () => plot._fullData.find((trace) => trace.name.startsWith("nodes of"));
  const {xaxis2, yaxis2} = plot._fullLayout;
  const at = [box.left + xaxis2.l2p(nodes().x[3]), box.top + yaxis2.l2p(nodes().y[3])];
  mouse(layer, "mouseover", ...at);
  mouse(layer, "mousemove", ...at);
  await until(() => plot.querySelector(".hoverlayer .hovertext"));
  told.hover = [...plot.querySelectorAll(".hoverlayer .hovertext tspan, .hoverlayer .hovertext text")].map(
    (each) => each.textContent);
  told.before = Math.max(...nodes().y);
  const rail = plot.querySelector(".slider-rail-touch-rect");
  const place = rail.getBoundingClientRect();
  mouse(rail, "mousedown", place.left + 2, place.top + place.height / 2);
  mouse(document, "mouseup", place.left + 2, place.top + place.height / 2);
  await until(() => Math.max(...nodes().y) !== told.before);
  told.after = Math.max(...nodes().y);
  told.label = plot.querySelector(".slider-label").textContent;
  told.rightmost = document.documentElement.scrollWidth;
 } catch (error) { told.error = String(error.stack); }
  const found = document.createElement("pre");
  found.id = "told";
  found.textContent = JSON.stringify(told);
  document.body.append(found);
})();
</script>
"""


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
def test_a_browser_shows_values_under_the_pointer_and_moves_the_steps(
    tmp_path: Path, text: str, solution: bk.Solution
) -> None:
    place = tmp_path / "report.html"
    place.write_text(text.replace("</body>", f"{PROBE}</body>"), encoding="utf-8")
    options = (f"--user-data-dir={tmp_path / 'user'}", "--window-size=1200,1600", "--virtual-time-budget=60000")
    command = [str(CHROMIUM), *QUIET, *options, "--dump-dom", place.as_uri()]
    shown = subprocess.run(command, check=True, capture_output=True, timeout=120, encoding="utf-8").stdout
    found = re.search(r'<pre id="told">(.*?)</pre>', shown, re.DOTALL)
    assert found is not None
    told = json.loads(unescape(found[1]))
    assert "error" not in told, told["error"]
    assert f"sigma_n = {solution.contact.sigma_n[3]:.4g} MPa" in "\n".join(told["hover"])
    assert told["before"] == -solution.contact.sigma_n.min()
    assert told["after"] == -solution.at_step(1).contact.sigma_n.min()
    assert told["label"] == "load step 1"
    assert told["rightmost"] <= 1200
