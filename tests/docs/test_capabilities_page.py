"""docs/capabilities.md names, for everything it claims, a file in the tree that shows it."""

from __future__ import annotations

import re

import pytest

from tests.docs.pages import DOCS, Row, read, section, table

PAGE = read("capabilities.md")
SUPPORTED = table(section(PAGE, "Supported"))


@pytest.mark.parametrize("row", SUPPORTED, ids=lambda row: row[0])
def test_every_claim_names_files_that_exist(row: Row) -> None:
    _, form, proofs = row
    assert form
    files = re.findall(r"`([^`]+)`", proofs)
    assert ", ".join(f"`{file}`" for file in files) == proofs
    for file in files:
        path = DOCS.parent / file
        assert path.is_file(), file
        text = path.read_text("utf-8")
        assert re.search(r"^def test_|^```python$", text, re.MULTILINE), f"{file} shows nothing"


def test_claims_and_limits_do_not_contradict() -> None:
    limits = [row[0] for row in table(section(PAGE, "Not claimed"))]
    assert len(limits) >= 8
    assert not {row[0] for row in SUPPORTED} & set(limits)
