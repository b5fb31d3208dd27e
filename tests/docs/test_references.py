"""Keys cited in code stand in the bibliography."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import bemkit
from bemkit.results.citations import PACKAGE, entries
from tests.docs.pages import read

KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:18|19|20)\d\d)\]")
FOLDERS = (Path(bemkit.__file__).parent, Path(__file__).parent.parent)
CITED = {key for folder in FOLDERS for path in folder.rglob("*.py") for key in KEY.findall(path.read_text("utf-8"))}


@pytest.mark.parametrize("key", sorted(CITED))
def test_what_is_cited_is_listed(key: str) -> None:
    assert key in entries()


def test_the_page_shows_the_bibliography() -> None:
    from make_bibliography import filled

    page = read("references.md")
    assert filled(page) == page, "run python docs/make_bibliography.py"
    assert re.findall(r"^\| `\[(\w+)\]`", page, re.MULTILINE) == [key for key in entries() if key != PACKAGE]


def test_something_is_cited() -> None:
    assert "AlartCurnier1991" in CITED
