"""Numbers of a scene by their places in scene files: which there are, and the scene with other values."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, cast, get_type_hints

import numpy as np

from bemkit.formulas import closest
from bemkit.scene.assembly import Assembly
from bemkit.scene.body import Body
from bemkit.scene.conditions import Part
from bemkit.scene.scene import Scene
from bemkit.scene.serialisation import unstructure
from bemkit.scene.toml import scene_from_table, scene_to_toml
from bemkit.studies.engine import StudyError

_NAME = r'(?:"[^"]+"|[^.\[\]"=\s]+)'
_KEY = re.compile(rf"{_NAME}(?:\.{_NAME}|\[\d+\])*")
_STEP = re.compile(rf"{_NAME}|\[\d+\]")
_LAWS = ("law", "solver")
_LOADS = ("parts", "body_forces", "load_factors", "contacts", "touching")
Step = str | int


@dataclass(frozen=True)
class Key:
    """The place of a number in a scene file.

    Parameters
    ----------
    text : str
        Names with dots between them, and numbers of list entries from 0 on in brackets:
        ``bodies.punch.placement.shift[0]``. A name with a dot stands in quotation marks.

    Raises
    ------
    StudyError
        If the text is no such place.
    """

    text: str

    def __post_init__(self) -> None:
        if not _KEY.fullmatch(self.text):
            raise StudyError(f"key {self.text!r}: give a place in a scene file, such as law.friction_coefficient")

    @property
    def steps(self) -> tuple[Step, ...]:
        """The names and numbers that lead there."""
        found = _STEP.findall(self.text)
        return tuple(int(step[1:-1]) if step.startswith("[") else step.strip('"') for step in found)

    @property
    def is_of_law(self) -> bool:
        """Whether it belongs to the friction law of all contacts, or to the solver."""
        return self.steps[0] in _LAWS

    @property
    def keeps_bodies(self) -> bool:
        """Whether other values leave the elastic bodies, their meshes and their places as they are."""
        steps = self.steps
        if steps[0] == "bodies":  # bodies.NAME.parts.PART.condition...
            steps = steps[2:]
        return self.is_of_law or bool(steps and steps[0] in _LOADS and steps[1:2] != ("within",))


class VariedScene:
    """A scene, and the same with other numbers.

    Parameters
    ----------
    scene : Scene or Assembly
        Without Python functions, which a scene file cannot hold.

    Raises
    ------
    SceneError
        If it cannot be written as a scene file.
    """

    def __init__(self, scene: Scene | Assembly) -> None:
        self.scene = scene
        self.text = scene_to_toml(scene)
        self._table = tomllib.loads(self.text)

    def with_values(self, values: Mapping[Key, float]) -> Scene | Assembly:
        """Return the scene with other numbers at some places.

        Raises
        ------
        StudyError
            If a place does not exist in the scene, or holds no number; the message names the key.
        SceneError
            If the scene refuses a value; the message names the key.
        """
        table: Any = self._table
        for key, value in values.items():
            # whole numbers fit where numbers of elements stand, and everywhere else
            number = int(value) if float(value).is_integer() else float(value)
            table = _replaced(table, self.scene, type(self.scene), key.steps, number, "")
        return scene_from_table(table)

    def check(self, keys: Sequence[Key]) -> None:
        """Refuse keys that lead to no number of the scene; see `with_values`."""
        for key in keys:
            _replaced(self._table, self.scene, type(self.scene), key.steps, 0, "")


def _replaced(table: Any, node: Any, declared: Any, steps: tuple[Step, ...], value: float, path: str) -> Any:
    """Return what a scene file says of an object, with a number at a place inside it.

    Parameters
    ----------
    table : object
        What the file says now; None if the object has its default value.
    node, declared : object, type
        The object, and the type under which it is held.
    steps : tuple
        From the object to the number.
    value : float
    path : str
        Of the object.
    """
    if not steps:
        _check_number(node, path)
        return value
    step, rest = steps[0], steps[1:]
    content = unstructure(node, declared) if table is None and node is not None else table
    inner, inner_declared = _inside(node, declared, step, path)
    inner_path = f"{path}[{step}]" if isinstance(step, int) else f"{path}.{step}".lstrip(".")
    if isinstance(step, int):
        items = list(content)
        items[step] = _replaced(items[step], inner, inner_declared, rest, value, inner_path)
        return items
    entries = {"kind": content} if isinstance(content, str) else dict(content or {})
    entries[step] = _replaced(entries.get(step), inner, inner_declared, rest, value, inner_path)
    return entries


def _inside(node: Any, declared: Any, step: Step, path: str) -> tuple[Any, Any]:
    """Return what stands in an object under a name or number, and its declared type."""
    if node is None:
        raise StudyError(f"{path} is left out in the scene: write it there, then vary it")
    if isinstance(step, int):
        if not isinstance(node, tuple | list | np.ndarray):
            raise StudyError(f"{path}[{step}]: {path} is no list: leave [{step}] out")
        if step >= len(node):
            raise StudyError(f"{path}[{step}]: unknown entry: {path} has {len(node)}, counted from 0")
        return node[step], None
    if isinstance(node, tuple | list) and node and isinstance(node[0], Part | Body):
        named = {entry.name: entry for entry in node}
        return named[_known(step, list(named), path)], None
    if isinstance(node, Mapping):
        return node.get(step), None
    if is_dataclass(node):
        names = [entry.name for entry in fields(node) if entry.init and entry.name != "name"]
        _known(step, names, path)
        return getattr(node, step), _declared_types(cast(type, type(node)))[step]
    what = "a list: give the number of an entry, such as [0]" if isinstance(node, tuple | list) else "no table"
    raise StudyError(f"{path}.{step}: unknown key: {path} is {what}")


@cache
def _declared_types(of: type) -> dict[str, Any]:
    return get_type_hints(of)


def _known(name: str, names: list[str], path: str) -> str:
    if name in names:
        return name
    known = f"the keys are {', '.join(names)}" if names else "there are no keys here"
    raise StudyError(f"{f'{path}.{name}'.lstrip('.')}: unknown key: {known}{closest(name, names)}")


def _check_number(node: Any, path: str) -> None:
    """Refuse what is neither a number nor a formula that a number can replace."""
    if isinstance(node, tuple | list | np.ndarray):
        raise StudyError(f"{path} is a list: vary one number of it, such as {path}[0]")
    if isinstance(node, bool | str | Enum):
        raise StudyError(f"{path} is a word: only numbers can be varied; write a scene file for each word")
    if is_dataclass(node) and not callable(node):
        names = [entry.name for entry in fields(node) if entry.init]
        remedy = f"vary one number of it, such as {path}.{names[0]}" if names else "there is no number in it"
        raise StudyError(f"{path} is a table: {remedy}")
