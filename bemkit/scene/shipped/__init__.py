"""The scenes that come with bemkit."""

from __future__ import annotations

import tomllib
from importlib import resources
from importlib.resources.abc import Traversable


def shipped_files() -> dict[str, Traversable]:
    """Return the shipped scene files by name."""
    folder = resources.files(__name__)
    files = sorted((file for file in folder.iterdir() if file.name.endswith(".toml")), key=lambda file: file.name)
    return {file.name.removesuffix(".toml"): file for file in files}


def shipped_scenes() -> dict[str, str]:
    """Return the titles of the shipped scenes by name."""
    return {name: tomllib.loads(file.read_text("utf-8"))["title"] for name, file in shipped_files().items()}
