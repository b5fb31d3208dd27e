"""Frozen dataclasses to plain tables (for TOML), one plain recursion: what `bemkit.scene.serialisation` reads."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from typing import Any, cast, get_args

import numpy as np

from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.formulas import Expression, shorten
from bemkit.scene.registry import LAWS, default_of, is_required, registry_of, type_of_field


class UnstructureError(InputError):
    """An object that cannot be written as a table."""


def unstructure(value: Any, declared: Any = None, path: str = "", *, keep_defaults: bool = False) -> Any:
    """Turn an object into numbers, texts, lists and tables, without keys that have their default value.

    Parameters
    ----------
    value : object
    declared : type
        The type under which the object is held: decides whether its class must be named by a word.
    path : str
        Where the object is, for messages.
    keep_defaults : bool
        Whether the object's own fields are written even where they have their default value.

    Raises
    ------
    UnstructureError
        If there is a Python function inside, or an object of a class without a word.
    """
    if isinstance(value, Expression):
        return value.text
    if isinstance(value, Enum):
        return value.value
    if isinstance(value, bool | int | float | str):
        return value
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if isinstance(value, tuple | list):
        inner = get_args(declared)[0] if get_args(declared) else None
        return [unstructure(item, inner, f"{path}[{index}]") for index, item in enumerate(value)]
    if isinstance(value, Mapping):
        inner = get_args(declared)[1] if get_args(declared) else None
        return {key: unstructure(item, inner, f"{path}.{key}") for key, item in value.items()}
    if is_dataclass(value):
        return _unstructure_dataclass(_without_file(value), declared, path, keep_defaults)
    if callable(value):
        raise UnstructureError(f"{path}: a Python function cannot be written to TOML: use Expression('...') instead")
    raise UnstructureError(
        f"{path}: {shorten(repr(value))} cannot be written to TOML: use numbers, texts or Expression"
    )


def _without_file(value: Any) -> Any:
    """Return the shape or profile that a file holds instead of the file, so that the text does not depend on it."""
    from bemkit.contact.rough_profile import Profile  # only needed for writing
    from bemkit.geometry.files.shape_file import ShapeFile

    if isinstance(value, Profile):
        return value.profile
    return value.shape if isinstance(value, ShapeFile) else value


def _unstructure_dataclass(value: Any, declared: Any, path: str, keep_defaults: bool) -> Any:
    prefix = f"{path}." if path else ""
    table = {
        entry.name: unstructure(content, type_of_field(cast(type, type(value)), entry.name), prefix + entry.name)
        for entry, content in _written_fields(value, keep_defaults)
    }
    registry = LAWS if isinstance(value, FrictionLaw) else registry_of(declared)
    if registry is None:
        return table
    try:
        kind = registry.kind_of(value)
    except InputError as error:
        raise UnstructureError(f"{path}: {error}") from error
    if table and kind == registry.listed:
        return next(iter(table.values()))
    return registry.written(kind, table)


def _written_fields(value: Any, keep_defaults: bool) -> Iterator[tuple[Field[Any], Any]]:
    for entry in fields(value):
        content = getattr(value, entry.name)
        # the number of elements is always written, so that a file states how fine its mesh is
        is_kept = keep_defaults or entry.name == "elements" or not _is_default(content, entry)
        if entry.init and content is not None and is_kept:
            yield entry, content


def _is_default(content: object, entry: Field[Any]) -> bool:
    if is_required(entry):
        return False
    default = default_of(entry)
    return type(content) is type(default) and bool(np.all(content == default))
