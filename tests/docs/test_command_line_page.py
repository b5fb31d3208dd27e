"""docs/command-line.md lists every command, option, exit code, JSON field and column there is."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

from bemkit.cli import main as cli
from bemkit.cli import process
from bemkit.results.tables import TABLES
from bemkit.scene.toml import load_scene, scene_to_toml
from bemkit.solvers.base import Status
from tests.docs.pages import plain, read, section, table

PAGE = read("command-line.md")


def leaves(command: click.Command, path: str = "bemkit") -> Iterator[tuple[str, click.Command]]:
    if not isinstance(command, click.Group):
        yield path, command
        return
    context = click.Context(command)
    for name in command.list_commands(context):
        inner = command.get_command(context, name)
        assert inner is not None
        yield from leaves(inner, f"{path} {name}")


COMMANDS = dict(leaves(cli.commands))


def names_in(cell: str) -> list[str]:
    return [plain(name) for name in cell.split(", ")]


def all_names(text: str) -> list[str]:
    return [name for row in table(text) for name in names_in(row[0])]


def test_every_command_has_a_section() -> None:
    assert sorted(re.findall(r"^## (bemkit .*)$", PAGE, re.MULTILINE)) == sorted(COMMANDS)


@pytest.mark.parametrize("path", COMMANDS)
def test_every_option_is_listed_and_accepted(path: str) -> None:
    command, text = COMMANDS[path], section(PAGE, path)
    for parameter in command.params:
        if isinstance(parameter, click.Argument):
            name = re.escape(parameter.human_readable_name)
            assert re.search(rf"`{path} [^`]*{name}[^`]*`", text)
    options = [name for parameter in command.params if isinstance(parameter, click.Option) for name in parameter.opts]
    shared = re.search(r"^Common options: (.*)\.$", text, re.MULTILINE)
    common = names_in(shared[1]) if shared else []
    assert set(common) <= set(all_names(section(PAGE, "Common options")))
    assert sorted([*common, *(all_names(text) if "| option |" in text else [])]) == sorted(options)
    shown = CliRunner().invoke(cli.commands, [*path.split()[1:], "--help"])
    assert shown.exit_code == 0
    for option in options:
        assert option in shown.output


def test_every_common_option_belongs_to_a_command() -> None:
    used = [name for command in COMMANDS.values() for parameter in command.params for name in parameter.opts]
    assert all(used.count(name) > 1 for name in all_names(section(PAGE, "Common options")))


def test_exit_codes() -> None:
    codes = [
        0,
        process.NOT_CONVERGED,
        process.BAD_INPUT,
        process.INACCURATE,
        process.INTERRUPTED,
        process.PIPE_CLOSED,
        process.TERMINATED,
    ]
    assert [int(row[0]) for row in table(section(PAGE, "Exit codes"))] == codes


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("result") / "result.h5"
    scene = path.with_suffix(".toml")
    scene.write_text(scene_to_toml(replace(load_scene("paper-1"), load_factors=(0.5, 1.0))))  # all tables have rows
    ran = CliRunner().invoke(cli.commands, ["run", str(scene), "--elements", "40", "-q", "-o", str(path)])
    assert ran.exit_code == 0
    return path


def test_json_fields() -> None:
    text = section(PAGE, "JSON fields")
    summary = json.loads(CliRunner().invoke(cli.commands, ["run", "paper-1", "--elements", "40", "--json", "-"]).output)
    assert all_names(text) == list(summary)
    assert all_names(text.partition("Each of the `transitions`")[2]) == list(summary["transitions"][0])
    assert all_names(text.partition("Each of the `parts`")[2]) == list(summary["parts"][0])
    of_contact = all_names(text.partition("Each of the `contacts`")[2])
    assert [*summary["parts"][0], *of_contact] == list(summary["contacts"][0])
    assert all_names(text.partition("The `certificate`")[2]) == list(summary["certificate"])
    assert all_names(text.partition("`between_nodes` measures")[2]) == list(summary["between_nodes"])
    rows = {plain(row[0]): row[-1] for row in table(text)}
    assert re.findall(r"`(\w+)`", rows["status"]) == [status.name.lower() for status in Status]
    assert re.findall(r"`(\w+)`", rows["timings"]) == list(summary["timings"])
    plan_words = [*summary["plan"], *summary["plan"]["items"][0]]
    assert re.findall(r"`(\w+)`", rows["plan"]) == plan_words
    assert re.findall(r"`(\w+)`", rows["work"]) == list(summary["work"])


@pytest.mark.parametrize("name", TABLES)
def test_columns(name: str, result: Path) -> None:
    text = section(PAGE, "Tables").partition(f"`{name}` has one row per")[2]
    printed = CliRunner().invoke(cli.commands, ["show", str(result), "--csv", "-", "--table", name]).output
    assert all_names(text) == next(csv.reader(io.StringIO(printed)))
