"""The JSON schema of scene files: editors use it to complete keys and mark mistakes.

It is generated from the dataclasses, types and words that the reader uses, including those of installed packages;
descriptions come from the docstrings. Editors know draft 7 of JSON schema.
"""

from __future__ import annotations

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import Field, fields, is_dataclass
from enum import Enum
from functools import partial
from typing import Any, cast, get_args, get_origin

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.formulas import Expression
from bemkit.scene.docstrings import parameters, summary
from bemkit.scene.registry import (
    RISING,
    Registry,
    default_of,
    heading_of,
    is_required,
    options_of,
    registry_of,
    type_of_field,
)
from bemkit.scene.scene import OF_ONE_BODY, OF_SEVERAL, Scene
from bemkit.scene.written_tables import unstructure

_QUANTITY = r"^\s*[+-]?[\d.]+([eE][+-]?\d+)?\s*[^\d\s.,]"
"""A number with a unit."""
DRAFT = "http://json-schema.org/draft-07/schema#"
Schema = dict[str, Any]

_PLAIN: tuple[tuple[Any, Schema], ...] = (
    (bool, {"type": "boolean"}),
    (int, {"type": "integer"}),
    (float, {"type": "number"}),
    (str, {"type": "string"}),
    (Expression, {"type": "string"}),
    (FloatArray, {"type": "array", "items": {"type": ["number", "array"]}}),
)


def scene_schema() -> Schema:
    """Return the JSON schema (draft 7) of scene files of one body and of several.

    It covers keys, types and words. `bemkit.load_scene` finds other mistakes, such as a Poisson ratio of 0.7 or an
    unknown side.

    Returns
    -------
    dict
        To be written as JSON.
    """
    definitions = _Definitions()
    table = definitions.table(Scene)
    table["properties"]["discretisation"] = _or_word(table["properties"]["discretisation"], RISING)
    names = list(table["properties"])
    return {
        "$schema": DRAFT,
        "title": "bemkit scene",
        "description": "A contact problem of one elastic body, or of several if there are tables [bodies.NAME].",
        "type": "object",
        "properties": table["properties"],
        "if": {"required": ["bodies"]},
        "then": _keys(["title", "bodies"], [name for name in names if name not in OF_ONE_BODY]),
        "else": _keys(["title", "shape", "material"], [name for name in names if name not in OF_SEVERAL]),
        "definitions": dict(sorted(definitions.made.items())),
    }


def _keys(required: list[str], allowed: list[str]) -> Schema:
    """Return which keys a table must and may have."""
    return {"required": required, "propertyNames": {"enum": allowed}}


