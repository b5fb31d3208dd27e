"""Descriptions of classes and parameters from docstrings, for the schema of scene files and for numbers with units."""

from __future__ import annotations

import re

_SECTION = re.compile(r"^(\w[\w ]*)\n-{3,}\n", re.MULTILINE)
_UNIT = re.compile(r"\[([^\]]+)\]\s*(?:,\s*optional)?\s*$")


def summary(docstring: str) -> str:
    """Return the first paragraph of a docstring, as one line."""
    return _plain(docstring.strip().partition("\n\n")[0])


def parameters(docstring: str) -> dict[str, str]:
    """Return the description of each parameter in a docstring: one line, which begins with the unit if there is one.

    Parameters
    ----------
    docstring : str
        With the indentation removed, as `inspect.getdoc` returns it.
    """
    texts: dict[str, str] = {}
    names: list[str] = []
    for line in _section(docstring, "Parameters").splitlines():
        if line[:1].strip():  # not indented: the names, and what they are
            heading, _, kind = line.partition(" : ")
            unit = _UNIT.search(kind)
            names = [name.strip() for name in heading.split(",")]
            texts |= dict.fromkeys(names, f"[{unit[1]}]" if unit else "")
        else:
            texts |= {name: f"{texts[name]} {_plain(line)}".strip() for name in names}
    return texts


def unit_of_parameter(docstring: str, name: str) -> str:
    """Return the unit that a docstring states for a parameter, such as ``Pa``; empty if it states none."""
    found = re.match(r"\[([^\]]+)\]", parameters(docstring).get(name, ""))
    return found[1] if found else ""


def _section(docstring: str, heading: str) -> str:
    pieces = _SECTION.split(docstring)
    return next((text for name, text in zip(pieces[1::2], pieces[2::2], strict=True) if name == heading), "")


def _plain(text: str) -> str:
    """Return a text without marks of reStructuredText and line breaks."""
    return " ".join(text.replace("``", "").replace("`", "").split())
