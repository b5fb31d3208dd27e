"""Numbers with units in scene files become numbers in the units of the scene."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.scene.keys import Key, with_value
from bemkit.scene.toml import SceneError
from bemkit.scene.unit_names import in_units_of_scene, read_unit

MM = bk.UnitNames("mm", "MPa")
BLOCK = """
title = "Block"
{units}
discretisation = "linear"
shape = {{ kind = "rectangle", width = {width}, height = {height}, corner = [{x}, 0.0] }}
material = {{ youngs_modulus = {modulus}, poisson_ratio = 0.3 }}
mesh = {{ elements = 24 }}
[law]
kind = "coulomb"
friction_coefficient = 0.3
[parts.floor]
sides = ["bottom"]
condition = {{ kind = "contact", obstacle = {{ kind = "half-plane" }} }}
[parts.load]
sides = ["top"]
condition = {{ kind = "pressure", pressure = {pressure}, shear = "0.1 * x" }}
"""
WITH_UNITS = {"width": '"2 cm"', "height": '"0.01 m"', "x": '"-1 cm"', "modulus": '"210 GPa"', "pressure": '"5 N/mm^2"'}
PLAIN = {"width": 20.0, "height": 10.0, "x": -10.0, "modulus": 210e3, "pressure": 5.0}
UNITS = 'units = { length = "mm", stress = "MPa" }'


def test_a_scene_with_units_is_the_scene_in_its_own_numbers() -> None:
    with_units = bk.scene_from_toml(BLOCK.format(units=UNITS, **WITH_UNITS))
    plain = bk.scene_from_toml(BLOCK.format(units=UNITS, **PLAIN))
    assert with_units.shape.width == pytest.approx(plain.shape.width, rel=1e-15)
    assert with_units.shape.corner == pytest.approx(plain.shape.corner, rel=1e-15)
    assert with_units.material.youngs_modulus == pytest.approx(210e3, rel=1e-15)
    assert with_units.parts[1].condition.pressure == pytest.approx(5.0, rel=1e-15)
    assert with_units.parts[1].condition.shear == plain.parts[1].condition.shear


def test_mistakes_name_key_value_and_remedy() -> None:
    wrong = WITH_UNITS | {"width": '"2 MPa"', "x": '"1 cn"', "modulus": '"210 mm"', "pressure": '"5 Mpa"'}
    with pytest.raises(SceneError) as caught:
        bk.scene_from_toml(BLOCK.format(units=UNITS, **wrong))
    text = str(caught.value)
    assert "shape.width: '2 MPa' has a unit of another kind: give it in m or a multiple of it" in text
    assert "shape.corner[0]: the unit 'cn' is unknown" in text
    assert "did you mean 'MPa'?" in text
    assert "material.youngs_modulus: '210 mm' has a unit of another kind: give it in Pa" in text
    with pytest.raises(SceneError, match=r"'2 cm' has a unit, but the scene has none: add units = "):
        bk.scene_from_toml(BLOCK.format(units="", **WITH_UNITS))
    own = 'units = { length = "furlong", stress = "MPa" }'
    with pytest.raises(SceneError, match="the unit 'furlong' is unknown"):
        bk.scene_from_toml(BLOCK.format(units=own, **WITH_UNITS))
    with pytest.raises(SceneError, match=r"units.length is 'MPa', which is not a unit of length"):
        bk.scene_from_toml(BLOCK.format(units='units = { length = "MPa", stress = "MPa" }', **WITH_UNITS))
    with pytest.raises(SceneError, match=r"'0.3 mm' has a unit of another kind: give it without a unit"):
        bk.scene_from_toml(
            BLOCK.format(units=UNITS, **PLAIN).replace("poisson_ratio = 0.3", 'poisson_ratio = "0.3 mm"')
        )


def test_forces_have_the_units_of_a_scene_with_or_without_a_thickness() -> None:
    text = BLOCK.format(units=UNITS, **WITH_UNITS).replace('{ kind = "pressure"', '{ kind = "force"')
    plain, moved = ('y = "-35 kN/mm"', 'moment = "2 kN m/m"'), ('y = "-350 kN"', 'moment = "2 kN m"')
    for thickness, loads, expected in (("", plain, (-35e3, 2e3)), ('thickness = "10 mm"', moved, (-350e3, 2e6))):
        changed = text.replace('pressure = "5 N/mm^2", shear = "0.1 * x"', ", ".join(loads))
        scene = bk.scene_from_toml(changed.replace(UNITS, f"{UNITS}\n{thickness}"))
        assert scene.thickness == (10.0 if thickness else None)
        assert (scene.parts[1].condition.y, scene.parts[1].condition.moment) == pytest.approx(expected, rel=1e-15)


def test_values_set_at_a_place_may_have_units() -> None:
    scene = bk.scene_from_toml(BLOCK.format(units=UNITS, **PLAIN))
    assert with_value(scene, Key("material.youngs_modulus"), "70 GPa").material.youngs_modulus == pytest.approx(70e3)
    load = with_value(scene, Key("parts.load.condition"), {"kind": "pressure", "pressure": "2 kN/mm^2"}).parts[1]
    assert load.condition.pressure == pytest.approx(2000.0)
    assert with_value(scene, Key("shape.corner[0]"), "-1 cm").shape.corner == pytest.approx((-10.0, 0.0))
    with pytest.raises(bk.BemkitError, match=r"material.youngs_modulus: '7 kg' has a unit of another kind"):
        with_value(scene, Key("material.youngs_modulus"), "7 kg")


@pytest.mark.parametrize(
    ("text", "size"),
    [
        ("N/mm", 1e3),
        ("kN/mm^2", 1e9),
        ("N mm/mm", 1.0),
        ("1/K", 1.0),
        ("t/mm\u00b3", 1e12),
        ("lbf/in", 175.12683524647636),
    ],
)
def test_sizes_in_si_units(text: str, size: float) -> None:
    assert read_unit(text).factor == pytest.approx(size, rel=1e-14)


@given(value=st.floats(1e-9, 1e9), unit=st.sampled_from(["Pa", "kPa", "psi", "N/mm^2", "kN/m^2"]))
def test_a_stress_is_the_same_in_all_scenes(value: float, unit: str) -> None:
    text = f"{value!r} {unit}"
    in_mm = in_units_of_scene(text, bk.Pressure, "pressure", MM)
    in_inches = in_units_of_scene(text, bk.Pressure, "pressure", bk.UnitNames("in", "ksi"))
    assert isinstance(in_mm, float)
    assert isinstance(in_inches, float)
    assert math.isclose(in_mm * 1e6, in_inches * read_unit("ksi").factor, rel_tol=1e-14)
