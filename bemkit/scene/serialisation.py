"""Plain tables (from TOML) to frozen dataclasses and back.

cattrs converts field by field. Added here are strict numbers, formulas, arrays, and classes named by a word: either the
word alone (``solver = "semismooth-newton"``) or a table with its options (``{ kind = "tresca", bound_value = 0.5 }``).
"""

from __future__ import annotations

import math
import re
import types
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import MISSING, Field, fields, is_dataclass
from enum import Enum
from functools import cache
from typing import Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

import numpy as np
from cattrs import AttributeValidationNote, Converter
from cattrs.gen import make_dict_structure_fn

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.formulas import Expression, closest, shorten
from bemkit.scene.registry import HEADINGS, LAWS, REGISTRIES, Registry, reference_of

T = TypeVar("T")


class StructureError(InputError):
    """A table that does not describe the object of the declared type; the message is ``key: value: remedy``."""


class UnstructureError(InputError):
    """An object that cannot be written as a table."""


def structure(table: object, declared: type[T]) -> T:
    """Turn a table into an object.

    Parameters
    ----------
    table : dict, list, str, number or bool
    declared : type

    Returns
    -------
    object of the declared type

    Raises
    ------
    StructureError
        Naming the key, the value and the remedy.
    """
    try:
        return _converter().structure(table, declared)
    except RecursionError:
        raise StructureError("nested too deeply: simplify it") from None
    except Exception as error:  # whatever a constructor raised, it rejects the text of the user
        from bemkit.scene.explanations import explain

        raise StructureError(explain(error)) from error


