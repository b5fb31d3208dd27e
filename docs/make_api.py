"""Write the pages of the API reference, which autodoc fills from docstrings; `conf.py` does so before each build.

The names of ``bemkit`` by the folder that they live in, and all modules of the folders that researchers extend.
"""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterable
from pathlib import Path

import bemkit

PACKAGE = Path(bemkit.__file__).parent
FOLDER = Path(__file__).parent / "api"
CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"
EXTENDED = (
    *("geometry", "operators", "contact", "solvers", "scene", "results", "pictures", "report"),
    *("studies", "testing", "reference"),
)


def main(pages: Path = FOLDER) -> None:
    """Write all pages anew."""
    shutil.rmtree(pages, ignore_errors=True)
    by_folder: dict[str, list[str]] = {}
    for name in bemkit.__all__:
        by_folder.setdefault(home_of(name).split(".")[1], []).append(name)
    folders = [folder for folder in purposes() if folder in by_folder]
    write(pages / "bemkit.rst", index_page(folders, by_folder))
    for folder in folders:
        write(pages / "names" / f"{folder}.rst", names_page(folder, by_folder[folder]))
    for folder in EXTENDED:
        inner = {".".join(module.split(".")[:-1]) for module in modules_of(folder)}
        for package in sorted(inner):
            modules = [module for module in modules_of(folder) if module.rpartition(".")[0] == package]
            write(pages / f"{package}.rst", modules_page(package, modules))


def write(path: Path, text: str) -> None:
    """Write a page; the first blank line of a text is not a part of it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(text.lstrip("\n"), "utf-8")


def home_of(name: str) -> str:
    """Return the module that a public name comes from."""
    home: str = getattr(bemkit, name).__module__
    return home


def purposes() -> dict[str, str]:
    """Return what CONTRIBUTING says of each folder and module of the package, in its order."""
    tree = re.search(r"```text\nbemkit/\n(.*?)```", CONTRIBUTING.read_text("utf-8"), re.DOTALL)
    assert tree
    pieces = [line.split(maxsplit=1) for line in tree[1].splitlines()]
    return {place.rstrip("/").removesuffix(".py"): purpose for place, purpose in pieces}


def modules_of(folder: str) -> list[str]:
    """Return the modules of a folder and the folders in it."""
    paths = sorted((PACKAGE / folder).rglob("*.py"))
    return [
        ".".join(("bemkit", *path.relative_to(PACKAGE).with_suffix("").parts))
        for path in paths
        if path.stem != "__init__"
    ]


def heading(text: str, mark: str = "=") -> str:
    return f"{text}\n{mark * len(text)}\n\n"


def toctree(pages: Iterable[str]) -> str:
    return ".. toctree::\n   :hidden:\n\n" + "".join(f"   {page}\n" for page in pages) + "\n"


def index_page(folders: list[str], by_folder: dict[str, list[str]]) -> str:
    """List the names of the package, by folder."""
    text = heading("Names of bemkit") + "Each is a name of ``bemkit``, such as ``bemkit.Scene``.\n\n"
    text += toctree(f"names/{folder}" for folder in folders)
    for folder in folders:
        text += f".. rubric:: {purposes()[folder].capitalize()}\n\n.. currentmodule:: bemkit\n\n"
        text += ".. autosummary::\n   :nosignatures:\n\n" + "".join(f"   {name}\n" for name in by_folder[folder]) + "\n"
    return text


def names_page(folder: str, names: list[str]) -> str:
    """Show public names that live in a folder, with their members."""
    text = heading(f"bemkit: {folder}") + f"{purposes()[folder].capitalize()}.\n\n"
    for name in names:
        text += heading(name, "-")
        if not isinstance(getattr(bemkit, name), type):
            text += f".. autofunction:: bemkit.{name}\n\n"
        else:
            inherits = "" if issubclass(getattr(bemkit, name), Exception) else "   :inherited-members:\n"
            text += f".. autoclass:: bemkit.{name}\n   :members:\n{inherits}\n"
    return text


def modules_page(package: str, modules: list[str]) -> str:
    """Show the modules of a folder; members that are names of the package are on other pages."""
    text = heading(package)
    for module in modules:
        text += heading(module, "-") + f".. automodule:: {module}\n   :members:\n   :member-order: bysource\n"
        public = [name for name in bemkit.__all__ if home_of(name) == module]
        if public:
            text += f"   :exclude-members: {', '.join(public)}\n\n"
            text += f"Names of ``bemkit``: {', '.join(f':py:obj:`bemkit.{name}`' for name in public)}.\n"
        text += "\n"
    return text


if __name__ == "__main__":
    main()
