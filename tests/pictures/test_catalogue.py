"""Pictures by name and in files: complete, and refused where there are none."""

from __future__ import annotations

import dataclasses
import logging
from collections.abc import Callable
from pathlib import Path

import matplotlib.image
import pytest

import bemkit as bk
from bemkit.atomic_files import OutputFileError
from bemkit.cli.main import main
from bemkit.pictures import figures, save_pictures
from bemkit.pictures.catalogue import PICTURES, default_pictures
from bemkit.pictures.figure_files import check_figure_folder
from bemkit.results.solution import Solution
from bemkit.scene.toml import scene_to_toml, with_overrides
from tests.runs.masonry import wall
from tests.slow import slow_except

HISTORY = ["friction-loop", "work", "status-over-time"]
DEFAULT = ["deformation", "displacement", "traction", "status", "von-mises"]


@pytest.fixture(scope="module")
def solution() -> Solution:
    return bk.run(with_overrides(bk.load_scene("paper-1"), elements=40, discretisation="linear"))


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as ended:
        main([*arguments])
    return int(ended.value.code or 0)


@pytest.mark.parametrize(
    "names",
    [
        pytest.param([name for name in PICTURES if name not in HISTORY], marks=pytest.mark.slow),
        pytest.param(["traction", "convergence"], marks=pytest.mark.slow),
    ],
    ids=["all", "of every kind"],
)
def test_pictures_are_complete(names: list[str], solution: Solution, tmp_path: Path) -> None:
    paths = save_pictures(solution, tmp_path, names, dots_per_inch=70)
    assert sorted(path.stem for path in paths) == sorted(names)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(f"{name}.png" for name in names)
    for path in paths:
        picture = matplotlib.image.imread(path)
        assert min(picture.shape[:2]) > 230
        assert picture[..., :3].std() > 0.03  # not blank
    again = save_pictures(solution, tmp_path, names[:1], dots_per_inch=70)  # replaced
    assert again == paths[:1]


@pytest.mark.slow
def test_any_title_is_drawn_as_it_is(solution: Solution, tmp_path: Path) -> None:
    scene = dataclasses.replace(solution.scene, title="costs $5 and \\frac{ more_ than $")
    names = ["deformation", "zoom", "contacts", "traction", "friction-cone", "stress-xy", "convergence"]
    assert len(save_pictures(dataclasses.replace(solution, scene=scene), tmp_path, names, dots_per_inch=40)) == 7


def test_what_suits_a_result_is_drawn_where_nothing_is_named(solution: Solution) -> None:
    assert [picture.name for picture in default_pictures(solution)] == DEFAULT
    several = bk.run(with_overrides(bk.load_scene("two-cylinders"), elements=60))
    names = [picture.name for picture in default_pictures(several)]
    assert names == ["deformation", "zoom", "contacts", *DEFAULT[1:]]


def test_pictures_of_several_contacts_are_numbered(solution: Solution) -> None:
    blocks = bk.run(wall(2, 1, push=True))
    drawn = figures(blocks, ["friction-cone"])
    assert len(blocks.contact.parts) > 1
    assert list(drawn) == [f"friction-cone-{number}" for number in range(1, len(blocks.contact.parts) + 1)]


@pytest.mark.parametrize(
    ("name", "scene", "message"),
    [
        ("tractoin", "paper-1", r"'tractoin' is not a picture: .*did you mean 'traction'\?"),
        ("zoom", "bending", "there is no picture 'zoom' of .*: nothing is in contact"),
        ("work", "paper-1", "it has no load history"),
        ("boundary-traction", "two-cylinders", "it shows one body, and there are several"),
    ],
)
def test_pictures_that_do_not_exist_are_refused(name: str, scene: str, message: str) -> None:
    with pytest.raises(bk.InputError, match=message):
        figures(bk.run(with_overrides(bk.load_scene(scene), elements=40)), [name])
    with pytest.raises(bk.InputError, match="steps is empty"):
        save_pictures([], "figures")


@pytest.mark.parametrize("ending", slow_except((".png", ".svg", ".pdf"), ".svg"))
def test_one_picture_goes_into_a_file(solution: Solution, ending: str, tmp_path: Path) -> None:
    place = tmp_path / f"t{ending}"
    assert save_pictures(solution, place, ["traction"]) == (place,)
    first = place.read_bytes()
    save_pictures(solution, place, ["traction"])
    assert len(place.read_bytes()) == pytest.approx(len(first), rel=0.01)
    with pytest.raises(OutputFileError, match="one file takes one picture: name one, or give a folder"):
        save_pictures(solution, place)


