"""docs/scene-files.md says what the code does: every kind, key, default, formula word and error on it."""

from __future__ import annotations

import re
import tomllib
from dataclasses import MISSING, fields

import pytest
import tomli_w

from bemkit import formulas as expression
from bemkit.formulas import Expression
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.operators.material import Material
from bemkit.scene import registry as kinds
from bemkit.scene.conditions import Part
from bemkit.scene.discretisation import MeshOptions
from bemkit.scene.plane_motion import FarField
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import structure
from bemkit.scene.steps import Step
from bemkit.scene.toml import MAX_BYTES, SceneError, scene_from_toml
from bemkit.scene.unit_names import UnitNames
from tests.docs.pages import Row, blocks, plain, read, section, table

PAGE = read("scene-files.md")
BLOCKS = blocks(PAGE)
FAMILIES = {
    "Conditions": kinds.CONDITIONS,
    "Body forces": kinds.BODY_FORCES,
    "Obstacles": kinds.OBSTACLES,
    "Friction laws": kinds.LAWS,
    "Shapes": kinds.SHAPES,
    "Sides of outlines": kinds.SIDES,
    "Gradings": kinds.GRADINGS,
    "Discretisations": kinds.DISCRETISATIONS,
    "Linear solvers": kinds.LINEAR_SOLVERS,
    "Solvers": kinds.SOLVERS,
}
TABLES = {
    "The scene": Scene,
    "Units": UnitNames,
    "Material": Material,
    "Parts": Part,
    "Half-planes": FarField,
    "Symmetry": Symmetry,
    "Mesh": MeshOptions,
    "Steps": Step,
}


def as_text(fragment: str) -> str:
    """Complete a fragment by the first scene on the page; a scene of its own, or no TOML at all, stays as it is."""
    base = tomllib.loads(BLOCKS[0][1])
    table = tomllib.loads(fragment)
    if "title" in table:
        return fragment
    parts = base["parts"] | table.get("parts", {})
    return tomli_w.dumps(base | table | {"parts": parts})


EXAMPLES = [
    (content, BLOCKS[i + 1][1].strip() if i + 1 < len(BLOCKS) and BLOCKS[i + 1][0] == "text" else "")
    for i, (language, content) in enumerate(BLOCKS)
    if language == "toml"
]


@pytest.mark.parametrize("fragment", [content for content, error in EXAMPLES if not error])
def test_every_example_is_a_scene_that_can_be_divided(fragment: str) -> None:
    scene = scene_from_toml(as_text(fragment))
    assert scene.build_mesh().whole.n_elements == scene.mesh.elements


@pytest.mark.parametrize(("fragment", "error"), [example for example in EXAMPLES if example[1]])
def test_every_wrong_example_gives_the_error_below_it(fragment: str, error: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_from_toml(as_text(fragment))
    assert str(caught.value) == error


def test_there_are_examples_and_errors() -> None:
    assert {language for language, _ in BLOCKS} == {"toml", "text"}
    assert len(EXAMPLES) >= 12
    assert sum(bool(error) for _, error in EXAMPLES) >= 5


def test_a_word_alone_means_the_same_as_a_table_of_defaults() -> None:
    first, second = (scene_from_toml(as_text(content)) for content, _ in EXAMPLES[1:3])
    assert first.solver == second.solver


def check_keys(owner: type, rows: list[Row]) -> None:
    """Compare rows of key, value, default and meaning with the fields of a class."""
    entries = {entry.name: entry for entry in fields(owner) if entry.init}
    assert sorted(plain(row[0]) for row in rows) == sorted(entries), owner
    for key, value, default, _ in rows:
        entry = entries[plain(key)]
        assert value, key
        if default == "required":
            assert (entry.default, entry.default_factory) == (MISSING, MISSING), key
        elif default == "none":
            assert entry.default is None, key
        else:
            documented = tomllib.loads(f"value = {plain(default)}")["value"]
            actual = entry.default if entry.default_factory is MISSING else entry.default_factory()
            assert structure(documented, kinds.type_of_field(owner, entry.name)) == actual, key


@pytest.mark.parametrize("heading", FAMILIES)
def test_every_kind_stands_on_the_page_with_its_keys_and_defaults(heading: str) -> None:
    registry, rows_of = FAMILIES[heading], dict[str, list[Row]]()
    for kind, *row in table(section(PAGE, heading)):
        rows_of[plain(kind) or list(rows_of)[-1]] = [*rows_of.get(plain(kind) or list(rows_of)[-1], []), row]
    assert list(rows_of) == [*registry.presets, *registry.built_in]
    for kind, rows in rows_of.items():
        keys = [row for row in rows if row[0]]
        assert not (kind in registry.presets and keys)
        if kind not in registry.presets:
            check_keys(registry.find(kind), keys)


def test_no_family_of_kinds_is_left_out() -> None:
    registries = [value for value in vars(kinds).values() if isinstance(value, kinds.Registry)]
    elsewhere = {kinds.COPIES.role}  # tests/docs/test_several_bodies_page.py
    assert {registry.role for registry in registries} == {registry.role for registry in FAMILIES.values()} | elsewhere
    for registry in registries:
        assert not registry.group or f"`{registry.group}`" in PAGE


@pytest.mark.parametrize("heading", TABLES)
def test_every_table_stands_on_the_page_with_its_keys_and_defaults(heading: str) -> None:
    rows = table(section(PAGE, heading))
    if heading == "Parts":
        rows.append(["`name`", "text", "required", "stands in the heading [parts.NAME]"])
    check_keys(TABLES[heading], rows)


def test_formulas_and_their_limits() -> None:
    text = section(PAGE, "Formulas")
    words = re.findall(r"`([^`]+)`", text)
    for name in expression._NAMES:
        assert any(re.match(rf"{name}\b", word) for word in words), name
    for word in re.findall(r"`([a-z0-9]+)`", re.search(r"functions of one number \|(.*)", text)[1]):  # type: ignore[index]
        assert Expression(f"{word}(x)")
    for word in re.findall(r"`([a-z0-9]+)`", re.search(r"functions of two numbers \|(.*)", text)[1]):  # type: ignore[index]
        assert Expression(f"{word}(x, y)")
    for limit in (expression.MAX_LENGTH, expression.MAX_DEPTH, MAX_BYTES):
        assert f" {limit} " in text
    assert float(Expression("where(x > 0, log(x), 0)")(0.0, 0.0)) == 0.0
