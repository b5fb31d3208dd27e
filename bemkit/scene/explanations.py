"""Why a table of a scene file is not what was wanted: one line with key, value and remedy."""

from __future__ import annotations

import types
from collections.abc import Mapping
from dataclasses import fields
from functools import reduce

from cattrs import AttributeValidationNote, BaseValidationError, ForbiddenExtraKeysError

from bemkit.formulas import closest, shorten

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


def explain(error: BaseException, path: str = "") -> str:
    """Turn the first of the errors found into ``key: value: remedy``."""
    # the innermost key was noted first
    keys = [note.name for note in getattr(error, "__notes__", ()) if isinstance(note, AttributeValidationNote)]
    path = reduce(_join, reversed(keys), path)
    if keys and isinstance(error, KeyError):
        return f"{path}: missing: {_MISSING_REMEDIES.get(keys[0], f'add {keys[0]} = ...')}"
    if isinstance(error, BaseValidationError):
        # an unknown key comes first: it is often the reason why another one is missing
        found = sorted(error.exceptions, key=lambda inner: not isinstance(inner, ForbiddenExtraKeysError))
        return explain(found[0], path)
    if isinstance(error, ForbiddenExtraKeysError):
        key = min(error.extra_fields)
        names = [entry.name for entry in fields(error.cl) if entry.init]
        known = f"the keys are {', '.join(names)}" if names else "there are no keys here"
        return f"{_join(path, shorten(key)[1:-1])}: unknown key: {known}{closest(key, names)}"
    return f"{path}: {error}" if path else str(error)


def _join(path: str, key: str) -> str:
    return f"{path}.{key}" if path and not key.startswith("[") else f"{path}{key}"
