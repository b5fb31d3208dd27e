"""Statements of a module."""

import ast
from collections.abc import Iterator
from pathlib import Path


def statements(path: Path) -> Iterator[ast.AST]:
    """Yield the statements of a module, in functions and branches too, without reading the many expressions."""
    nodes: list[ast.AST] = [ast.parse(path.read_text("utf-8"))]
    while nodes:
        node = nodes.pop()
        yield node
        for name in ("body", "orelse", "handlers", "finalbody", "cases"):
            nodes += getattr(node, name, ())
