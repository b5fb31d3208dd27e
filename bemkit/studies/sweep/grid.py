"""Numbers of a scene by their keys, the values of a sweep, and the scene with other values."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from enum import Enum
from itertools import product

import numpy as np

from bemkit.scene.keys import Key, SceneKeyError, value_at, with_value
from bemkit.scene.scene import Scene
from bemkit.studies.engine import StudyError

_LAWS = ("law", "solver")
_LOADS = ("parts", "body_forces", "load_factors", "steps", "contacts", "touching")
MOST_ROWS = 100_000
_DECIMAL = 12
"""Largest number of characters of a number that was typed rather than computed."""


def keeps_bodies(key: Key) -> bool:
    """Return whether other values at a key leave the elastic bodies, their meshes and their places as they are."""
    names = key.names[2:] if key.names[0] == "bodies" else key.names  # bodies.NAME.parts.PART.condition...
    return key.names[0] in _LAWS or bool(names and names[0] in _LOADS and names[1:2] != ("within",))


def read_variation(text: str) -> tuple[str, tuple[float, ...]]:
    """Return key and values of ``KEY=FIRST:LAST:COUNT`` or ``KEY=VALUE,VALUE,...``.

    Raises
    ------
    StudyError
        If the text has another form.
    """
    key, separator, values = (piece.strip() for piece in text.partition("="))
    if not separator or not key or not values:
        raise StudyError(f"vary is {text!r}: give KEY=FIRST:LAST:COUNT or KEY=VALUE,VALUE,...")
    pieces = values.split(":")
    if len(pieces) == 1:
        return key, tuple(_number(value, text) for value in values.split(","))
    if len(pieces) != 3 or not pieces[2].strip().isdecimal() or int(pieces[2]) < 1:
        raise StudyError(f"vary is {text!r}: give a range as FIRST:LAST:COUNT, such as 0:1:11 for 0, 0.1, ..., 1")
    count = min(int(pieces[2]), MOST_ROWS + 1)
    return key, spaced(_number(pieces[0], text), _number(pieces[1], text), count)


def read_variations(texts: Sequence[str]) -> dict[str, tuple[float, ...]]:
    """Return the values of each key of some texts; see `read_variation`.

    Raises
    ------
    StudyError
        If a text has another form, or a key is given twice.
    """
    values: dict[str, tuple[float, ...]] = {}
    for key, own in map(read_variation, texts):
        if key in values:
            raise StudyError(f"key {key!r} is given twice: give all its values at once")
        values[key] = own
    return values


def spaced(first: float, last: float, count: int) -> tuple[float, ...]:
    """Return numbers at equal distances, without the last digit of decimal ones: 0.3 and no 0.30000000000000004."""
    return tuple(_without_noise(value) for value in np.linspace(first, last, count).tolist())


def _without_noise(value: float) -> float:
    rounded = float(f"{value:.14g}")
    return rounded if len(repr(rounded)) <= _DECIMAL else value


def all_rows(vary: Mapping[str, Sequence[float]]) -> tuple[tuple[Key, ...], list[tuple[float, ...]]]:
    """Return the keys, and every combination of their values; that of the first key changes last.

    Raises
    ------
    StudyError
        If there is no key or no value, a value is not finite or given twice, or there are too many rows.
    """
    if not vary:
        raise StudyError("vary is empty: give at least one key and its values")
    columns: list[list[float]] = []
    for name, given in vary.items():
        values = [_finite(value, name) for value in given]
        if not values:
            raise StudyError(f"{name}: there are no values: give at least one")
        repeated = next((value for k, value in enumerate(values) if value in values[:k]), None)
        if repeated is not None:
            raise StudyError(f"{name}: {repeated:g} is given twice: remove one")
        columns.append(values)
    n_rows = math.prod(map(len, columns))
    if n_rows > MOST_ROWS:
        raise StudyError(f"the sweep has {n_rows} rows: give fewer values, at most {MOST_ROWS} rows")
    return tuple(Key(name) for name in vary), list(product(*columns))


def _finite(value: object, name: str) -> float:
    if isinstance(value, bool | str) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise StudyError(f"{name}: {value!r} is not a finite number: give numbers")
    return float(value)


def _number(text: str, whole: str) -> float:
    try:
        return float(text)
    except ValueError:
        raise StudyError(f"vary is {whole!r}: {text.strip()!r} is not a number: give numbers such as 0.5") from None


def with_values(scene: Scene, values: Mapping[Key, float]) -> Scene:
    """Return a scene with other numbers at some keys.

    Raises
    ------
    SceneKeyError
        If a key does not exist in the scene, has no number, or does not accept a value; the message names the key.
    """
    for key, value in values.items():
        check_number(scene, key)
        # whole numbers fit for numbers of elements, and everywhere else
        scene = with_value(scene, key, int(value) if float(value).is_integer() else float(value))
    return scene


def check_number(scene: Scene, key: Key) -> None:
    """Check that a key leads to a number, or to a formula that a number can replace; see `with_values`."""
    value = value_at(scene, key)
    if isinstance(value, tuple | list | np.ndarray):
        raise SceneKeyError(f"{key.text} is a list: vary one number of it, such as {key.text}[0]")
    if isinstance(value, bool | str | Enum):
        raise SceneKeyError(
            f"{key.text} is not a number; only numbers can be varied: write a scene file for each value"
        )
    if is_dataclass(value) and not callable(value):
        names = [entry.name for entry in fields(value) if entry.init]
        remedy = f"vary one number of it, such as {key.text}.{names[0]}" if names else "there is no number in it"
        raise SceneKeyError(f"{key.text} is a table: {remedy}")
