"""Pictures for print: as wide as asked, with text of one size and no title; names of sides that avoid each other."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.text import Annotation, Text

import bemkit as bk
from bemkit.geometry import Polygon
from bemkit.pictures import figures, save_pictures
from bemkit.pictures.drawing import ignore_round_off
from bemkit.pictures.outline import draw_outline
from bemkit.pictures.publication import fitted
from bemkit.scene.toml import with_overrides
from tests.slow import slow_only


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(with_overrides(bk.load_scene("paper-1"), elements=40, discretisation="linear"))


@pytest.mark.parametrize(
    ("width", "name"),
    slow_only(
        [(85.0, "deformation"), (85.0, "traction"), (170.0, "traction"), (170.0, "von-mises")],
        (85.0, "traction"),
        (170.0, "von-mises"),
        (85.0, "deformation"),
    ),
)
def test_pictures_are_as_wide_as_asked(width: float, name: str, solution: bk.Solution, tmp_path: Path) -> None:
    (path,) = save_pictures(solution, tmp_path / f"{name}.png", [name], dots_per_inch=200, width=width)
    picture = matplotlib.image.imread(path)
    assert picture.shape[1] == pytest.approx(width / 25.4 * 200, abs=1.0)  # a pixel
    assert picture[..., :3].std() > 0.03  # not blank
    (figure,) = figures(solution, [name]).values()
    assert figure.axes[0].get_title()
    box = fitted(figure, width)
    assert not figure.axes[0].get_title()
    shown = [text for text in figure.findobj(Text) if text.get_visible() and text.get_text()]
    assert {text.get_fontsize() for text in shown} == {7.0}
    tight = figure.get_tightbbox()
    assert box.x0 - 0.02 <= tight.x0  # inch: nothing is cut
    assert tight.x1 <= box.x1 + 0.02


def test_pictures_without_room_for_text_are_refused(solution: bk.Solution, tmp_path: Path) -> None:
    with pytest.raises(bk.InputError, match=r"width is 20: give 50 mm or more"):
        save_pictures(solution, tmp_path / "a.png", ["traction"], width=20)


def test_names_of_short_sides_do_not_cover_each_other() -> None:
    angle = np.linspace(-0.05, 0.05, 9)
    arc = [(float(np.cos(each)), float(np.sin(each))) for each in angle]
    axes = draw_outline(Polygon(((-1.0, -1.0), *arc, (-1.0, 1.0))).outline(), "sides")
    labels = [each for each in axes.texts if isinstance(each, Annotation) and each.get_text()]
    assert len(labels) == 11
    boxes = [label.get_window_extent() for label in labels]
    assert not any(first.overlaps(second) for first, second in combinations(boxes, 2))


def test_numbers_beside_axes_are_plain_text_below_a_power_of_ten() -> None:
    axes = Figure().add_subplot()
    axes.plot([0.0, 1.0], [-3e-5, 2e-5])
    ignore_round_off(axes, 1e-5)
    axes.get_figure().draw_without_rendering()
    texts = [label.get_text() for label in axes.get_yticklabels()]
    assert "\u22123" in texts
    assert not any("$" in text for text in texts)
    assert axes.yaxis.get_offset_text().get_text().startswith(r"$\times\mathdefault{10^{")


def test_thousands_are_written_in_full() -> None:
    axes = Figure().add_subplot()
    axes.plot([0.0, 1.0], [0.0, 2500.0])
    ignore_round_off(axes, 2500.0)
    axes.get_figure().draw_without_rendering()
    assert "2500" in [label.get_text() for label in axes.get_yticklabels()]
    assert axes.yaxis.get_offset_text().get_text() == ""
