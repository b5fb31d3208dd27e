"""Places of numbers in scenes, values of the command line, and one line for everything that is wrong with them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.scene.keys import Key, SceneKeyError
from bemkit.studies.engine import StudyError
from bemkit.studies.sweep.grid import all_rows, check_number, keeps_bodies, read_variation, with_values

SCENE = bk.load_scene("paper-1")
BODIES = bk.load_scene("two-cylinders")


def changed(scene: bk.Scene | bk.Scene, key: str, value: float) -> bk.Scene | bk.Scene:
    return with_values(scene, {Key(key): value})


def test_numbers_of_a_scene_are_changed_and_nothing_else() -> None:
    assert changed(SCENE, "law.friction_coefficient", 0.25) == replace(SCENE, law=bk.Coulomb(0.25))
    assert changed(SCENE, "mesh.elements", 40.0).mesh == replace(SCENE.mesh, elements=40)
    assert changed(SCENE, "load_factors[0]", 2.0) == replace(SCENE, load_factors=(2.0,))
    left = {part.name: part for part in changed(SCENE, "parts.left-load.condition.y", 3.0).parts}["left-load"]
    assert left.condition == bk.Traction(x=1.0, y=3.0)
    assert changed(SCENE, "shape.corner[1]", 2.0).shape == bk.Rectangle(1.0, 1.0, (0.0, 2.0))
    uniform = replace(SCENE, mesh=bk.MeshOptions(elements=40))
    assert changed(uniform, "mesh.density.top", 2.0).mesh == bk.MeshOptions(elements=40, density={"top": 2.0})


def test_numbers_of_several_bodies_are_changed() -> None:
    upper, lower = changed(BODIES, "bodies.upper.placement.shift[1]", 0.5).bodies
    assert upper.placement == bk.Placement(shift=(0.0, 0.5))
    assert lower == BODIES.bodies[1]
    (pair,) = changed(BODIES, "contacts[0].gap", -1e-3).contacts
    assert pair == replace(BODIES.contacts[0], gap=-1e-3)


@pytest.mark.parametrize(
    ("scene", "key", "message"),
    [
        (SCENE, "law.friction_coeficient", r"law\.friction_coeficient: unknown key: .*did you mean 'friction_coeff"),
        (SCENE, "parts.top_load.condition.y", r"parts\.top_load: unknown key: .*did you mean 'top-load'"),
        (SCENE, "parts.wall.condition.x", "there are no keys here"),
        (SCENE, "mesh.elements.x", "mesh.elements is not a table"),
        (SCENE, "law", "law is a table: vary one number of it, such as law.friction_coefficient"),
        (SCENE, "parts.wall.condition", "is a table: there is no number in it"),
        (SCENE, "shape.corner", r"shape\.corner is a list: vary one number of it, such as shape\.corner\[0\]"),
        (SCENE, "shape.corner.x", "shape.corner is a list: give the number of an entry"),
        (SCENE, "shape.corner[2]", r"shape\.corner\[2\]: unknown entry: shape\.corner has 2, counted from 0"),
        (SCENE, "law[0]", r"law is not a list: remove \[0\]"),
        (SCENE, "material.plane", "material.plane is not a number; only numbers can be varied"),
        (SCENE, "symmetry.x", "symmetry is not given in the scene: write it there first"),
        (SCENE, "law..x", "give a key of a scene file, such as law.friction_coefficient"),
        (BODIES, "bodies.uper.material.youngs_modulus", "bodies.uper: unknown key: .*did you mean 'upper'"),
        (BODIES, "contacts[1].gap", r"contacts\[1\]: unknown entry: contacts has 1"),
        (BODIES, "contacts[0].law.friction_coefficient", "law is not given in the scene"),
    ],
)
def test_keys_that_lead_to_no_number_are_named(scene: bk.Scene | bk.Scene, key: str, message: str) -> None:
    with pytest.raises(SceneKeyError, match=message):
        check_number(scene, Key(key))


def test_values_that_a_scene_refuses_are_named_with_their_key() -> None:
    with pytest.raises(SceneKeyError, match=r"^material: poisson_ratio is 0\.7"):
        changed(SCENE, "material.poisson_ratio", 0.7)
    with pytest.raises(SceneKeyError, match=r"^mesh\.elements: 40\.5 does not fit: give a whole number"):
        changed(SCENE, "mesh.elements", 40.5)


@pytest.mark.parametrize(
    ("key", "keeps"),
    [
        ("law.friction_coefficient", True),
        ("parts.top-load.condition.y", True),
        ("load_factors[0]", True),
        ("steps[1].load_factor", True),
        ("material.poisson_ratio", False),
        ("mesh.elements", False),
        ("bodies.upper.parts.pushed.condition.y", True),
        ("bodies.upper.placement.shift[0]", False),
        ("contacts[0].gap", True),
        ("touching.within", False),
        ('parts."a.b".condition.y', True),
    ],
)
def test_which_keys_keep_the_bodies(key: str, keeps: bool) -> None:
    assert keeps_bodies(Key(key)) == keeps


def test_names_with_dots_stand_in_quotation_marks() -> None:
    assert Key('parts."a.b".condition.y').names == ("parts", "a.b", "condition", "y")


def test_words_of_the_command_line() -> None:
    assert read_variation("a.b = 0:1:11") == ("a.b", (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0))
    assert read_variation("a=0:1:4")[1] == tuple(np.linspace(0.0, 1.0, 4).tolist())
    assert read_variation("a=1,1e-2") == ("a", (1.0, 0.01))
    keys, rows = all_rows({"a": [1, 2], "b": [3, 4]})
    assert [key.text for key in keys] == ["a", "b"]
    assert rows == [(1.0, 3.0), (1.0, 4.0), (2.0, 3.0), (2.0, 4.0)]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("law", "give KEY=FIRST:LAST:COUNT or KEY=VALUE,VALUE,..."),
        ("a=0:1", "give a range as FIRST:LAST:COUNT"),
        ("a=0:1:0", "give a range as FIRST:LAST:COUNT"),
        ("a=0,x", "'x' is not a number: give numbers such as 0.5"),
    ],
)
def test_wrong_words_are_named(text: str, message: str) -> None:
    with pytest.raises(StudyError, match=message):
        read_variation(text)


@pytest.mark.parametrize(
    ("vary", "message"),
    [
        ({}, "vary is empty"),
        ({"a": []}, "a: there are no values"),
        ({"a": [1.0, float("nan")]}, "a: nan is not a finite number"),
        ({"a": ["1"]}, "a: '1' is not a finite number"),
        ({"a": [1.0, 1]}, "a: 1 is given twice: remove one"),
        ({"a": range(400), "b": range(400)}, "the sweep has 160000 rows: give fewer values"),
    ],
)
def test_wrong_values_are_named(vary: dict[str, list[float]], message: str) -> None:
    with pytest.raises(StudyError, match=message):
        all_rows(vary)