def test_places_that_take_no_pictures_are_refused(solution: Solution, tmp_path: Path) -> None:
    (tmp_path / "file").write_text("mine", "utf-8")
    with pytest.raises(OutputFileError, match="exists and is not a folder"):
        save_pictures(solution, tmp_path / "file")
    with pytest.raises(OutputFileError, match=r"only the picture 'animation' can be written to \.gif or \.mp4"):
        save_pictures(solution, tmp_path / "a.gif", ["traction"])


def test_matplotlib_that_is_missing_is_told(solution: Solution, tmp_path: Path, without: Callable[..., None]) -> None:
    without("matplotlib")
    with pytest.raises(OutputFileError, match='figures need matplotlib: pip install "bemkit'):
        save_pictures(solution, tmp_path)


@pytest.mark.usefixtures("here", "undrawn")
def test_the_command_draws_results_and_scenes(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert call("run", "paper-1", "--elements", "40", "-q", "-o", "r.h5", "--plot", "p", "--what", "traction") == 0
    assert [path.name for path in Path("p").iterdir()] == ["traction.png"]
    assert call("plot", "r.h5", "--what", "friction-cone, zoom", "-o", "q") == 0
    assert sorted(path.name for path in Path("q").iterdir()) == ["friction-cone.png", "zoom.png"]
    assert capsys.readouterr().out.split() == [str(tmp_path / "q" / name) for name in ("friction-cone.png", "zoom.png")]
    scene = dataclasses.replace(with_overrides(bk.load_scene("paper-1"), elements=24), load_factors=(0.5, 1.0))
    Path("s.toml").write_text(scene_to_toml(scene), encoding="utf-8")
    assert call("plot", "s.toml", "--what", "status-over-time", "-o", "h") == 0
    assert [path.name for path in Path("h").iterdir()] == ["status-over-time.png"]
    assert call("run", "s.toml", "-o", "s.h5", "-q") == 0
    assert call("plot", "s.h5", "-o", "again.gif", "-q") == 0
    assert Path("again.gif").read_bytes().startswith(b"GIF8")
    assert call("plot", "r.h5", "-o", "none.gif") == 2
    assert "r.h5: the result has no load steps: give a scene with [[steps]] or load_factors" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("plot", "paper-1", "--what", "tension"), "'tension' is not a picture: choose from deformation, zoom"),
        (("plot", "nothing.h5"), "nothing.h5"),
        (("plot", "paper-1", "-o", "x.png"), "one file takes one picture"),
        (("plot", "paper-1", "-o", "x.PNG"), "one file takes one picture"),
        (("plot", "paper-1", "--what", "traction", "-o", "x.jpg"), "x.jpg: the ending '.jpg' is that of a file: give"),
        (("run", "paper-1", "--plot", "x.png"), "x.png: the ending '.png' is that of a file: give a folder, or for"),
        (("run", "paper-1", "--plot", "no/figures"), "no/figures: the folder"),
        (("run", "paper-1", "--what", "traction"), "--what names figures: add --plot DIR"),
        (("run", "paper-1", "--plot", "p", "--what", "tension"), "'tension' is not a picture"),
    ],
)
@pytest.mark.usefixtures("here")
def test_the_command_refuses_before_anything_is_solved(
    arguments: tuple[str, ...], message: str, tmp_path: Path, caplog: pytest.LogCaptureFixture,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    with caplog.at_level(logging.DEBUG, "bemkit.progress"):
        assert call(*arguments) == 2
    assert not caplog.records  # of a run
    assert message in capsys.readouterr().err
    assert not list(tmp_path.iterdir())


def test_the_help_lists_all_pictures(capsys: pytest.CaptureFixture[str]) -> None:
    assert call("plot", "--help") == 0
    shown = capsys.readouterr().out
    assert all(f"  {name} " in shown for name in (*PICTURES, "animation"))


def test_a_folder_may_have_a_dot_in_its_name(tmp_path: Path) -> None:
    check_figure_folder(tmp_path / "run.final")
    assert not list(tmp_path.iterdir())
