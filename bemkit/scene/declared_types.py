"""The form of a declared type in scene files: a word of a registry, tables with headings, or one of several types."""

from __future__ import annotations

import types
from collections.abc import Callable
from dataclasses import MISSING, Field
from functools import cache
from typing import Any, Union, get_args, get_origin, get_type_hints

from bemkit.scene.registry import HEADINGS, REGISTRIES, Registry, reference_of


def registry_of(declared: Any) -> Registry | None:
    """Return the registry whose words name the classes of a declared type, None if there is none."""
    alternatives = options_of(declared) or (declared,)
    return next((registry for registry in REGISTRIES if registry.holds(alternatives)), None)


def heading_of(declared: Any) -> str:
    """Return the word that heads the tables of the entries of a tuple, each by its name; empty if none does."""
    inner = get_args(declared)
    is_listed = get_origin(declared) is tuple and inner[1:] == (Ellipsis,)
    return HEADINGS.get(reference_of(inner[0]), "") if is_listed else ""


def options_of(declared: Any) -> tuple[Any, ...]:
    """Return the alternatives of a union that a table can hold, empty for other types."""
    if get_origin(declared) not in (Union, types.UnionType):
        return ()
    options = get_args(declared)
    return tuple(option for option in options if option is not type(None) and get_origin(option) is not Callable)


@cache
def hints_of(declared: type) -> dict[str, Any]:
    """Return the declared types of the fields of a dataclass by name."""
    return get_type_hints(declared)


def is_required(entry: Field[Any]) -> bool:
    """Return whether a field of a dataclass has no default value."""
    return entry.default is MISSING and entry.default_factory is MISSING


def default_of(entry: Field[Any]) -> Any:
    """Return the default value of a field that is not required."""
    return entry.default if entry.default_factory is MISSING else entry.default_factory()