class _Definitions:
    """Schemas of all classes met so far, each made once."""

    def __init__(self) -> None:
        self.made: dict[str, Schema] = {}

    def of_type(self, declared: Any) -> Schema:
        """Return the schema of the values of a declared type."""
        if heading_of(declared):
            entry = get_args(declared)[0]
            without_name = self._referred(entry.__name__, partial(self.table, entry, leave_out="name"))
            return {"type": "object", "additionalProperties": without_name}
        registry = registry_of(declared)
        if registry is not None:
            return self._referred(_slug(registry.role), partial(self._kinds, registry))
        if options := options_of(declared):
            return _any_of([self.of_type(option) for option in options])
        return self._of_one(declared)

    def _of_one(self, declared: Any) -> Schema:
        for plain, schema in _PLAIN:
            if declared == plain:
                return dict(schema)
        if declared is Any:
            return {}
        origin, inner = get_origin(declared), get_args(declared)
        if origin is tuple and inner[1:] == (Ellipsis,):
            return {"type": "array", "items": self.of_type(inner[0])}
        if origin is tuple:
            items = [self.of_type(entry) for entry in inner]
            return {"type": "array", "items": items, "minItems": len(items), "maxItems": len(items)}
        if origin is Mapping:
            return {"type": "object", "additionalProperties": self.of_type(inner[1])}
        if isinstance(declared, type) and issubclass(declared, Enum):
            return {"enum": [member.value for member in declared]}
        if is_dataclass(declared):
            table = cast(type, declared)
            return self._referred(table.__name__, partial(self.table, table))
        raise TypeError(f"{declared} has no place in scene files: teach it to bemkit.scene.serialisation and here")

    def _referred(self, name: str, make: Callable[[], Schema]) -> Schema:
        if name not in self.made:
            self.made[name] = {}  # is being made: classes may contain themselves
            self.made[name] = make()
        return {"$ref": f"#/definitions/{name}"}

    def table(self, owner: type, *, leave_out: str = "") -> Schema:
        """Return the schema of a table with the fields of a dataclass."""
        entries = [entry for entry in fields(owner) if entry.init and entry.name != leave_out]
        texts = parameters(inspect.getdoc(owner) or "")
        types = {entry.name: type_of_field(owner, entry.name) for entry in entries}
        described = {
            entry.name: _described(self.of_type(types[entry.name]), entry, types[entry.name], texts.get(entry.name, ""))
            for entry in entries
        }
        return {
            "description": summary(inspect.getdoc(owner) or ""),
            "type": "object",
            "properties": described,
            "required": [entry.name for entry in entries if is_required(entry)],
            "additionalProperties": False,
        }

    def _kinds(self, registry: Registry) -> Schema:
        """Return the schema of a single word, or a table with a kind: errors in it are reported for its kind only."""
        tables = {word: self._kind(registry, word) for word in registry.names() if _can_be_loaded(registry, word)}
        without_keys = [word for word, table in tables.items() if not table["required"]]
        role, listed = f"{registry.role[0].upper()}{registry.role[1:]}", {}
        if registry.listed:
            listed = {"items": {"$ref": f"#/definitions/{_slug(registry.role)}"}, "minItems": 1}
        return {
            "description": f"{role}: a word, or a table with its kind{', or a list of them' if listed else ''}.",
            "type": ["string", "object", *(["array"] if listed else [])],
            **listed,
            "required": ["kind"],
            "properties": {"kind": {"enum": list(tables)}} | _hints(tables),
            "allOf": [
                {"if": {"type": "string"}, "then": {"enum": without_keys}},
                *({"if": _is_of_kind(word), "then": table} for word, table in tables.items()),
            ],
        }

    def _kind(self, registry: Registry, word: str) -> Schema:
        if word in registry.presets:
            kind, options = registry.presets[word]
            return {
                "description": f"{kind} with {options}",
                "type": "object",
                "required": [],
                "properties": {"kind": {"const": word}},
            }
        table = self.table(registry.find(word))
        return table | {"properties": {"kind": {"const": word}} | table["properties"]}


def _or_word(described: Schema, word: str) -> Schema:
    """Return the schema of a key that may also be a word of no class."""
    (own,) = described.pop("allOf")
    return {"if": {"const": word}, "else": own} | described


def _can_be_loaded(registry: Registry, word: str) -> bool:
    """Return whether scene files may use a word: a broken package cannot add any."""
    try:
        registry.find(word)
    except InputError:
        return False
    return True


def _is_of_kind(word: str) -> Schema:
    return {"type": "object", "required": ["kind"], "properties": {"kind": {"const": word}}}


def _hints(tables: Mapping[str, Schema]) -> Schema:
    """Return all keys of all kinds with their descriptions, for the proposals of editors."""
    texts: dict[str, list[str]] = {}
    for word, table in tables.items():
        for key, schema in table["properties"].items():
            if key != "kind":
                texts.setdefault(key, []).append(f"{word}: {schema.get('description', key)}")
    return {key: {"description": "\n\n".join(lines)} for key, lines in texts.items()}


def _slug(text: str) -> str:
    return text.replace(" ", "-")


def _any_of(schemas: list[Schema]) -> Schema:
    """Return the schema of a value that fits one of several; plain types become a list of types."""
    if len(schemas) == 1:
        return schemas[0]
    if all(list(schema) == ["type"] for schema in schemas):
        return {"type": [schema["type"] for schema in schemas]}
    return {"anyOf": schemas}


def _with_unit(schema: Schema) -> Schema:
    """Return the schema of a value whose numbers may have a unit, such as "210 GPa"."""
    kinds = schema.get("type")
    if kinds == "array" and isinstance(items := schema.get("items"), list):
        return schema | {"items": [_with_unit(item) for item in items]}
    if kinds == "number" or (isinstance(kinds, list) and "number" in kinds and "string" not in kinds):
        return schema | {"type": [*([kinds] if isinstance(kinds, str) else kinds), "string"], "pattern": _QUANTITY}
    return schema


def _described(schema: Schema, entry: Field[Any], declared: Any, text: str) -> Schema:
    """Return a schema with the description and the default of a key."""
    described: Schema = {"description": text} if text else {}
    if text.startswith("["):
        schema = _with_unit(schema)
    if not is_required(entry) and "additionalProperties" not in schema:
        default = default_of(entry)
        if default is not None and default != math.inf:  # JSON has no infinity
            described["default"] = unstructure(default, declared)
    # beside a reference nothing else counts in draft 7
    return ({"allOf": [schema]} if "$ref" in schema and described else schema) | described
