"""Reports: one page that needs nothing else, for every reader, and looked at in a browser where there is one."""

from __future__ import annotations

import base64
import dataclasses
import io
import shutil
import subprocess
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import matplotlib.image
import numpy as np
import pytest

import bemkit as bk
from bemkit.atomic_files import OutputFileError
from bemkit.cli.main import main
from bemkit.errors import ResultWarning
from bemkit.report.page import report, save_report
from bemkit.scene.toml import with_overrides
from tests.blank_pictures import blank_pictures
from tests.slow import slow_except

SECTIONS = "Summary, Warnings, Pictures, Forces, Certificate, Convergence, Plan, Scene, Run times, Versions".split(", ")
VOID = {"meta", "img", "br", "hr", "link"}


class Page(HTMLParser):
    """What a page consists of; fails where elements do not close."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str]]] = []
        self.open: list[str] = []
        self.texts: list[str] = []
        self.feed(text)
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, {name: value or "" for name, value in attrs}))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.texts.append(data)

    def of(self, tag: str) -> list[dict[str, str]]:
        """The attributes of all elements of a kind."""
        return [attributes for name, attributes in self.elements if name == tag]


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    scene = with_overrides(bk.load_scene("paper-1"), elements=40, discretisation="linear")
    scene = dataclasses.replace(scene, title="A <square> & 5 > 4", units=bk.UnitNames("mm", "MPa"))
    return bk.run(dataclasses.replace(scene, load_factors=(0.5, 1.0)))


@pytest.fixture(scope="module")
def text(solution: bk.Solution) -> str:
    with blank_pictures():
        return report(solution)


@pytest.fixture(scope="module")
def page(text: str) -> Page:
    return Page(text)


def test_it_needs_nothing_from_elsewhere(page: Page) -> None:
    for tag, attributes in page.elements:
        assert tag not in {"script", "link", "iframe", "object", "base"}
        for name in ("src", "href", "srcset", "action", "data"):
            assert attributes.get(name, "#").startswith(("#", "data:image/png;base64,"))
    (style,) = (text for text in page.texts if "color-scheme" in text)
    assert "url(" not in style
    assert "@import" not in style


def test_all_links_lead_somewhere_and_all_sections_are_there(page: Page, solution: bk.Solution) -> None:
    identifiers = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(set(identifiers)) == len(identifiers)
    assert [link["href"].lstrip("#") for link in page.of("a")] == identifiers
    assert [section["aria-labelledby"] for section in page.of("section")] == identifiers
    assert identifiers == [name.lower().replace(" ", "-") for name in SECTIONS]
    joined = " ".join(page.texts)
    for words in (
        "converged",
        "A <square> & 5 > 4",
        "0.5 N/mm",
        "paper",
        "foundation",
        "friction_coefficient",
        "numpy",
    ):
        assert words in joined
    assert f"{solution.certificate.worst:.2g}" in joined
    assert all(item.reason in joined for item in solution.plan.items)


def test_everyone_can_read_it(page: Page) -> None:
    """Language, names of regions, alternatives of pictures, headers of tables."""
    assert page.of("html") == [{"lang": "en"}]
    assert {"name": "viewport", "content": "width=device-width, initial-scale=1"} in page.of("meta")
    pictures = page.of("img")
    assert len(pictures) == len(page.of("figcaption")) == 9
    assert all("A <square> & 5 > 4" in picture["alt"] for picture in pictures)
    assert len({picture["alt"] for picture in pictures}) == len(pictures)
    assert len(page.of("caption")) == len(page.of("table")) >= 7
    assert all(header.get("scope") in ("row", "col") for header in page.of("th"))
    assert all("aria-label" in region for region in page.of("div") if region.get("role") == "region")
    assert [tag for tag, _ in page.elements if tag in ("h1", "h2")] == ["h1"] + ["h2"] * len(SECTIONS)


def test_doubts_and_failures_are_told(solution: bk.Solution, without: Callable[..., None]) -> None:
    without("matplotlib")
    doubted = Page(
        report(solution.with_warnings((ResultWarning("test", "", "The estimated error is 7 %: use more elements."),)))
    )
    assert "The estimated error is 7 %: use more elements." in doubted.texts
    failed = Page(report(dataclasses.replace(solution, status=bk.Status.STALLED, message="It stalled.")))
    assert {"class": "badge bad"} in failed.of("strong")
    assert " It stalled." in failed.texts


def test_scenes_with_functions_and_without_contact_have_reports() -> None:
    scene = with_overrides(bk.load_scene("bending"), elements=20)
    load = dataclasses.replace(scene.parts[1], condition=bk.Traction(x=lambda x, y: 1.0 - 2.0 * y))
    solution = bk.run(dataclasses.replace(scene, parts=(scene.parts[0], load)))
    page = Page(report(solution))
    texts = " ".join(page.texts)
    assert "The scene cannot be written as text" in texts
    assert "Tractions along the whole boundary" in texts
    for picture in page.of("img"):
        data = base64.b64decode(picture["src"].removeprefix("data:image/png;base64,"))
        drawn = matplotlib.image.imread(io.BytesIO(data))[..., :3]
        assert min(drawn.shape[:2]) > 230
        assert drawn.std() > 0.03  # not blank


def test_histories_and_several_bodies_have_reports(page: Page, without: Callable[..., None]) -> None:
    assert "Status over the time of a load history" in " ".join(page.texts)
    cylinders = bk.run(with_overrides(bk.load_scene("two-cylinders"), elements=40))
    without("matplotlib")
    page = Page(report(cylinders))
    assert "Pictures need matplotlib" in " ".join(page.texts)
    assert any("lower" in text for text in page.texts)


@pytest.mark.usefixtures("here")
def test_the_command_writes_it(
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    solution: bk.Solution,
    without: Callable[..., None],
) -> None:
    without("matplotlib")
    bk.write_result("r.h5", solution)
    for _ in range(2):  # the second replaces the first
        with pytest.raises(SystemExit, match="0"):
            main(["report", "r.h5", "-o", "r.html"])
    assert capsys.readouterr().out.split() == [str(tmp_path / "r.html")] * 2
    assert Path("r.html").read_text("utf-8") == report(bk.read_result("r.h5"))
    with pytest.raises(OutputFileError, match=r"r.pdf: a report is a page of HTML: give a name that ends in .html"):
        save_report("r.pdf", solution)
    assert not Path("r.pdf").exists()


CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
QUIET = (
    *("--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--hide-scrollbars"),
    *("--disable-background-networking", "--disable-component-update", "--disable-sync"),
)


@pytest.mark.slow
@pytest.mark.skipif(CHROMIUM is None, reason="Chromium is not installed")
@pytest.mark.parametrize("width", slow_except((500, 1200), 500), ids=["narrow", "wide"])
def test_a_browser_shows_it_in_light_and_dark(width: int, tmp_path: Path, solution: bk.Solution) -> None:
    place = tmp_path / "report.html"
    place.write_text(report(solution), encoding="utf-8")
    pictures = {}
    for scheme, number in (("light", 1), ("dark", 0)):
        target = tmp_path / f"{scheme}.png"
        options = (
            f"--user-data-dir={tmp_path / scheme}",
            f"--blink-settings=preferredColorScheme={number}",
            f"--window-size={width},2400",
            f"--screenshot={target}",
        )
        subprocess.run([str(CHROMIUM), *QUIET, *options, place.as_uri()], check=True, capture_output=True, timeout=120)
        pictures[scheme] = matplotlib.image.imread(target)[..., :3]
    for scheme, is_dark in (("light", False), ("dark", True)):
        picture = pictures[scheme]
        assert picture.shape[1] == width
        assert (picture[5, :5].mean() < 0.2) == is_dark  # the corner is bare page
        assert picture.std() > 0.05
    # nothing sticks out to the side: the right edge is bare page all the way down
    assert np.ptp(pictures["light"][:, -5:]) < 0.01
