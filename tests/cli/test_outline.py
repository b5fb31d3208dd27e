"""bemkit outline, and three commands from a file to a picture."""

from __future__ import annotations

import json
import shlex
from pathlib import Path

import click
import pytest
from click.testing import CliRunner, Result

from bemkit.cli.main import _run_to_end, commands
from bemkit.cli.options import names_of
from bemkit.errors import GeometryError
from bemkit.geometry.files.gmsh_files import why_no_gmsh
from tests.geometry.files.parts import DATA, MESHES, PART_DXF, PART_SVG, dxf, line, needs_ezdxf, why_no
from tests.slow import slow_except

FILES = (*MESHES, "part.dxf", "part.svg")


def put(folder: Path, name: str) -> None:
    """Put a file of the part into a folder, or skip for want of a package."""
    reasons = {"part.geo": why_no_gmsh(), "saveall.msh": why_no_gmsh()}
    reasons |= {"part.dxf": why_no("ezdxf"), "part.svg": why_no("svgpathtools")}
    if reasons.get(name):
        pytest.skip(reasons[name])
    texts = {"part.dxf": dxf(*PART_DXF, unit=4), "part.svg": PART_SVG}
    (folder / name).write_text(texts[name] if name in texts else (DATA / name).read_text())


def call(*arguments: str) -> Result:
    return CliRunner().invoke(commands, arguments, catch_exceptions=False)


@pytest.mark.parametrize("name", slow_except(FILES, "version-4.msh"))
@pytest.mark.usefixtures("here")
def test_from_a_file_to_a_picture(name: str, tmp_path) -> None:
    put(tmp_path, name)
    only = ["--only", "part"] if name == "part.svg" else []
    shown = call("outline", name, *only, "-o", "scene.toml", "--plot", "figures")
    assert shown.exit_code == 0
    assert "outer" in shown.output
    assert "hole 1" in shown.output
    assert Path("figures/outline.png").stat().st_size > 5000
    solved = call(
        "run",
        "scene.toml",
        "--plot",
        "figures",
        "--what",
        "deformation",
        "--json",
        "result.json",
        "-q",
        "--elements",
        "80",
    )
    assert solved.exit_code == 0
    assert json.loads(Path("result.json").read_text())["certified"]
    assert Path("figures/deformation.png").stat().st_size > 5000
    assert "about 30 by 15 mm" in call("outline", "scene.toml").output if only else True


def test_sides_lengths_and_notes_are_shown(tmp_path) -> None:
    put(tmp_path, "version-2.msh")
    lines = call("outline", str(tmp_path / "version-2.msh")).output.splitlines()
    assert lines[2].split() == ["outer", "foot", "line", "3", "(0,", "0)"]
    assert lines[3].split()[:5] == ["outer", "wall-1", "wall", "line", "1"]
    assert lines[4].split()[:4] == ["outer", "side-3", "arc", "0.785398"]
    assert lines[-1] == "note: 3 arcs through the ends of straight pieces of the mesh"


def test_the_sides_of_a_scene_that_comes_with_bemkit_are_shown() -> None:
    shown = call("outline", "paper-1")
    assert shown.exit_code == 0
    assert all(side in shown.output for side in ("bottom", "right", "top", "left"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["part.msh"], "part.msh: no such file: give the path of a mesh or drawing"),
        (["part.dxf", "--corner-angle", "5"], "--corner-angle is for meshes"),
        (["part.msh", "--tolerance", "5"], "--tolerance is for drawings"),
        (["scene.toml", "--scale", "5"], "a scene file says how its shape is read"),
        (["part.msh", "--scale", "-1"], "file: scale is -1.0: give a positive"),
        (["version-4.msh", "-o", "no/notes.txt"], "does not exist: create it first"),
    ],
)
@pytest.mark.usefixtures("here")
def test_refused_in_one_line(arguments: list[str], message: str, tmp_path, capsys) -> None:
    put(tmp_path, "version-4.msh")
    Path("notes.txt").write_text("mine")
    assert _run_to_end(["outline", *arguments]) == 2
    error = capsys.readouterr().err
    assert message in error
    assert error.count("\n") == 1
    assert Path("notes.txt").read_text() == "mine"


def test_names_are_given_with_commas_or_one_by_one() -> None:
    read = list[tuple[str, ...]]()

    @click.command()
    @click.option("--only", multiple=True, callback=names_of)
    def command(only: tuple[str, ...]) -> None:
        read.append(only)

    for arguments in (["--only", "a, b,c"], ["--only", "a", "--only", "b,c"], []):
        command.main(arguments, standalone_mode=False)
    assert read == [("a", "b", "c"), ("a", "b", "c"), ()]


@needs_ezdxf
@pytest.mark.usefixtures("here")
def test_the_remedy_for_open_lines_works() -> None:
    """The message names two layers that close together; its option is accepted as it is printed."""
    square = [(0, 0, 1, 0), (1, 0, 1, 1), (1, 1, 0, 1), (0, 1, 0, 0)]
    halves = [line("LEFT" if k > 1 else "RIGHT", *ends) for k, ends in enumerate(square)]
    Path("axis.dxf").write_text(dxf(*halves, line("AXIS", -1, 0.5, 2, 0.5)))
    with pytest.raises(GeometryError, match="without the lines of 'AXIS' the outline is closed") as caught:
        call("outline", "axis.dxf")
    option = shlex.split(str(caught.value).split(" or ")[-1])
    assert option == ["--only", "LEFT,RIGHT"]
    assert call("outline", "axis.dxf", *option).exit_code == 0
