"""The schema of scene files accepts what can be read and marks what cannot, where it stands."""

from __future__ import annotations

import json
import shutil
import subprocess
import tomllib
from pathlib import Path

import pytest
from click.testing import CliRunner
from jsonschema import Draft7Validator

from bemkit.cli.main import commands
from bemkit.errors import BemkitError
from bemkit.scene.docstrings import parameters, summary
from bemkit.scene.schema import scene_schema
from bemkit.scene.toml import shipped_files
from checks.random_scenes.scenes import random_case
from tests.docs.test_scene_files_page import EXAMPLES, as_text
from tests.docs.test_several_bodies_page import EXAMPLES as ASSEMBLIES

SCHEMA = scene_schema()
SHIPPED = {name: file.read_text("utf-8") for name, file in shipped_files().items()}


def errors_in(text: str) -> list[str]:
    """Return each place that is marked, with the message there."""
    errors = Draft7Validator(SCHEMA).iter_errors(tomllib.loads(text))
    return [f"{error.json_path}: {error.message}" for error in errors]


def test_it_is_a_schema() -> None:
    Draft7Validator.check_schema(SCHEMA)


@pytest.mark.parametrize("name", SHIPPED)
def test_every_shipped_scene_is_accepted(name: str) -> None:
    assert errors_in(SHIPPED[name]) == []


@pytest.mark.parametrize(
    "text",
    [*(as_text(content) for content, error in EXAMPLES if not error), *(c for c, error in ASSEMBLIES if not error)],
)
def test_every_example_of_the_pages_is_accepted(text: str) -> None:
    assert errors_in(text) == []


TYPOS = [
    ("paper-1", "title = ", "titel = ", "$", "'titel' is not one of ['title', "),
    ("paper-1", "width = 1.0", "widht = 1.0", "$.shape", "('widht' was unexpected)"),
    ("paper-1", "width = 1.0", "", "$.shape", "'width' is a required property"),
    ("paper-1", "width = 1.0", 'width = "1.0"', "$.shape.width", "'1.0' does not match"),
    ("paper-1", '"coulomb"', '"colomb"', "$.law.kind", "'colomb' is not one of"),
    ("paper-1", 'condition = "roller"', 'condition = "rollr"', "$.parts.wall.condition", "'rollr' is not one of"),
    ("paper-1", 'condition = "roller"', 'condition = "contact"', "$.parts.wall.condition", "'contact' is not one of"),
    ("paper-1", 'condition = "roller"', "", "$.parts.wall", "'condition' is a required property"),
    ("paper-1", 'plane = "strain"', 'plane = "strian"', "$.material.plane", "'strian' is not one of"),
    ("paper-1", "[parts.wall]", "[parts.wall]\nname = 'wall'", "$.parts.wall", "('name' was unexpected)"),
    ("paper-1", "title =", "symmetry = {x = true}\ntitle =", "$.symmetry.x", "True is not of type 'number'"),
    ("paper-1", "title =", "contacts = []\ntitle =", "$", "'contacts' is not one of"),
    ("two-cylinders", "title =", "parts = {}\ntitle =", "$", "'parts' is not one of"),
    ("two-cylinders", "radius =", "radios =", "$.bodies.upper.shape", "'radios' was unexpected"),
]


@pytest.mark.parametrize(("name", "right", "wrong", "place", "message"), TYPOS)
def test_what_is_wrong_is_marked_where_it_stands(name: str, right: str, wrong: str, place: str, message: str) -> None:
    text = SHIPPED[name]
    assert right in text
    found = errors_in(text.replace(right, wrong, 1))
    assert any(line.startswith(f"{place}: ") and message in line for line in found), found


def test_a_word_in_another_key_names_another_kind() -> None:
    text, word = SHIPPED["paper-1"], 'discretisation = "constant"'
    assert word in text
    for other in ("'hp'", "'linear'", "{ kind = 'galerkin', degree = 5 }"):
        assert errors_in(text.replace(word, f"discretisation = {other}")) == []
    assert errors_in(text.replace(word, "discretisation = 'hq'")) != []
    (wrong,) = errors_in(text.replace(word, "discretisation = { kind = 'galerkin', degree = 'h' }"))
    assert wrong.startswith("$.discretisation.degree: 'h' is not")


def test_random_scenes_are_accepted() -> None:
    n_read = 0
    for number in range(30):
        try:
            files = random_case(7, number).files()
        except BemkitError:  # what was drawn is not a scene
            continue
        for text in files.values():
            assert errors_in(text) == [], text
            n_read += 1
    assert n_read > 20


def test_keys_have_the_descriptions_and_defaults_of_the_classes() -> None:
    top, material = SCHEMA["properties"], SCHEMA["definitions"]["Material"]["properties"]
    assert top["load_factors"]["default"] == [1.0]
    assert top["law"]["default"] == "frictionless"
    assert "default" not in top["title"]
    assert "all loads, given displacements" in top["load_factors"]["description"]
    assert material["youngs_modulus"]["description"].startswith("[Pa]")
    assert SCHEMA["definitions"]["Material"]["required"] == ["youngs_modulus", "poisson_ratio"]


def test_docstrings_are_read_as_plain_text() -> None:
    docstring = """A `rule`.

More of it.

Parameters
----------
width, height : float [m]
    Along ``x``
    and y.
name : str

Raises
------
ValueError
    If wrong.
"""
    assert summary(docstring) == "A rule."
    assert parameters(docstring) == {"width": "[m] Along x and y.", "height": "[m] Along x and y.", "name": ""}
    assert parameters("Nothing.") == {}


def test_the_command_prints_it() -> None:
    assert json.loads(CliRunner().invoke(commands, ["schema"]).output) == SCHEMA


@pytest.mark.skipif(shutil.which("taplo") is None, reason="taplo, which editors check TOML with, is not installed")
def test_what_editors_check_with_shows_a_typo(tmp_path: Path) -> None:
    schema, scene = tmp_path / "scene.schema.json", tmp_path / "scene.toml"
    schema.write_text(json.dumps(SCHEMA), "utf-8")
    text = SHIPPED["paper-1"]
    for content, code in ((text, 0), (text.replace("friction_coefficient", "friction_coeficient"), 1)):
        scene.write_text(content, "utf-8")
        command = ["taplo", "lint", "--schema", schema.as_uri(), str(scene)]
        checked = subprocess.run(command, capture_output=True, text=True, cwd=tmp_path, check=False)
        assert checked.returncode == code
    assert "'friction_coeficient' was unexpected" in checked.stderr
