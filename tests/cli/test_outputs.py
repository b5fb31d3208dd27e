"""Outputs of commands: endings, exit codes and names that once were wrong."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from pathlib import Path

import h5py
import pytest

import bemkit as bk
from bemkit.cli.main import main
from bemkit.reference import find_reference
from tests.sealed import seal

pytestmark = pytest.mark.usefixtures("here")
SMALL = ("--elements", "24", "--discretisation", "linear")


def call(*arguments: str) -> int:
    with pytest.raises(SystemExit) as caught:
        main(list(arguments))
    return caught.value.code


@pytest.mark.slow
def test_the_animation_may_be_named_where_pictures_are(capsys) -> None:
    assert call("run", "paper-1", *SMALL, "-q", "--plot", "figures", "--what", "moonlight") == 2
    assert "moonlight" in capsys.readouterr().err
    assert call("run", "paper-1", *SMALL, "-q", "--plot", "figures", "--what", "animation,contacts", "-o", "r.h5") == 0
    assert sorted(path.name for path in Path("figures").iterdir()) == ["animation.gif", "contacts.png"]
    assert call("show", "r.h5", "--plot", "shown", "--what", "animation") == 0
    assert [path.name for path in Path("shown").iterdir()] == ["animation.gif"]


def test_result_files_with_the_long_ending_are_cited(capsys) -> None:
    assert call("run", "paper-1", *SMALL, "-q", "-o", "r.hdf5") == 0
    assert call("cite", "r.hdf5") == 0
    assert "Hinterm" in capsys.readouterr().out


@pytest.mark.usefixtures("undrawn")
def test_report_and_plot_have_the_exit_code_of_run(without: Callable[..., None]) -> None:
    solution = bk.run(dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=24)))
    bk.write_result("good.h5", solution)
    bk.write_result("bad.h5", dataclasses.replace(solution, status=bk.Status.STALLED))
    assert call("plot", "good.h5", "--what", "traction", "-q") == 0
    assert call("plot", "bad.h5", "--what", "traction", "-q") == 1
    without("matplotlib")
    assert call("report", "good.h5", "-o", "r.html", "-q") == 0
    assert call("report", "bad.h5", "-o", "r.html", "-q") == 1


@pytest.mark.slow
def test_the_animation_of_a_history_that_fails_has_its_exit_code(capsys) -> None:
    """All of its finished steps are right."""
    parts = (
        bk.Part("floor", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
        bk.Part("top", bk.Traction(y=-1.0), sides=("top",)),
    )
    slides = bk.Step(2.0, {"parts.top.condition.x": 0.9})
    scene = bk.Scene(
        title="slides", shape=bk.Rectangle(1.0, 1.0), material=bk.Material(1e4, 0.2), law=bk.Coulomb(0.5), parts=parts,
        mesh=bk.MeshOptions(elements=16), steps=(bk.Step(1.0), slides),
    )  # fmt: skip
    bk.write_result("bad.h5", bk.run(scene))
    assert call("plot", "bad.h5", "-o", "a.gif", "-q") == 1
    assert "unsolvable_load" in capsys.readouterr().err


def test_a_reference_belongs_to_a_scene_whatever_its_units_and_linear_solver() -> None:
    scene = bk.load_scene("wavy-obstacle")
    assert find_reference(dataclasses.replace(scene, linear_solver=bk.DenseCholesky())) is not None
    units = bk.UnitNames(length="mm", stress="MPa")
    assert find_reference(dataclasses.replace(scene, units=units)) is not None


def test_a_report_shows_the_versions_in_its_file(without: Callable[..., None]) -> None:
    without("matplotlib")
    call("run", "paper-1", *SMALL, "-q", "-o", "r.h5")
    with h5py.File("r.h5", "r+") as file:
        file["provenance"].attrs["numpy"] = "0.9.8"
    seal(Path("r.h5"))
    assert call("report", "r.h5", "-o", "r.html", "-q") == 0
    assert "0.9.8" in Path("r.html").read_text("utf-8")


@pytest.mark.parametrize(
    "command",
    [
        ("sweep", "paper-1", "--elements", "24", "--vary", "law.friction_coefficient=0.1,0.2"),
        pytest.param(("verify", "westergaard", "--quick"), marks=pytest.mark.slow, id="verify"),
        pytest.param(
            ("stability", "paper-1", "--elements", "24", "--axis", "aspect-ratio"),
            marks=pytest.mark.slow,
            id="stability",
        ),
        pytest.param(
            (
                "study",
                "paper-1",
                "--sizes",
                "12",
                "--discretisations",
                "linear",
                "--meshes",
                "uniform",
                "--repeat",
                "1",
            ),
            marks=pytest.mark.slow,
            id="study",
        ),
    ],
    ids=lambda command: command[0],
)
def test_the_output_of_a_study_obeys_its_ending(command, capsys) -> None:
    call(*command, "-q", "-o", "rows.csv")
    lines = Path("rows.csv").read_text().splitlines()
    assert len(lines) > 1
    assert lines[0].count(",") == len(lines[0].split(",")) - 1 > 4
    call(*command, "-q", "-o", "rows.jsonl")
    assert Path("rows.jsonl").read_text().startswith('{"format": "bemkit-')
    assert call(*command, "-q", "-o", "rows.xyz") == 2
    assert "the ending '.xyz' names no format of tables" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("option", "name", "ending"),
    [("--csv", "scene.toml", ".csv"), ("--csv", "r.H5", ".csv"), ("--json", "r.csv", ".json")],
)
def test_a_text_takes_no_name_of_another_kind_of_file(option: str, name: str, ending: str, capsys) -> None:
    Path(name).write_text("kept")
    assert call("run", "paper-1", *SMALL, option, name) == 2
    assert (
        f"{name} has the ending of another kind of file: give a name that ends in {ending}" in capsys.readouterr().err
    )
    assert Path(name).read_text() == "kept"


def test_a_result_is_not_replaced_by_a_table_and_the_sweep_does_not_begin(capsys, caplog) -> None:
    assert call("run", "paper-1", *SMALL, "-q", "-o", "r.h5") == 0
    caplog.set_level("DEBUG", "bemkit.progress")
    caplog.clear()
    assert call("sweep", "paper-1", *SMALL, "--vary", "law.friction_coefficient=0.1", "-q", "-o", "r.h5") == 2
    assert "r.h5: exists and is not a bemkit table: choose another name" in capsys.readouterr().err
    assert not caplog.records
