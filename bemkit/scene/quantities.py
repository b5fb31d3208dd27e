"""Numbers with units in scene files, such as ``"210 GPa"``, as numbers in the units of the scene."""

from __future__ import annotations

import inspect
import re

from bemkit.errors import InputError
from bemkit.scene.unit_names import PURE_NUMBER, Unit, UnitNames, is_force, read_unit

_TEXT = re.compile(r"\s*((?>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))\s*((?:[^\W\d_]|°)[\w°^/* -]*?)\s*")


def in_units_of_scene(text: str, owner: type, name: str, units: UnitNames | None) -> str | float:
    """Return the number with a unit that a scene file states for a field as a number in the units of the scene.

    Parameters
    ----------
    text : str
        Any other value, such as a formula, is returned unchanged.
    owner : type
        The class of the field. Its docstring states the unit of the field in SI, such as ``[Pa]``.
    name : str
        Of the field.
    units : UnitNames or None
        Of the scene; with a thickness their force is no force per thickness.

    Raises
    ------
    InputError
        If a number has a unit of another kind than the field, or the scene names no units that are known.
    """
    found = _TEXT.fullmatch(text)
    if found is None:
        return text
    from bemkit.scene.docstrings import unit_of_parameter

    documented = unit_of_parameter(inspect.getdoc(owner) or "", name)
    if not documented:
        return text
    if units is not None and is_force(units.force or ""):
        documented = {"N/m": "N", "N m/m": "N m"}.get(documented, documented)
    expected = PURE_NUMBER if documented == "-" else read_unit(documented)
    given = read_unit(found[2])
    scale = _scale(given, units, text)
    if given.powers != expected.powers:
        remedy = "without a unit" if expected == PURE_NUMBER else f"in {documented} or a multiple of it"
        raise InputError(f"{text!r} has a unit of another kind: give it {remedy}")
    return float(found[1]) * given.factor / (expected.factor * scale)


def _scale(unit: Unit, units: UnitNames | None, text: str) -> float:
    """Return the SI size of the unit of a quantity in a scene; the unit of time is the second."""
    mass, length, _, _, _ = unit.powers
    if mass == length == 0:
        return 1.0
    if units is None:
        raise InputError(
            f"{text!r} has a unit, but the scene has none: add units = {{ length = 'mm', stress = 'MPa' }}"
        )
    own = []
    for name, powers in (("length", (0, 1, 0, 0, 0)), ("stress", (1, -1, -2, 0, 0))):
        found = read_unit(getattr(units, name))
        if found.powers != powers:
            raise InputError(f"units.{name} is {getattr(units, name)!r}, which is not a unit of {name}: give one")
        own.append(found.factor)
    of_length, of_stress = own
    return float((of_stress * of_length) ** mass * of_length**length)  # a mass is a stress times a length, at 1 s
