"""Docstrings of the house as reStructuredText: formulas in plain letters stay what they are."""

from __future__ import annotations

import re
from collections.abc import Iterator
from itertools import pairwise

_CODE = re.compile(r"(``.*?``|`[^`]*`)")
_ITEM = re.compile(r"\s*([*-]|\d+\.) ")


def as_restructured_text(lines: list[str]) -> list[str]:
    """Return the lines with formulas protected.

    An indented block after a line that ends with a colon is shown verbatim, and so is a paragraph that begins with
    a slash, a list of places in a file; bars such as those of ``|x|`` are not marks.
    """
    lines = list(_with_places_indented(lines))
    written: list[str] = []
    literal_beyond: int | None = None
    for k, line in enumerate(lines):
        indent = len(line) - len(line.lstrip())
        if literal_beyond is not None and line.strip() and indent <= literal_beyond:
            literal_beyond = None
        if literal_beyond is not None:
            written.append(line)
            continue
        line = "".join(piece if piece.startswith("`") else piece.replace("|", r"\|") for piece in _CODE.split(line))
        if line.endswith("::"):
            literal_beyond = indent
        elif line.endswith(":") and _is_block(lines[k + 1 :], indent):
            line, literal_beyond = f"{line}:", indent
        written.append(line)
    return written


def _with_places_indented(lines: list[str]) -> Iterator[str]:
    """Make a literal block of each paragraph that begins with a slash."""
    is_inside = False
    for before, line in pairwise(["", *lines]):
        is_inside = bool(line) and (is_inside or (not before and line.startswith("/")))
        if is_inside and not before:
            yield from ("::", "")
        yield f"    {line}" if is_inside else line


def _is_block(following: list[str], indent: int) -> bool:
    """Return whether a blank line and an indented block follow that is not a list."""
    if len(following) < 2 or following[0].strip():
        return False
    first = following[1]
    return len(first) - len(first.lstrip()) > indent and not _ITEM.match(first)
