"""Keys of scene files: the value of a scene at a key, and the scene with another value there."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import partial
from types import UnionType
from typing import Any, TypeVar, Union, cast, get_args, get_origin

import numpy as np

from bemkit.errors import InputError
from bemkit.formulas import closest
from bemkit.scene.registry import HEADINGS, SYNONYMS, reference_of, type_of_field
from bemkit.scene.unit_names import UnitNames

_NAME = r'(?:"[^"]+"|[^.\[\]"=\s]+)'
_PLACE = re.compile(rf"{_NAME}(?:\.{_NAME}|\[\d+\])*")
_STEP = re.compile(rf"{_NAME}|\[\d+\]")

Node = TypeVar("Node")


class SceneKeyError(InputError):
    """A key that a scene does not have, or a value that does not fit there; the message names the key."""


@dataclass(frozen=True)
class Key:
    """The path of a value in a scene file.

    Parameters
    ----------
    text : str
        Names with dots between them, and indices of list entries from 0 on in brackets:
        ``bodies.punch.placement.shift[0]``. Quote a name with a dot.

    Raises
    ------
    SceneKeyError
        If the text has another form.
    """

    text: str

    def __post_init__(self) -> None:
        if not _PLACE.fullmatch(self.text):
            raise SceneKeyError(f"key {self.text!r}: give a key of a scene file, such as law.friction_coefficient")

    @property
    def names(self) -> tuple[str | int, ...]:
        """The names and indices of the path, from the outside in."""
        steps = _STEP.findall(self.text)
        return tuple(int(name[1:-1]) if name.startswith("[") else name.strip('"') for name in steps)


def read_setting(text: str) -> tuple[Key, object]:
    """Return key and value of ``KEY=VALUE``, the value as in scene files; a word needs no quotation marks.

    Raises
    ------
    SceneKeyError
        If the text has another form.
    """
    import tomllib

    # the key of a scene file may hold an equals sign only inside quotation marks
    found = re.fullmatch(r'\s*((?:"[^"]*"|[^"=])+?)\s*=\s*(.+?)\s*', text, re.DOTALL)
    if not found:
        raise SceneKeyError(f"set is {text!r}: give KEY=VALUE, such as law.friction_coefficient=0.3")
    key, value = Key(found[1]), found[2]
    try:
        return key, tomllib.loads(f"value = {value}")["value"]
    except (tomllib.TOMLDecodeError, KeyError, ValueError, RecursionError):
        if value[0] in "[{\"'":
            raise SceneKeyError(
                f"{key.text}: {value!r} is not a value of a scene file: check brackets and quotes"
            ) from None
        return key, value


def with_settings(scene: Node, texts: Sequence[str]) -> Node:
    """Return a scene with other values at some keys, each given as ``KEY=VALUE``; see `with_value`.

    Raises
    ------
    SceneKeyError
        If a text has another form, a key is given twice, there is no such key, or its value does not fit there.
    """
    known = set[Key]()
    for key, value in map(read_setting, texts):
        if key in known:
            raise SceneKeyError(f"{key.text} is set twice: give it one value")
        known.add(key)
        scene = with_value(scene, key, value)
    return scene


def value_at(scene: object, key: Key) -> Any:
    """Return the value at a key of a scene.

    Raises
    ------
    SceneKeyError
        If there is no such key.
    """
    node, declared, path = scene, cast(Any, type(scene)), ""
    for name in key.names:
        node, declared, path = _inside(node, declared, name, path)
    return node


def with_value(scene: Node, key: Key, value: object) -> Node:
    """Return a scene with another value at a key; all else are the same objects.

    Parameters
    ----------
    scene : Scene
    key : Key
    value : object
        As scene files state it (a number, also with a unit, a formula, a word, a list or a table), or an object of
        Python.

    Raises
    ------
    SceneKeyError
        If there is no such key, or the value does not fit there.
    """
    fitting = partial(_fitting, value, cast(Any, scene).result_units)
    changed: Node = _replaced(scene, type(scene), key.names, fitting, "", None)
    return changed


def _replaced(
    node: Any,
    declared: Any,
    names: tuple[str | int, ...],
    fitting: Callable[[Any, str, tuple[type, str] | None], Any],
    path: str,
    field: tuple[type, str] | None,
) -> Any:
    """Return an object with another value at a key inside; `field`: class and name of the field it is in."""
    if not names:
        return fitting(declared, path, field)
    name, rest = names[0], names[1:]
    inner, inner_declared, inner_path = _inside(node, declared, name, path)
    if is_dataclass(node):
        field = type(node), str(name)
    changed = _replaced(inner, inner_declared, rest, fitting, inner_path, field)
    if isinstance(node, Mapping):
        return {**node, name: changed}
    if isinstance(node, np.ndarray):
        return np.array([changed if k == name else entry for k, entry in enumerate(node.tolist())])
    if isinstance(node, tuple | list):
        number = name if isinstance(name, int) else [entry.name for entry in node].index(name)
        return (*node[:number], changed, *node[number + 1 :])
    try:
        return replace(node, **{str(name): changed})
    except SceneKeyError:
        raise
    except ValueError as error:
        raise SceneKeyError(f"{path}: {error}" if path else str(error)) from error


def _fitting(value: object, units: UnitNames | None, declared: Any, path: str, field: tuple[type, str] | None) -> Any:
    """Return a value in the type at the key, a number with a unit in the units of the scene."""
    if not isinstance(value, bool | int | float | str | list | dict):
        return value
    from bemkit.scene.serialisation import StructureError, structure  # heavy, and only for scenes that change

    try:
        return structure(value, declared, units, field)
    except StructureError as error:
        raise SceneKeyError(f"{path}: {error}") from error


def _inside(node: Any, declared: Any, name: str | int, path: str) -> tuple[Any, Any, str]:
    """Return the entry of an object under a name or number, its declared type, and its path."""
    if node is None:
        raise SceneKeyError(f"{path} is not given in the scene: write it there first")
    inner_path = f"{path}[{name}]" if isinstance(name, int) else f"{path}.{name}".lstrip(".")
    if isinstance(name, int):
        if not isinstance(node, tuple | list | np.ndarray):
            raise SceneKeyError(f"{inner_path}: {path} is not a list: remove [{name}]")
        if name >= len(node):
            raise SceneKeyError(f"{inner_path}: unknown entry: {path} has {len(node)}, counted from 0")
        return node[name], _entry_type(declared, name, node[name]), inner_path
    if isinstance(node, tuple | list) and node and reference_of(type(node[0])) in HEADINGS:
        named = {entry.name: entry for entry in node}
        return named[_known(name, list(named), path)], type(node[0]), inner_path
    if isinstance(node, Mapping):
        return node.get(name), (get_args(declared) or (None, float))[1], inner_path
    if is_dataclass(node):
        _known(name, [entry.name for entry in fields(node) if entry.init and entry.name != "name"], path)
        return getattr(node, name), type_of_field(cast(type, type(node)), name), inner_path
    kind = "a list: give the number of an entry, such as [0]" if isinstance(node, tuple | list) else "not a table"
    raise SceneKeyError(f"{path}.{name}: unknown key: {path} is {kind}")


def _entry_type(declared: Any, number: int, entry: object) -> Any:
    """Return the declared type of an entry of a list."""
    options = get_args(declared) if get_origin(declared) in (Union, UnionType) else (declared,)
    for option in options:
        if get_origin(option) is tuple:
            inner = get_args(option)
            return inner[0] if inner[-1] is Ellipsis else inner[number]
    return type(entry)


def _known(name: str, names: list[str], path: str) -> str:
    if name in names:
        return name
    known = f"the keys are {', '.join(names)}" if names else "there are no keys here"
    raise SceneKeyError(f"{f'{path}.{name}'.lstrip('.')}: unknown key: {known}{closest(name, names, SYNONYMS)}")
