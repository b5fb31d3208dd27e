"""What notebooks show: tables and pictures of values, and the tutorial, executed."""

from __future__ import annotations

import dataclasses
import os
from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path

import pytest

import bemkit as bk
from bemkit.errors import ResultWarning
from bemkit.report.notebook import notebook_html
from bemkit.scene.toml import with_overrides
from tests.report.test_page import Page

NOTEBOOKS = sorted((Path(__file__).parents[2] / "docs" / "tutorials").glob("*.ipynb"))


def test_results_scenes_and_plans_show_a_table_and_a_picture() -> None:
    scene = with_overrides(bk.load_scene("paper-1"), elements=24)
    solution = bk.run(scene)
    several = bk.load_scene("two-cylinders")
    for value, words in (
        (solution, ("converged", "contact nodes", "24 (constant)")),
        (scene, ("Rectangle", "Coulomb(friction_coefficient=0.5)", "24 elements")),
        (several, ("bodies", "2", "contacts")),
    ):
        html = value._repr_html_()
        page = Page(html)
        assert all(word in page.texts for word in words)
        (picture,) = page.of("img")
        assert value.title in picture["alt"]
        assert len(html) < 150_000
    plan = Page(solution.plan._repr_html_())
    assert all(item.reason in plan.texts for item in solution.plan.items)
    assert not plan.of("img")


@pytest.mark.usefixtures("undrawn")
def test_load_steps_show_a_table_of_the_first_and_last_and_the_friction_loop(without: Callable[..., None]) -> None:
    scene = dataclasses.replace(with_overrides(bk.load_scene("paper-1"), elements=24), load_factors=(0.5, 1.0))
    steps = bk.run([scene])
    few = Page(steps._repr_html_())
    assert "Load steps" in few.texts
    assert len(few.of("tr")) == 1 + 2
    assert len(few.of("img")) == 2
    assert len(Page(steps[-1]._repr_html_()).of("img")) == 2
    without("matplotlib")
    many = Page(type(steps)(steps * 10)._repr_html_())
    assert "The first and the last of 20 load steps" in many.texts
    assert len(many.of("tr")) == 1 + 12


def test_doubts_are_shown() -> None:
    solution = bk.run(with_overrides(bk.load_scene("paper-1"), elements=24))
    doubted = solution.with_warnings((ResultWarning("test", "", "Something is doubtful."),))
    assert "Something is doubtful." in Page(doubted._repr_html_()).texts


def test_a_scene_that_cannot_be_divided_says_why_it_has_no_picture(without: Callable[..., None]) -> None:
    scene = bk.load_scene("paper-1")
    far = bk.Part("far", bk.Clamped(), where=bk.Expression("x > 5"))
    texts = " ".join(Page(dataclasses.replace(scene, parts=(*scene.parts, far))._repr_html_()).texts)
    assert "No picture: " in texts
    assert "far" in texts
    without("matplotlib")
    assert not Page(scene._repr_html_()).of("img")


def test_other_values_show_their_repr() -> None:
    assert notebook_html(3) == "<pre>3</pre>"


@pytest.mark.slow
@pytest.mark.skipif(
    find_spec("nbclient") is None or find_spec("ipykernel") is None, reason="nbclient and ipykernel are not installed"
)
@pytest.mark.filterwarnings("default")  # of the kernel's own packages
@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_tutorials_run_from_beginning_to_end(path: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.setenv(
        "PYTHONPATH", os.pathsep.join([str(Path(bk.__file__).parents[1]), os.environ.get("PYTHONPATH", "")])
    )
    notebook = nbformat.read(path, as_version=4)
    assert all(not cell.get("outputs") for cell in notebook.cells), "outputs are made by who reads it"
    NotebookClient(notebook, timeout=300, resources={"metadata": {"path": str(tmp_path)}}).execute()
    shown = [output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", [])]
    assert any("text/html" in data for data in shown)


def test_there_is_a_tutorial() -> None:
    assert NOTEBOOKS
