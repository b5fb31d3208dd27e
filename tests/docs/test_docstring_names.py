"""Names of the package in docstrings and pages exist."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[2]
NAME = re.compile(r"`(bemkit(?:\.[A-Za-z_]\w*)+)`")
NOT_NAMES = {"bemkit.progress"} | {
    f"bemkit.{group}" for group in ("laws", "solvers", "obstacles", "shapes", "discretisations")
}
"""A logger, and groups of entry points."""


def find(name: str) -> Any:
    """Return a module or what it holds; AttributeError if there is nothing of that name."""
    parts = name.split(".")
    for length in range(len(parts), 0, -1):
        try:
            found = import_module(".".join(parts[:length]))
        except ModuleNotFoundError:
            continue
        for part in parts[length:]:
            found = getattr(found, part)
        return found
    raise AttributeError(name)


def test_every_full_name_leads_to_something() -> None:
    unknown = []
    pages = [*ROOT.glob("bemkit/**/*.py"), *ROOT.glob("docs/**/*.md"), ROOT / "CONTRIBUTING.md", ROOT / "README.md"]
    for page in pages:
        for name in set(NAME.findall(page.read_text("utf-8"))) - NOT_NAMES:
            try:
                find(name)
            except AttributeError:
                unknown.append(f"{page.relative_to(ROOT)}: {name}")
    assert not unknown
