"""Texts of strangers, made fit for one line of a terminal."""

from __future__ import annotations

from pathlib import Path


def printable(text: str) -> str:
    """Return a text with a space for every line break, and ``?`` for every other character that is not printable.

    Escape codes of a terminal and marks that turn the direction of writing are among these.
    """
    return "".join(c if c.isprintable() else " " if c.isspace() else "?" for c in text)


def shown_path(path: Path) -> str:
    """Return the name of a file for messages."""
    return printable(str(path))[:200]
