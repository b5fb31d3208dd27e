"""Files of shapes in scene files: places, units, and scenes that need their file no more."""

from __future__ import annotations

from pathlib import Path

import pytest

import bemkit as bk
from bemkit.cli.starting_scene import starting_scene
from bemkit.errors import InputError
from bemkit.geometry.free_form.drawn import OutlineShape
from bemkit.results.result_file import read_result, write_result
from bemkit.scene.toml import SceneError, load_scene, scene_from_toml, scene_to_toml

MESH = Path(__file__).parent.parent / "geometry" / "files" / "data" / "version-4.msh"
SCENE = """
title = "Part"
shape = { kind = "mesh", file = "part.msh" }
material = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }
mesh = { elements = 40 }
[parts.floor]
sides = ["foot"]
condition = { kind = "contact", obstacle = "half-plane" }
[parts.guide]
sides = ["wall"]
condition = "roller"
[parts.load]
sides = ["side-4"]
condition = { kind = "pressure", pressure = 1.0 }
"""


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "part.msh").write_text(MESH.read_text())
    (tmp_path / "scene.toml").write_text(SCENE)
    return tmp_path


def test_names_of_files_begin_at_the_scene(folder: Path) -> None:
    assert not Path("part.msh").exists()
    scene = load_scene(folder / "scene.toml")
    assert isinstance(scene, bk.Scene)
    assert scene.shape.outline().side_names[:2] == ("foot", "wall-1")


def test_results_and_texts_need_the_file_no_more(folder: Path) -> None:
    solution = bk.run(load_scene(folder / "scene.toml"))
    assert solution.is_certified
    write_result(folder / "result.h5", solution)
    (folder / "part.msh").unlink()
    again = read_result(folder / "result.h5")
    assert isinstance(again.scene.shape, OutlineShape)
    assert scene_from_toml(scene_to_toml(again.scene)) == again.scene
    assert bk.run(again.scene).force_normal == solution.force_normal
    notes = [item.reason for item in again.plan.items if item.name == "drawn outline"]
    assert notes == ["7 sides; 3 arcs through the ends of straight pieces of the mesh"]


def test_texts_without_a_folder_name_no_files(folder: Path) -> None:
    with pytest.raises(
        SceneError, match=r"scene: shape.file: 'part.msh': a text without a folder names no files: give"
    ):
        scene_from_toml(SCENE)
    assert isinstance(scene_from_toml(SCENE, folder=folder), bk.Scene)
    exterior = SCENE.replace(
        '{ kind = "mesh", file = "part.msh" }', '{ kind = "exterior-of", shape = { kind = "mesh", file = "x.msh" } }'
    )
    with pytest.raises(SceneError, match=r"shape.shape.file: 'x.msh': a text without"):
        scene_from_toml(exterior)


def test_bodies_come_from_files(folder: Path) -> None:
    text = """
title = "Two"
mesh = { elements = 40 }
[[contacts]]
sides = ["upper.foot", "lower.top"]
[bodies.upper]
shape = { kind = "mesh", file = "part.msh" }
material = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }
[bodies.upper.parts.load]
sides = ["side-4"]
condition = { kind = "displacement", x = 0.0, y = -0.001 }
[bodies.lower]
shape = { kind = "rectangle", width = 3.0, height = 1.0, corner = [0.0, -1.0] }
material = { youngs_modulus = 1000.0, poisson_ratio = 0.3 }
[bodies.lower.parts.ground]
sides = ["bottom"]
condition = "clamped"
"""
    (folder / "two.toml").write_text(text)
    solution = bk.run(load_scene(folder / "two.toml"))
    assert solution.is_certified
    (folder / "part.msh").unlink()
    assert isinstance(scene_from_toml(scene_to_toml(solution.scene)), bk.Scene)
    with pytest.raises(SceneError, match=r"bodies.upper.shape.file: 'part.msh': a text without a folder"):
        scene_from_toml(text)


def test_unknown_sides_and_damaged_files_are_named(folder: Path) -> None:
    wrong = SCENE.replace('["foot"]', '["feet"]')
    with pytest.raises(
        SceneError, match=r"part 'floor': unknown side 'feet': the sides are wall, hole, foot, wall-1, "
    ):
        scene_from_toml(wrong, folder=folder)
    (folder / "part.msh").write_text("$MeshFormat\n4.1 0 8\n$End")
    with pytest.raises(SceneError, match=r"scene: .*part.msh: "):
        scene_from_toml(SCENE, folder=folder)


def test_another_unit_of_length_than_that_of_the_file_is_refused() -> None:
    square = (bk.LineTo((1.0, 0.0)), bk.LineTo((1.0, 1.0)), bk.LineTo((0.0, 0.0)))
    shape = OutlineShape((bk.Loop((0.0, 0.0), square),), unit="mm")
    parts = (bk.Part("held", bk.Clamped(), sides=("side-1",)),)
    for length, factor in (("m", "0.001"), ("in", "0.03937007874")):
        with pytest.raises(
            InputError,
            match=rf"units.length is '{length}', but the file .* in 'mm': give it scale = {factor}, or",
        ):
            bk.Scene(
                title="t", shape=shape, material=bk.Material(1.0, 0.3), parts=parts, units=bk.UnitNames(length, "Pa")
            )
    for units in (None, bk.UnitNames("mm", "MPa"), bk.UnitNames("furlong", "Pa")):
        assert bk.Scene(title="t", shape=shape, material=bk.Material(1.0, 0.3), parts=parts, units=units)


@pytest.mark.parametrize("turn", [0.0, 30.0, 90.0])
def test_starting_scenes_of_any_body_run_as_they_are(turn: float, folder: Path, monkeypatch) -> None:
    turned = bk.Placement(turn=turn)
    points = [(float(x), float(y)) for x, y in turned.forward(_corners())]
    shape = OutlineShape((bk.Loop(points[-1], tuple(bk.LineTo(point) for point in points)),))
    source = bk.MeshFile("part.msh", scale=2.0, only=("steel",), corner_angle=20.0)
    source.__dict__["shape"] = shape  # as if read
    text = starting_scene(source, "part.msh")
    assert 'file = "part.msh"\nscale = 2.0\nonly = ["steel"]\ncorner_angle = 20.0\n' in text
    monkeypatch.setattr(bk.MeshFile, "shape", shape)
    scene = scene_from_toml(text, folder=folder)
    solution = bk.run(scene)
    assert solution.is_certified
    assert solution.force_normal > 0.0


def _corners():
    import numpy as np

    return np.array([[3.0, 0.0], [3.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0]])
