"""docs/several-bodies.md says what the code does: every key, default, example and error on it."""

from __future__ import annotations

import pytest

from bemkit import Body, ContactPair, Placement, RigidBody, Scene, Touching, scene_from_toml
from bemkit.model.prepared import prepare_steps
from bemkit.scene import registry as kinds
from bemkit.scene.toml import SceneError
from tests.docs.pages import Row, blocks, plain, read, section, table
from tests.docs.test_scene_files_page import check_keys

PAGE = read("several-bodies.md")
BLOCKS = blocks(PAGE)
EXAMPLES = [
    (content, BLOCKS[i + 1][1].strip() if i + 1 < len(BLOCKS) and BLOCKS[i + 1][0] == "text" else "")
    for i, (language, content) in enumerate(BLOCKS)
    if language == "toml"
]
TABLES = {
    "Bodies": Body,
    "Placement": Placement,
    "Contacts": ContactPair,
    "Rigid bodies": RigidBody,
    "Touching": Touching,
}


@pytest.mark.parametrize("text", [content for content, error in EXAMPLES if not error])
def test_every_example_can_be_prepared(text: str) -> None:
    scene = scene_from_toml(text)
    assert isinstance(scene, Scene)
    assert prepare_steps([scene])[0].n_contact > 0


@pytest.mark.parametrize(("text", "error"), [example for example in EXAMPLES if example[1]])
def test_every_wrong_example_gives_the_error_below_it(text: str, error: str) -> None:
    with pytest.raises(SceneError) as caught:
        scene_from_toml(text)
    assert str(caught.value) == error


@pytest.mark.parametrize("heading", TABLES)
def test_every_table_stands_on_the_page_with_its_keys_and_defaults(heading: str) -> None:
    rows = table(section(PAGE, heading))
    if heading == "Bodies":
        rows.append(["`name`", "text", "required", "stands in the heading [bodies.NAME]"])
    if heading == "Rigid bodies":
        rows.append(["`name`", "text", "required", "stands in the heading [rigid.NAME]"])
    check_keys(TABLES[heading], rows)


def test_every_rule_for_copies_stands_on_the_page() -> None:
    rows_of: dict[str, list[Row]] = {}
    for kind, *row in table(section(PAGE, "Copies")):
        rows_of.setdefault(plain(kind) or list(rows_of)[-1], []).append(row)
    assert list(rows_of) == list(kinds.COPIES.built_in)
    for kind, rows in rows_of.items():
        check_keys(kinds.COPIES.find(kind), rows)
