"""Write the pages of the API reference, which autodoc fills from docstrings; `conf.py` does so before each build.

A page for each name of ``bemkit``, listed by the folder that it lives in, and one for each module of the folders that
researchers extend.
"""

from __future__ import annotations

import ast
import importlib
import re
import shutil
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

import bemkit

PACKAGE = Path(bemkit.__file__).parent
FOLDER = Path(__file__).parent / "api"
CONTRIBUTING = Path(__file__).parents[1] / "CONTRIBUTING.md"
EXTENDED = ("geometry", "operators", "contact", "solvers", "scene", "results", "studies", "testing", "reference")


def main() -> None:
    """Write all pages anew."""
    shutil.rmtree(FOLDER, ignore_errors=True)
    home = {name: home_of(name) for name in bemkit.__all__}
    write("bemkit", names_page(home))
    for name in home:
        write(f"names/{name}", name_page(name))
    for folder in EXTENDED:
        modules = [module for module in modules_of(folder) if documented(module)]
        write(folder, folder_page(folder, modules))
        for module in modules:
            write(f"modules/{module}", module_page(module, [name for name, place in home.items() if place == module]))


def write(name: str, text: str) -> None:
    """Write a page; the first blank line of a text is no part of it."""
    path = FOLDER / f"{name}.rst"
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


def documented(module: str) -> list[str]:
    """Return the names that a module defines for others: classes, functions and constants with a docstring."""
    tree = ast.parse(Path(importlib.import_module(module).__file__ or "").read_text("utf-8"))
    return [name for name in _defined(tree) if not name.startswith("_")]


def _defined(tree: ast.Module) -> Iterator[str]:
    for node, following in zip(tree.body, [*tree.body[1:], None], strict=True):
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name
        is_described = isinstance(following, ast.Expr) and isinstance(following.value, ast.Constant)
        if is_described and isinstance(node, ast.Assign | ast.AnnAssign):
            targets = node.targets if isinstance(node, ast.Assign) else [node.target]
            yield from (target.id for target in targets if isinstance(target, ast.Name))


def heading(text: str) -> str:
    return f"{text}\n{'=' * len(text)}\n"


def names_page(home: dict[str, str]) -> str:
    """List the names of the package, by folder."""
    order = list(purposes())
    folders = sorted(home, key=lambda name: (order.index(home[name].split(".")[1]), name))
    text = heading("bemkit") + "\nEverything below is a name of ``bemkit``, such as ``bemkit.Scene``.\n"
    text += "\n.. toctree::\n   :hidden:\n   :glob:\n\n   names/*\n"
    for folder, names in groupby(folders, lambda name: home[name].split(".")[1]):
        text += f"\n.. rubric:: {folder}: {purposes()[folder]}\n\n.. currentmodule:: bemkit\n\n"
        text += ".. autosummary::\n   :nosignatures:\n\n" + "".join(f"   {name}\n" for name in names)
    return text


def name_page(name: str) -> str:
    """Show one public name with its members, those that it inherits among them."""
    if not isinstance(getattr(bemkit, name), type):
        return f"{heading(name)}\n.. autofunction:: bemkit.{name}\n"
    inherits = "" if issubclass(getattr(bemkit, name), Exception) else "   :inherited-members:\n"
    return f"{heading(name)}\n.. autoclass:: bemkit.{name}\n   :members:\n{inherits}"


def folder_page(folder: str, modules: list[str]) -> str:
    """List the modules of a folder with their first sentences."""
    text = f"{heading(f'bemkit.{folder}')}\n{purposes()[folder].capitalize()}.\n"
    text += "\n.. toctree::\n   :hidden:\n\n" + "".join(f"   modules/{module}\n" for module in modules)
    return text + "\n.. autosummary::\n\n" + "".join(f"   {module}\n" for module in modules)


def module_page(module: str, public: list[str]) -> str:
    """Show the members of a module; those that are names of the package have a page of their own."""
    text = f"{heading(module)}\n.. automodule:: {module}\n   :members:\n   :member-order: bysource\n"
    if public:
        text += f"   :exclude-members: {', '.join(public)}\n\n.. rubric:: Names of ``bemkit``\n\n"
        text += ", ".join(f":py:obj:`bemkit.{name}`" for name in public) + "\n"
    return text


if __name__ == "__main__":
    main()