def unstructure(value: Any, declared: Any = None, path: str = "", *, keep_defaults: bool = False) -> Any:
    """Turn an object into numbers, texts, lists and tables, leaving out what has its default value.

    Parameters
    ----------
    value : object
    declared : type
        The type under which the object is held: decides whether its class must be named by a word.
    path : str
        Where the object is, for messages.
    keep_defaults : bool
        Whether the object's own fields are written even where they have their default value.

    Returns
    -------
    dict, list, str, number or bool

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
    """Return the shape that a file holds instead of the file, so that the text does not depend on the file."""
    from bemkit.geometry.files.shape_file import ShapeFile  # heavy, and only needed for writing

    return value.shape if isinstance(value, ShapeFile) else value


def _unstructure_dataclass(value: Any, declared: Any, path: str, keep_defaults: bool) -> Any:
    hints = get_type_hints(type(value))
    prefix = f"{path}." if path else ""
    table = {
        entry.name: unstructure(content, hints[entry.name], prefix + entry.name)
        for entry, content in _written_fields(value, keep_defaults)
    }
    registry = LAWS if isinstance(value, FrictionLaw) else registry_of(declared)
    if registry is None:
        return table
    try:
        kind = registry.kind_of(value)
    except InputError as error:
        raise UnstructureError(f"{path}: {error}") from error
    return {"kind": kind, **table} if table else kind


def _written_fields(value: Any, keep_defaults: bool) -> Iterator[tuple[Field[Any], Any]]:
    for entry in fields(value):
        content = getattr(value, entry.name)
        # the number of elements is always written, so that a file tells how fine its mesh is
        is_kept = keep_defaults or entry.name == "elements" or not _is_default(content, entry)
        if entry.init and content is not None and is_kept:
            yield entry, content


def _is_default(content: object, entry: Field[Any]) -> bool:
    if entry.default is MISSING and entry.default_factory is MISSING:
        return False
    default = entry.default if entry.default_factory is MISSING else entry.default_factory()
    return type(content) is type(default) and bool(np.all(content == default))


@cache
def _converter() -> Converter:
    converter = Converter(forbid_extra_keys=True, detailed_validation=True)

    def add(is_meant: Callable[[Any], bool], hook: Callable[[Any, Any], Any]) -> None:
        converter.register_structure_hook_func(is_meant, hook)

    converter.register_structure_hook(float, lambda value, _: _number(value))
    converter.register_structure_hook(int, lambda value, _: _integer(value))
    converter.register_structure_hook(bool, lambda value, _: _exactly(value, bool, "true or false"))
    converter.register_structure_hook(str, lambda value, _: _exactly(value, str, "a text in quotation marks"))
    add(lambda declared: declared == FloatArray, lambda value, _: _array(value))
    add(lambda declared: get_origin(declared) is tuple, lambda value, declared: _tuple(converter, value, declared))
    add(lambda declared: get_origin(declared) is Mapping, lambda value, declared: _mapping(converter, value, declared))
    add(lambda declared: _is_class(declared, Enum), lambda value, declared: _enum(value, declared))
    add(lambda declared: bool(options_of(declared)), lambda value, declared: _one_of(converter, value, declared))
    converter.register_structure_hook_factory(is_dataclass, lambda declared: _table_hook(converter, declared))
    add(lambda declared: declared is Expression, lambda value, _: Expression(value))
    add(lambda declared: registry_of(declared) is not None, lambda value, declared: _tagged(converter, value, declared))
    add(lambda declared: bool(heading_of(declared)), lambda value, declared: _named(converter, value, declared))
    return converter


def registry_of(declared: Any) -> Registry | None:
    """Return the registry whose words name the classes of a declared type, None if there is none."""
    alternatives = options_of(declared) or (declared,)
    return next((registry for registry in REGISTRIES if registry.holds(alternatives)), None)


def heading_of(declared: Any) -> str:
    """Return the word that heads the tables of the entries of a tuple, each by its name; empty if none does."""
    inner = get_args(declared)
    is_listed = get_origin(declared) is tuple and inner[1:] == (Ellipsis,)
    return HEADINGS.get(reference_of(inner[0]), "") if is_listed else ""


def _is_class(declared: Any, parent: type) -> bool:
    return isinstance(declared, type) and issubclass(declared, parent)


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


def _tuple(converter: Converter, value: object, declared: Any) -> tuple[Any, ...]:
    items = _exactly(value, list, "a list in square brackets")
    inner = get_args(declared)
    if len(inner) == 2 and inner[1] is Ellipsis:
        inner = (inner[0],) * len(items)
    if len(items) != len(inner):
        raise InputError(f"{_show(value)} has {len(items)} entries: give {len(inner)}")
    structured = []
    for index, (item, kind) in enumerate(zip(items, inner, strict=True)):
        with _at(f"[{index}]"):
            structured.append(converter.structure(item, kind))
    return tuple(structured)


def _mapping(converter: Converter, value: object, declared: Any) -> dict[str, Any]:
    structured = {}
    for key, item in _exactly(value, dict, "a table").items():
        with _at(key):
            structured[key] = converter.structure(item, get_args(declared)[1])
    return structured


def _enum(value: object, declared: type[Enum]) -> Enum:
    words = [str(member.value) for member in declared]
    for member in declared:
        if member.value == value:
            return member
    raise InputError(f"{_show(value)} is unknown: give one of {', '.join(words)}{closest(str(value), words)}")


def options_of(declared: Any) -> tuple[Any, ...]:
    """Return the alternatives of a union that a table can hold."""
    if get_origin(declared) not in (Union, types.UnionType):
        return ()
    return tuple(option for option in get_args(declared) if option is not type(None) and not _is_callable(option))


def _is_callable(declared: Any) -> bool:
    return get_origin(declared) is Callable


def _is_list(declared: Any) -> bool:
    return get_origin(declared) is tuple or declared == FloatArray  # whose origin depends on the version of numpy


def _one_of(converter: Converter, value: object, declared: Any) -> Any:
    options = options_of(declared)
    for option in options:
        if _fits(value, option):
            return converter.structure(value, option)
    raise InputError(f"{_show(value)} does not fit: give {' or '.join(_name(option) for option in options)}")


def _fits(value: object, option: Any) -> bool:
    """Tell whether a value of this TOML type can become the alternative."""
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
    registry = registry_of(option)
    if registry is not None:
        return f"a {registry.role}"
    return names.get(option, "a list" if _is_list(option) else "a table")


def _table_hook(converter: Converter, declared: Any) -> Callable[[object, Any], Any]:
    structure_fields = make_dict_structure_fn(declared, converter)

    def hook(value: object, _: Any) -> Any:
        return structure_fields(_exactly(value, dict, "a table of keys and values"), declared)

    return hook


def _tagged(converter: Converter, value: object, declared: Any) -> Any:
    registry = cast(Registry, registry_of(declared))  # the hook is chosen by it
    if isinstance(value, str):
        value = {"kind": value}
    table = registry.without_variant(_exactly(value, dict, f"a {registry.role} as a word or as a table with its kind"))
    if "kind" not in table:
        raise InputError(f"kind is missing: add kind = one of {', '.join(registry.built_in)}")
    with _at("kind"):
        named_class = registry.find(_exactly(table["kind"], str, "a text"))
    return converter.structure({key: item for key, item in table.items() if key != "kind"}, named_class)


def _named(converter: Converter, value: object, declared: Any) -> tuple[Any, ...]:
    structured: list[Any] = []
    item_type, heading = get_args(declared)[0], heading_of(declared)
    of_bodies = ", in one of several bodies [bodies.BODY.parts.NAME]" if heading == "parts" else ""
    written = f"[{heading}.NAME]{of_bodies}"
    for name, options in _exactly(value, dict, f"a table of {heading}: write {written}").items():
        with _at(name):
            table = _exactly(options, dict, "a table of keys and values")
            if "name" in table:
                role = re.sub(r"(?<!^)(?=[A-Z])", " ", item_type.__name__).lower()
                raise InputError(f"unknown key 'name': the name of a {role} stands in its heading [{heading}.NAME]")
            structured.append(converter.structure({"name": name, **table}, item_type))
    return tuple(structured)


@contextmanager
def _at(key: str) -> Iterator[None]:
    """Note on errors inside that they are errors at this key, as cattrs does for the fields of classes."""
    try:
        yield
    except Exception as error:
        error.add_note(AttributeValidationNote("", key, None))
        raise


def _show(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:60] + "..."
