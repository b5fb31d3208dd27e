"""Reading the pages of the documentation: fenced blocks and tables."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

DOCS = Path(__file__).parents[2] / "docs"

OUTPUTS_SHOWN = {
    "tutorials/first-steps.md": 4,
    "tutorials/several-bodies.md": 5,
    "command-line.md": 5,
    "plan.md": 2,
    "verification.md": 1,
    "paper-tables.md": 1,
}
"""Pages whose blocks and commands run in order, and how many of them show what they print."""

Row = list[str]


def read(name: str) -> str:
    return (DOCS / name).read_text("utf-8")


def blocks(page: str) -> list[tuple[str, str]]:
    """Return language and content of each fenced block."""
    return re.findall(r"^```(\w+)\n(.*?)^```$", page, re.MULTILINE | re.DOTALL)


def section(page: str, heading: str) -> str:
    """Return the text below a heading of the second level."""
    found = re.search(rf"^## {re.escape(heading)}\n(.*?)(?=^## |\Z)", page, re.MULTILINE | re.DOTALL)
    assert found, heading
    return found[1]


def table(text: str) -> list[Row]:
    """Return the rows of the first table, without its head."""
    return list(_rows(text))


def plain(cell: str) -> str:
    return cell.strip("`")


def _rows(text: str) -> Iterator[Row]:
    lines = re.search(r"^\|.*?\n\|[-|]+\|\n((?:\|.*\n?)*)", text, re.MULTILINE)
    assert lines, text[:80]
    for line in lines[1].splitlines():
        yield [cell.strip() for cell in line.strip().strip("|").split("|")]
