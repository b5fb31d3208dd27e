"""CONTRIBUTING.md names files, classes, functions and checks that exist; its tree is tested with the imports."""

from __future__ import annotations

import re
from importlib import import_module

import pytest

import bemkit.testing
from bemkit.scene import registry
from tests.docs.pages import DOCS, Row, section, table

ROOT = DOCS.parent
PAGE = (ROOT / "CONTRIBUTING.md").read_text("utf-8")
FORMS, PLACES = table(section(PAGE, "The chain")), table(section(PAGE, "Where to put a new ..."))
RESPONSE = table(section(PAGE, "A response of a compressed body"))


def names_in_files(cell: str) -> list[tuple[str, str]]:
    """Return names and the files in which a cell says they are, as in '`A`, or `B`, in `file.py`'."""
    name = r"`\w+`"
    pairs = re.findall(rf"({name}(?:,? (?:and|or) {name})*),? in `(\S+\.py)`", cell)
    return [(each, file) for names, file in pairs for each in re.findall(r"\w+", names) if each not in ("and", "or")]


@pytest.mark.parametrize("row", [*FORMS, *RESPONSE, *PLACES], ids=lambda row: row[0])
def test_files_exist_and_hold_what_is_said_to_be_in_them(row: Row) -> None:
    for path in re.findall(r"`(\w+/[\w/.]+)`", " ".join(row)):
        assert (ROOT / path).exists(), path
    found = [pair for cell in row for pair in names_in_files(cell)]
    for name, file in found:
        module = import_module(file.removesuffix(".py").replace("/", "."))
        assert getattr(module, name).__module__ == module.__name__, f"{name} is not in {file}"
    assert found or row[0] in ("kind", "picture")


def test_data_takes_nine_forms_in_this_order() -> None:
    names = "text Scene BoundaryMesh Prepared Plan LinearBody ContactProblem ContactSolution Solution"
    assert [row[0].strip("`") for row in FORMS] == names.split()


def test_a_response_of_a_compressed_body_passes_through_seven_files() -> None:
    assert len(RESPONSE) == 7


def test_every_kind_of_addition_has_its_row() -> None:
    names = (
        "law, solver, space, discretisation, elastic map, obstacle, shape, file of a body, operator, body, body force, "
        "rule for copies, sequence of meshes, kind, picture, known solution, study"
    )
    assert [row[0] for row in PLACES] == names.split(", ")


def test_every_check_exists_and_none_is_left_out() -> None:
    checks = {name for name in vars(bemkit.testing) if name.startswith("check_")}
    assert set(re.findall(r"`(check_\w+)`", section(PAGE, "Where to put a new ..."))) == checks
    for new, _, _, check, _ in PLACES:
        assert check.strip("`") in checks or re.match(r"none: .*`tests/", check), new


def test_the_groups_of_entry_points_are_those_of_the_registry() -> None:
    groups = {value.group for value in vars(registry).values() if isinstance(value, registry.Registry)} - {""}
    (sentence,) = re.findall(r"entry points in the groups (.*?)\.\n", PAGE, re.DOTALL)
    assert set(re.findall(r"`([\w.]+)`", sentence)) == groups
