"""Numbers of a scene by their places in scene files: which there are, and the scene with other values."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from enum import Enum

import numpy as np

from bemkit.scene.assembly import Assembly
from bemkit.scene.places import Place, PlaceError, value_at, with_value
from bemkit.scene.scene import Scene

_LAWS = ("law", "solver")
_LOADS = ("parts", "body_forces", "load_factors", "steps", "contacts", "touching")


@dataclass(frozen=True)
class Key(Place):
    """The place of a number in a scene file; see `Place`."""

    @property
    def is_of_law(self) -> bool:
        """Whether it belongs to the friction law of all contacts, or to the solver."""
        return self.names[0] in _LAWS

    @property
    def keeps_bodies(self) -> bool:
        """Whether other values leave the elastic bodies, their meshes and their places as they are."""
        names = self.names
        if names[0] == "bodies":  # bodies.NAME.parts.PART.condition...
            names = names[2:]
        return self.is_of_law or bool(names and names[0] in _LOADS and names[1:2] != ("within",))


def with_values(scene: Scene | Assembly, values: Mapping[Key, float]) -> Scene | Assembly:
    """Return a scene with other numbers at some places.

    Raises
    ------
    PlaceError
        If a place does not exist in the scene, holds no number, or refuses a value; the message names the key.
    """
    for key, value in values.items():
        check_number(scene, key)
        # whole numbers fit where numbers of elements stand, and everywhere else
        scene = with_value(scene, key, int(value) if float(value).is_integer() else float(value))
    return scene


def check_number(scene: Scene | Assembly, key: Key) -> None:
    """Refuse a key that leads neither to a number nor to a formula that a number can replace; see `with_values`."""
    value = value_at(scene, key)
    if isinstance(value, tuple | list | np.ndarray):
        raise PlaceError(f"{key.text} is a list: vary one number of it, such as {key.text}[0]")
    if isinstance(value, bool | str | Enum):
        raise PlaceError(f"{key.text} is a word: only numbers can be varied; write a scene file for each word")
    if is_dataclass(value) and not callable(value):
        names = [entry.name for entry in fields(value) if entry.init]
        remedy = f"vary one number of it, such as {key.text}.{names[0]}" if names else "there is no number in it"
        raise PlaceError(f"{key.text} is a table: {remedy}")
