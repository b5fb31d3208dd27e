"""The thickness of a scene: forces on it in N instead of per unit of thickness, given and in every output."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from click.testing import CliRunner

import bemkit as bk
from bemkit.cli.main import commands
from bemkit.scene.load_history import with_scaled_loads
from bemkit.scene.unit_names import is_force
from bemkit.testing import check_solution

THICKNESS = 8.0
UNITS = bk.UnitNames("mm", "MPa")
STEEL = bk.Material(1e4, 0.3)
MESH = bk.MeshOptions(elements=24)


def pressed(force: bk.Force) -> bk.Scene:
    """Return a block that a force presses on a rigid floor, in two steps."""
    floor = bk.Contact(bk.RigidHalfPlane((0.0, 0.0), (0.0, 1.0)))
    return bk.Scene(
        title="Pressed",
        shape=bk.Rectangle(2.0, 1.0),
        material=STEEL,
        parts=(bk.Part("floor", floor, ("bottom",)), bk.Part("top", force, ("top",))),
        law=bk.Coulomb(0.08),
        steps=(bk.Step(1.0, load_factor=0.5), bk.Step(2.0, load_factor=1.0)),
        mesh=MESH,
    )


def punched(factor: float) -> bk.Scene:
    """Return a block below a rigid punch that a force and a moment drive."""
    scene = bk.load_scene("tilted-punch")
    rigid = tuple(body.multiplied(np.ones(3), np.full(3, factor)) for body in scene.rigid)
    return replace(scene, rigid=rigid, mesh=MESH)


def half_plane(factor: float) -> bk.Scene:
    """Return a half-plane that a force far away presses against a circle."""
    scene = bk.load_scene("cylinder-on-half-plane")
    far = None if scene.far is None else scene.far.multiplied(np.ones(3), np.full(3, factor))
    return replace(scene, far=far, mesh=MESH)


SCENES: dict[str, Callable[[float], bk.Scene]] = {
    "history": lambda factor: pressed(bk.Force(0.3 * factor, -4.0 * factor, 0.2 * factor)),
    "rigid body": punched,
    "half-plane": half_plane,
}


@pytest.mark.parametrize("name", SCENES)
def test_forces_are_those_on_the_thickness(name: str) -> None:
    plane, thick = SCENES[name](1.0), replace(SCENES[name](THICKNESS), thickness=THICKNESS)
    one, all_of_it = bk.run(plane), bk.run(thick)
    close = {"rtol": 1e-9, "atol": 1e-12}  # loads are multiplied and divided by the thickness: round-off
    for fields in ("sigma_n", "sigma_t", "u_n", "u_t"):
        np.testing.assert_allclose(getattr(all_of_it.contact, fields), getattr(one.contact, fields), **close)
    np.testing.assert_allclose(all_of_it.body.boundary.reaction, THICKNESS * one.body.boundary.reaction, **close)
    summary, expected = all_of_it.summary(), one.summary()
    assert summary["thickness"] == THICKNESS
    assert expected["thickness"] is None
    assert_times_thickness(summary, expected, ("force_normal", "force_tangential", "energy"))
    forces = ("force_x", "force_y", "moment")
    for key, names in (
        ("parts", forces),
        ("contacts", (*forces, "force_normal", "force_tangential")),
        ("steps", ("external_work", "elastic_energy", "dissipation", "increment_work", "force_normal")),
    ):
        assert len(summary[key]) == len(expected[key])
        for row, own in zip(summary[key], expected[key], strict=True):
            assert_times_thickness(row, own, names)
    assert name != "history" or max(step["dissipation"] for step in expected["steps"]) > 0.0
    for body in summary["rigid"]:
        assert_times_thickness(summary["rigid"][body], expected["rigid"][body], forces)
        assert summary["rigid"][body]["turn"] == pytest.approx(expected["rigid"][body]["turn"], rel=1e-9)
    for contact, own in zip(summary["contacts"], expected["contacts"], strict=True):
        for key in ("contact_length", "peak_pressure", "largest_slip"):
            assert contact[key] == pytest.approx(own[key], rel=1e-9, abs=1e-12)
    assert summary["estimated_error"] == pytest.approx(expected["estimated_error"], rel=1e-6)
    if name != "history":  # whose slip needs the step before
        check_solution(all_of_it)


def assert_times_thickness(row: dict, own: dict, names: tuple[str, ...]) -> None:
    size = max(abs(own[name]) for name in names)
    for name in names:
        # in a balance of works, which differences of large terms give, round-off is relative to the largest term
        assert row[name] == pytest.approx(THICKNESS * own[name], rel=1e-9, abs=1e-9 * size), name


def test_a_file_gives_the_thickness_and_forces_in_newtons() -> None:
    text = bk.scene_to_toml(replace(pressed(bk.Force(0.3, -4.0)), units=UNITS, thickness=10.0))
    assert "thickness = 10.0" in text
    scene = bk.scene_from_toml(
        text.replace("thickness = 10.0", 'thickness = "1 cm"').replace("y = -4.0", 'y = "-2 kN"')
    )
    assert scene.thickness == 10.0
    assert scene.parts[1].condition == bk.Force(0.3, -2000.0)
    assert bk.scene_from_toml(bk.scene_to_toml(scene)) == scene
    stepped = replace(scene, steps=(bk.Step(1.0, {"parts.top.condition.y": "-3 kN"}),))
    assert bk.run(stepped).force_normal == pytest.approx(3000.0, rel=1e-9)
    with pytest.raises(bk.InputError, match="'-2 kN/mm' has a unit of another kind: give it in N or a multiple of it"):
        bk.scene_from_toml(text.replace("y = -4.0", 'y = "-2 kN/mm"'))
    with pytest.raises(bk.InputError, match="'-2 kN' has a unit of another kind: give it in N/m or a multiple of it"):
        bk.scene_from_toml(text.replace("thickness = 10.0", "").replace("y = -4.0", 'y = "-2 kN"'))


def test_names_of_units_of_forces() -> None:
    names = UNITS.over_thickness(1.0)
    assert (names.force, names.energy) == ("N", "N mm")
    assert UNITS.over_thickness(None) is UNITS
    assert bk.UnitNames("mm", "GPa").over_thickness(2.0).force == "kN"
    assert bk.UnitNames("furlong", "Pa").over_thickness(2.0).as_dict()["energy"] == "Pa furlong^2 furlong"
    assert [is_force(name) for name in ("kN", "N/mm", "mm", "stone")] == [True, False, None, None]
    own = bk.UnitNames("mm", "MPa", "my newton")
    assert own.over_thickness(2.0) is own
    with pytest.raises(bk.InputError, match=r"units\.force is 'kN/mm', and the scene has thickness 2: give a unit"):
        bk.UnitNames("mm", "MPa", "kN/mm").over_thickness(2.0)
    with pytest.raises(bk.InputError, match=r"units\.force is 'N', and the scene has no thickness: .* such as 'N/mm'"):
        replace(pressed(bk.Force()), units=bk.UnitNames("mm", "MPa", "N"))


@pytest.mark.parametrize("thickness", [0.0, -1.0, float("inf"), float("nan")])
def test_a_thickness_is_positive(thickness: float) -> None:
    with pytest.raises(bk.InputError, match=r"thickness is .*: give a positive length"):
        replace(pressed(bk.Force(y=-1.0)), thickness=thickness)


def test_the_thickness_stays_in_a_load_history() -> None:
    scene = replace(pressed(bk.Force(y=-1.0)), thickness=2.0)
    steps = (bk.Step(1.0), bk.Step(2.0, {"thickness": 3.0}))
    with pytest.raises(bk.InputError, match=r"thickness is 3\.0 in a load step and 2\.0 in the first: keep it"):
        bk.run(replace(scene, steps=steps))


def test_every_output_has_the_unit_of_force(tmp_path: Path, without: Callable[..., None]) -> None:
    pytest.importorskip("matplotlib")
    solution = bk.run(replace(pressed(bk.Force(y=-4.0)), units=UNITS, thickness=THICKNESS))
    text = str(solution)
    assert "thickness" in text
    assert "4 N  pressing\n" in text
    assert "per unit thickness" not in text
    assert solution.summary()["units"]["force"] == "N"
    assert {head.name: head.unit for head in solution.forces.columns}["moment"] == "N mm"
    assert solution.plot("friction-loop").axes[0].get_ylabel() == "friction force on the body [N]"
    assert solution.plot("work").axes[0].get_ylabel() == "work and energy [N mm]"
    bk.write_result(tmp_path / "r.h5", solution)
    with h5py.File(tmp_path / "r.h5") as file:
        assert file["last/reaction"].attrs["unit"] == "N"
    read = bk.read_result(tmp_path / "r.h5")
    assert read.part_forces == solution.part_forces
    without("matplotlib")  # tables only
    page = CliRunner().invoke(commands, ["report", str(tmp_path / "r.h5"), "-o", str(tmp_path / "r.html")])
    assert page.exit_code == 0, page.output
    assert "force x [N]" in (tmp_path / "r.html").read_text("utf-8")


@pytest.mark.slow
def test_sweeps_and_collapse_have_the_unit_of_force(tmp_path: Path) -> None:
    scene = replace(pressed(bk.Force(y=-4.0)), steps=(), units=UNITS, thickness=THICKNESS)
    found = bk.sweep(scene, {"thickness": [4.0, 8.0]})
    assert {head.name: head.unit for head in found.as_table().columns}["force_normal"] == "N"
    assert found.column("force_normal").tolist() == pytest.approx([4.0, 4.0], rel=1e-9)
    assert found.column("peak_pressure")[0] == pytest.approx(2.0 * found.column("peak_pressure")[1], rel=1e-9)
    arch = replace(bk.load_scene("masonry-arch"), units=bk.UnitNames("m", "MPa"))
    plane, thick = (bk.thrust(each, "first.springing")[0] for each in (arch, replace(arch, thickness=THICKNESS)))
    assert thick.value == pytest.approx(THICKNESS * plane.value, rel=1e-9)
    (tmp_path / "arch.toml").write_text(bk.scene_to_toml(replace(arch, thickness=THICKNESS)))
    printed = CliRunner().invoke(commands, ["collapse", str(tmp_path / "arch.toml"), "--thrust", "first.springing"])
    assert f"{thick.value:.6g} MN; " in printed.output


def test_scaled_loads_keep_the_thickness() -> None:
    scene = replace(pressed(bk.Force(y=-4.0)), steps=(), thickness=THICKNESS)
    assert bk.run(with_scaled_loads(scene, 0.5)).force_normal == pytest.approx(2.0, rel=1e-9)
