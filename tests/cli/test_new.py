"""bemkit new: each kind of scene runs, is drawn, and has no line without effect."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from click.testing import CliRunner

from bemkit.cli.main import _run_to_end, commands
from bemkit.errors import BemkitError
from bemkit.scene.toml import scene_from_toml, shipped_files
from tests.slow import slow_except, slow_only

KINDS = ("block", "cylinders", "pin", "rough-surface", "wall")
ENTRY = re.compile(r'(?:"[^"]*"|[^\s"=]+) = ')
"""The key of a line or of an inline table."""


def test_these_are_all_kinds_and_the_help_lists_them() -> None:
    assert tuple(shipped_files("new")) == KINDS
    text = " ".join(CliRunner().invoke(commands, ["new", "--help"]).output.split())
    assert all(kind in text for kind in KINDS)


ONE_PICTURE = "rough-surface --what contacts"


@pytest.mark.parametrize("words", slow_except([*KINDS, ONE_PICTURE], ONE_PICTURE))
@pytest.mark.usefixtures("here")
def test_two_commands_from_nothing_to_a_picture(words: str, capsys) -> None:
    kind, *what = words.split()
    assert _run_to_end(["new", kind]) == 0
    second = capsys.readouterr().out.split("bemkit ")[-1].split()
    assert second[:2] == ["run", f"{kind}.toml"]
    assert _run_to_end([*second, "--json", "result.json", "-q", *what]) == 0
    assert json.loads(Path("result.json").read_text())["certified"]
    assert [path for path in Path("figures").iterdir() if path.stat().st_size > 5000]


@pytest.mark.parametrize("kind", slow_only(KINDS, "wall", "cylinders"))
def test_every_line_has_an_effect(kind: str) -> None:
    text = shipped_files("new")[kind].read_text("utf-8")
    whole, lines = scene_from_toml(text), text.splitlines()
    assert lines[0].startswith("# ")
    entries = [k for k, line in enumerate(lines) if ENTRY.match(line)]
    assert len(entries) >= 8
    for k in entries:
        try:
            shorter = scene_from_toml("\n".join([*lines[:k], *lines[k + 1 :]]))
        except BemkitError:
            continue  # the scene needs the line
        assert shorter != whole, lines[k]


@pytest.mark.parametrize("kind", KINDS)
def test_alternatives_in_comments_are_valid(kind: str) -> None:
    text = shipped_files("new")[kind].read_text("utf-8")
    whole, lines = scene_from_toml(text), text.splitlines()
    for k, line in enumerate(lines):
        if line.startswith("# ") and ENTRY.match(line[2:]):
            assert scene_from_toml("\n".join([*lines[:k], line[2:], *lines[k + 1 :]])) != whole, line
        elif " # or {" in line:
            value, alternative = re.fullmatch(r"(.*?)\{.*\} # or (\{.*\})", line).groups()  # type: ignore[union-attr]
            assert scene_from_toml("\n".join([*lines[:k], value + alternative, *lines[k + 1 :]])) != whole, line


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["blok"], "no kind 'blok' of scene: the kinds are block, .*; did you mean 'block'"),
        (["block", "there.toml"], "there.toml exists: give another name, or remove it"),
        (["block", "new.txt"], "new.txt: the ending of scene files is .toml: give new.toml"),
        (["block", "none/new.toml"], "none"),
    ],
)
@pytest.mark.usefixtures("here")
def test_what_is_refused(arguments: list[str], message: str, tmp_path, capsys) -> None:
    Path("there.toml").write_text("mine")
    assert _run_to_end(["new", *arguments]) == 2
    assert re.search(message, capsys.readouterr().err)
    assert Path("there.toml").read_text() == "mine"
    assert [path.name for path in tmp_path.iterdir()] == ["there.toml"]
