"""Plain tables (from TOML) to frozen dataclasses, one plain recursion over the declared types.

A class that a word names is the word itself (``solver = "semismooth-newton"``) or a table with its options
(``{ kind = "tresca", bound_value = 0.5 }``). All mistakes of a table are found in one pass.
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from enum import Enum
from functools import cache
from typing import Any, TypeVar, cast, get_args, get_origin

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import Expression, closest, nearest, shorten
from bemkit.scene.registry import SYNONYMS, Registry, heading_of, is_required, options_of, registry_of, type_of_field
from bemkit.scene.unit_names import UnitNames, in_units_of_scene

T = TypeVar("T")

_MISSING_REMEDIES: Mapping[str, str] = types.MappingProxyType(
    {
        "title": "add a line such as title = 'Block on a foundation'",
        "shape": "add a table [shape] with kind = 'rectangle', width = 1.0, height = 1.0, or another shape",
        "material": "add a table [material] with youngs_modulus and poisson_ratio",
        "parts": "add tables [parts.NAME] with sides and condition",
        "condition": "add condition = 'clamped', or a table with kind = 'traction', 'contact' ...",
        "bodies": "add tables [bodies.NAME], each with a shape and a material",
        "sides": "add sides = ['one.top', 'two.bottom'], each a body and one of its sides",
        "obstacle": "add obstacle = { kind = 'half-plane', point = [0.0, 0.0], normal = [0.0, 1.0] } or another",
    }
)


class StructureError(InputError):
    """A table that does not describe the object of the declared type.

    Parameters
    ----------
    mistakes : iterable of str
        One line for each mistake: ``key: value: remedy``. The message consists of these lines.
    """

    def __init__(self, mistakes: Iterable[str]) -> None:
        self.mistakes = tuple(mistakes)
        super().__init__("\n".join(self.mistakes))

    def __reduce__(self) -> tuple[type[StructureError], tuple[tuple[str, ...]]]:
        return StructureError, (self.mistakes,)


def structure(
    table: object, declared: type[T], units: UnitNames | None = None, field: tuple[type, str] | None = None
) -> T:
    """Turn a table into an object.

    Parameters
    ----------
    table : dict, list, str, number or bool
    declared : type
    units : UnitNames, optional
        Those of the scene, to which numbers with units such as ``"210 GPa"`` are converted.
    field : (type, str), optional
        The class and the name of the field that the table is the value of, whose docstring states its unit.

    Raises
    ------
    StructureError
        With all mistakes, each naming the key, the value and the remedy.
    """
    try:
        return cast(T, _structured(table, declared, _Place("", units, field)))
    except RecursionError:
        raise StructureError(["nested too deeply: simplify it"]) from None


@dataclass(frozen=True)
class _Place:
    """Position of a value: the path of its key, the units of its scene, and the class and name of its field if any."""

    path: str
    units: UnitNames | None
    field: tuple[type, str] | None = None

    def key(self, name: str, owner: type | None = None) -> _Place:
        path = f"{self.path}.{name}" if self.path else name
        return _Place(path, self.units, (owner, name) if owner is not None else None)

    def entry(self, index: int) -> _Place:
        return replace(self, path=f"{self.path}[{index}]")


def _structured(value: object, declared: Any, at: _Place) -> Any:
    """Return the object of a declared type that a value states; see `structure`."""
    if at.field is not None and isinstance(value, str):
        value = _made(at, in_units_of_scene, value, *at.field, at.units)
    return _made(at, _reader_of(declared), value, declared, at)


def _made(at: _Place, function: Callable[..., Any], *arguments: Any, **values: Any) -> Any:
    """Call a function on the input of the user; its error becomes a mistake at the path."""
    try:
        return function(*arguments, **values)
    except (StructureError, RecursionError):
        raise
    except Exception as error:  # any error of a constructor rejects the text
        begin = f"{at.path}: " if at.path else ""
        raise StructureError([begin + line for line in str(error).splitlines() or [""]]) from error


def _structured_all(entries: Mapping[Any, tuple[object, Any, _Place]], mistakes: Iterable[str] = ()) -> dict[Any, Any]:
    """Return objects from several values, each with its type and path; all mistakes are raised together."""
    structured, found = {}, list(mistakes)
    for key, entry in entries.items():
        try:
            structured[key] = _structured(*entry)
        except StructureError as error:
            found += error.mistakes
    if found:
        raise StructureError(found)
    return structured


@cache
def _reader_of(declared: Any) -> Callable[[Any, Any, _Place], Any]:
    """Return the function (value, declared, at) that reads values of a type."""
    if heading_of(declared):
        return _named
    if registry_of(declared) is not None:
        return _tagged
    if options_of(declared):
        return _one_of
    if declared in _PLAIN:
        return lambda value, declared, at: _PLAIN[declared](value)
    if get_origin(declared) is tuple:
        return _tuple
    if get_origin(declared) is Mapping:
        return _mapping
    if is_dataclass(declared):
        return _table
    return _member if _is_class(declared, Enum) else lambda value, declared, at: value


def _number(value: object) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise InputError(f"{_show(value)} is not a number: give a number such as 0.5")
    try:
        number = float(value)
    except OverflowError:
        number = math.nan
    if math.isnan(number):
        raise InputError(f"{_show(value)} is not a usable number: give a number such as 0.5")
    return number


def _integer(value: object) -> int:
    if isinstance(value, bool) or not isinstance(value, int):
        raise InputError(f"{_show(value)} is not a whole number: give one such as 320")
    return value


def _exactly(value: object, declared: type[T], description: str) -> T:
    if isinstance(value, declared):
        return value
    raise InputError(f"{_show(value)} does not fit: give {description}")


def _array(value: object) -> FloatArray:
    items = _exactly(value, list, "a list of numbers")
    return np.array([_array(item) if isinstance(item, list) else _number(item) for item in items], dtype=float)


_PLAIN: Mapping[Any, Callable[[Any], Any]] = types.MappingProxyType(
    {
        float: _number,
        int: _integer,
        bool: lambda value: _exactly(value, bool, "true or false"),
        str: lambda value: _exactly(value, str, "a text in quotation marks"),
        FloatArray: _array,
        Expression: Expression,
    }
)


def _member(value: object, declared: type[Enum], at: _Place) -> Enum:
    words = [str(member.value) for member in declared]
    for member in declared:
        if member.value == value:
            return member
    raise InputError(f"{_show(value)} is unknown: give one of {', '.join(words)}{closest(str(value), words)}")


def _tuple(value: object, declared: Any, at: _Place) -> tuple[Any, ...]:
    items, inner = _exactly(value, list, "a list in square brackets"), get_args(declared)
    if len(inner) == 2 and inner[1] is Ellipsis:
        inner = (inner[0],) * len(items)
    if len(items) != len(inner):
        raise InputError(f"{_show(value)} has {len(items)} entries: give {len(inner)}")
    return tuple(_structured_all({k: (items[k], inner[k], at.entry(k)) for k in range(len(items))}).values())


def _mapping(value: object, declared: Any, at: _Place) -> dict[str, Any]:
    items, inner = _exactly(value, dict, "a table"), get_args(declared)[1]
    return _structured_all({key: (item, inner, at.key(key)) for key, item in items.items()})


def _named(value: object, declared: Any, at: _Place) -> tuple[Any, ...]:
    """Return the entries of a tuple from tables that are headed by their names."""
    entry_type, heading = get_args(declared)[0], heading_of(declared)
    of_bodies = ", in one of several bodies [bodies.BODY.parts.NAME]" if heading == "parts" else ""
    tables = _exactly(value, dict, f"a table of {heading}: write [{heading}.NAME]{of_bodies}")
    role = re.sub(r"(?<!^)(?=[A-Z])", " ", entry_type.__name__).lower()
    remedy = f"write the name of a {role} in its heading [{heading}.NAME]"
    has_name = [name for name, table in tables.items() if isinstance(table, dict) and "name" in table]
    mistakes = [f"{at.key(name).path}: unknown key 'name': {remedy}" for name in has_name]
    entries = {
        name: ({"name": name, **table} if isinstance(table, dict) else table, entry_type, at.key(name))
        for name, table in tables.items()
        if name not in has_name
    }
    return tuple(_structured_all(entries, mistakes).values())


def _one_of(value: object, declared: Any, at: _Place) -> Any:
    options = options_of(declared)
    for option in options:
        if _fits(value, option):
            return _structured(value, option, at)
    raise InputError(f"{_show(value)} does not fit: give {' or '.join(_name(option) for option in options)}")


def _tagged(value: object, declared: Any, at: _Place) -> Any:
    """Return an object whose class is named by a word, or by the kind of a table."""
    registry = cast(Registry, registry_of(declared))  # the reader is chosen by it
    if isinstance(value, list) and registry.listed:
        listed = _tuple(value, tuple[declared, ...], at)
        return _made(at, registry.find(registry.listed), listed)
    table = {"kind": value} if isinstance(value, str) else value
    table = registry.with_options(_exactly(table, dict, f"a {registry.role} as a word or as a table with its kind"))
    if "kind" not in table:
        raise InputError(f"kind is missing: add kind = one of {', '.join(registry.names())}")
    of_kind = at.key("kind")
    named_class = _made(of_kind, registry.find, _structured(table.pop("kind"), str, of_kind))
    return _structured(table, named_class, at)


def _table(value: object, declared: Any, at: _Place) -> Any:
    """Return a dataclass from the table of its fields."""
    table = _exactly(value, dict, "a table of keys and values")
    known = {entry.name: entry for entry in fields(declared) if entry.init}
    unknown = sorted(table.keys() - known.keys())
    missing = [name for name, entry in known.items() if name not in table and is_required(entry)]
    listed = f"the keys are {', '.join(known)}" if known else "there are no keys here"
    mistakes = [
        f"{at.key(shorten(key)[1:-1]).path}: unknown key: {listed}{closest(key, known, SYNONYMS)}" for key in unknown
    ]
    # a key that is missing because it is misspelt is one mistake
    misspelt = {nearest(key, known, SYNONYMS) for key in unknown}
    mistakes += [
        f"{at.key(name).path}: missing: {_MISSING_REMEDIES.get(name, f'add {name} = ...')}"
        for name in missing
        if name not in misspelt
    ]
    entries = {
        name: (table[name], type_of_field(declared, name), at.key(name, declared)) for name in known if name in table
    }
    return _made(at, declared, **_structured_all(entries, mistakes))


def _fits(value: object, option: Any) -> bool:
    """Return whether a value of this TOML type can become the alternative."""
    match value:
        case bool():
            return option is bool
        case int() | float():
            return option is float or (option is int and isinstance(value, int))
        case str():
            return option is str or option is Expression or _is_class(option, Enum) or registry_of(option) is not None
        case list():
            return _is_list(option)
        case dict():
            return is_dataclass(option) or registry_of(option) is not None
    return False


def _name(option: Any) -> str:
    names = {float: "a number", int: "a whole number", str: "a text", bool: "true or false", Expression: "a formula"}
    if (registry := registry_of(option)) is not None:
        return f"a {registry.role}"
    return names.get(option, "a list" if _is_list(option) else "a table")


def _is_class(declared: Any, parent: type) -> bool:
    return isinstance(declared, type) and issubclass(declared, parent)


def _is_list(declared: Any) -> bool:
    return get_origin(declared) is tuple or declared == FloatArray  # whose origin depends on the version of numpy


def _show(value: object) -> str:
    return text if len(text := repr(value)) <= 60 else text[:60] + "..."
