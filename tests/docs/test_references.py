"""Keys cited in code stand in the bibliography."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import bemkit
from tests.docs.pages import read

KEY = re.compile(r"\[([A-Z][A-Za-z]+(?:18|19|20)\d\d)\]")
CITED = {key for path in Path(bemkit.__file__).parent.rglob("*.py") for key in KEY.findall(path.read_text("utf-8"))}


@pytest.mark.parametrize("key", sorted(CITED))
def test_what_is_cited_is_listed(key: str) -> None:
    assert f"[{key}]" in read("references.md")


def test_something_is_cited() -> None:
    assert "AlartCurnier1991" in CITED
