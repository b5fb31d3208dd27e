"""Units of measurement: their sizes and dimensions, the units of a scene, and numbers with units in scene files."""

from __future__ import annotations

import inspect
import math
import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from types import MappingProxyType

from bemkit.errors import InputError

_LONGEST = 24
QUANTITIES: Mapping[str, str] = MappingProxyType(
    {"m": "length", "Pa": "stress", "N/m": "force", "N m/m": "energy", "J/m": "energy"}
)
"""Quantities of the SI units of table columns, which select the names of units."""
_FACTOR = re.compile(r"([^\W\d_]+|°)(?:\^?(-?\d))?")
_WITH_UNIT = re.compile(r"\s*((?>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))\s*((?:[^\W\d_]|°)[\w°^/* -]*?)\s*")


@dataclass(frozen=True)
class Unit:
    """A unit of measurement.

    Parameters
    ----------
    factor : float
        Its size in SI units.
    powers : (int, int, int, int, int)
        Powers of mass, length, time, temperature and angle in it.
    """

    factor: float
    powers: tuple[int, int, int, int, int]

    def __mul__(self, other: Unit) -> Unit:
        mass, length, time, temperature, angle = (a + b for a, b in zip(self.powers, other.powers, strict=True))
        return Unit(self.factor * other.factor, (mass, length, time, temperature, angle))

    def __pow__(self, power: int) -> Unit:
        mass, length, time, temperature, angle = (power * each for each in self.powers)
        return Unit(self.factor**power, (mass, length, time, temperature, angle))


def _of(powers: tuple[int, int, int, int, int], **factors: float) -> dict[str, Unit]:
    return {name: Unit(factor, powers) for name, factor in factors.items()}


_UNITS: Mapping[str, Unit] = MappingProxyType(
    _of((0, 1, 0, 0, 0), nm=1e-9, um=1e-6, mm=1e-3, cm=1e-2, m=1.0, km=1e3, ft=0.3048)
    | {"in": Unit(0.0254, (0, 1, 0, 0, 0)), "\N{GREEK SMALL LETTER MU}m": Unit(1e-6, (0, 1, 0, 0, 0))}
    | _of((1, 1, -2, 0, 0), mN=1e-3, N=1.0, kN=1e3, MN=1e6, lbf=4.4482216152605, kip=4448.2216152605)
    | _of((1, -1, -2, 0, 0), Pa=1.0, kPa=1e3, MPa=1e6, GPa=1e9, bar=1e5, psi=6894.757293168361, ksi=6894757.293168361)
    | _of((1, 0, 0, 0, 0), g=1e-3, kg=1.0, t=1e3)
    | _of((0, 0, 1, 0, 0), s=1.0, ms=1e-3, min=60.0, h=3600.0)
    | _of((0, 0, 0, 1, 0), K=1.0)
    | _of((0, 0, 0, 0, 1), rad=1.0, deg=math.pi / 180.0, degree=math.pi / 180.0)
    | {"°": Unit(math.pi / 180.0, (0, 0, 0, 0, 1))}
)
PURE_NUMBER = Unit(1.0, (0, 0, 0, 0, 0))


def read_unit(text: str) -> Unit:
    """Return a unit such as ``kN/mm^2``: factors with spaces or asterisks between them, divisors after slashes.

    Raises
    ------
    InputError
        If a factor is unknown.
    """
    unit = PURE_NUMBER
    for number, side in enumerate(unicodedata.normalize("NFKC", text).split("/")):
        for factor in side.replace("*", " ").split():
            if number == 0 and factor == "1":
                continue
            found = _FACTOR.fullmatch(factor)
            if found is None or found[1] not in _UNITS:
                from bemkit.formulas import closest  # loads numpy, which help and errors of options do without

                raise InputError(
                    f"the unit {factor!r} is unknown: give one of {', '.join(_UNITS)}{closest(factor, _UNITS)}"
                )
            power = int(found[2] or 1)
            unit = unit * _UNITS[found[1]] ** (-power if number else power)
    return unit


def name_of_force(length: str, stress: str, suffix: str = "") -> str:
    """Return the name of the unit of forces, stress times area, such as ``N`` of mm and MPa; empty if none is known.

    With a suffix such as ``/mm`` it is that of forces per thickness, ``N/mm``.
    """
    try:
        size = read_unit(stress).factor * read_unit(length).factor ** (1 if suffix else 2)
    except InputError:  # units of one's own
        return ""
    names = [f"{name}{suffix}" for name in ("N", "kN", "MN", "mN", "lbf", "kip")]
    return next((name for name in names if math.isclose(read_unit(name).factor, size, rel_tol=1e-9)), "")


def is_force(name: str) -> bool | None:
    """Whether a unit is one of forces, and not of forces per thickness; None if it is unknown."""
    try:
        powers = read_unit(name).powers
    except InputError:
        return None
    return {(1, 1, -2, 0, 0): True, (1, 0, -2, 0, 0): False}.get(powers)


def length_in_metres(name: str) -> float | None:
    """Return the size of a unit of length by its name; None if that names no known length."""
    unit = _UNITS.get(name)
    return unit.factor if unit is not None and unit.powers == (0, 1, 0, 0, 0) else None


@dataclass(frozen=True)
class UnitNames:
    """Names of units, one consistent set.

    Parameters
    ----------
    length : str
        Such as ``"mm"``.
    stress : str
        Such as ``"MPa"``; of tractions, pressures and moduli.
    force : str, optional
        Of forces per thickness, stress times length, such as ``"N/mm"``; in a scene with a thickness of forces, such as
        ``"N"``. Derived from the other two if not given.

    Raises
    ------
    InputError
        If a name is empty, longer than 24 letters or not printable.
    """

    length: str
    stress: str
    force: str | None = None

    def __post_init__(self) -> None:
        for entry in fields(self):
            name = getattr(self, entry.name)
            if name is None and entry.name == "force":
                object.__setattr__(self, "force", self._per_thickness)
                continue
            if not (isinstance(name, str) and name.strip() and name.isprintable() and len(name) <= _LONGEST):
                raise InputError(f"units.{entry.name} is {name!r}: give a short name such as 'mm' or 'MPa'")

    @property
    def _per_thickness(self) -> str:
        known = name_of_force(self.length, self.stress, f"/{self.length}")
        return known or f"{self.stress} {self.length}"

    def over_thickness(self, thickness: float | None) -> UnitNames:
        """Return the names in a scene of a thickness, in which forces are stresses times areas, or of none.

        Raises
        ------
        InputError
            If the name of the unit of forces is that of the other kind.
        """
        names = self
        if thickness is not None and self.force == self._per_thickness:
            names = replace(self, force=name_of_force(self.length, self.stress) or f"{self.stress} {self.length}^2")
        if is_force(names.force or "") is (thickness is None):
            given, remedy = ("no thickness", "N/mm") if thickness is None else (f"thickness {thickness:g}", "N")
            raise InputError(
                f"units.force is {self.force!r}, and the scene has {given}: give a unit such as {remedy!r}, or omit it"
            )
        return names

    @property
    def energy(self) -> str:
        """Unit of energies and moments, per thickness as forces are."""
        per_length = f"/{self.length}"
        force = self.force or ""
        if force.endswith(per_length):
            return f"{force.removesuffix(per_length)} {self.length}{per_length}"
        return f"{force} {self.length}"

    def as_dict(self) -> dict[str, str]:
        """Return the names of all quantities."""
        return {"length": self.length, "stress": self.stress, "force": self.force or "", "energy": self.energy}


def unit_of(quantity: str, units: UnitNames | None) -> str:
    """Return the name of the unit of a quantity (length, stress, force, energy), empty if units have no names."""
    return units.as_dict()[quantity] if units is not None and quantity else ""


def amount(value: float, quantity: str, units: UnitNames | None, digits: int = 4) -> str:
    """Return a number with its unit, if units have names."""
    return f"{value:.{digits}g} {unit_of(quantity, units)}".rstrip()


def with_unit(label: str, quantity: str, units: UnitNames | None) -> str:
    """Return a label with the unit in brackets, if units have names."""
    unit = unit_of(quantity, units)
    return f"{label} [{unit}]" if unit else label


def check_length_of_file(stated: str, units: UnitNames, owner: str = "shape") -> None:
    """Raise if the file of a shape or profile states another unit of length than a scene; empty is no statement."""
    of_file, of_scene = length_in_metres(stated), length_in_metres(units.length)
    if of_file is None or of_scene is None or stated == units.length:
        return
    factor = of_file / of_scene
    raise InputError(
        f"units.length is {units.length!r}, but the file of the {owner} is in {stated!r}: give it scale = "
        f"{factor:.10g}, or scale = 1 to take its numbers as they are"
    )


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
    found = _WITH_UNIT.fullmatch(text)
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
    scale = _size_in_si(given, units, text)
    if given.powers != expected.powers:
        remedy = "without a unit" if expected == PURE_NUMBER else f"in {documented} or a multiple of it"
        raise InputError(f"{text!r} has a unit of another kind: give it {remedy}")
    return float(found[1]) * given.factor / (expected.factor * scale)


def _size_in_si(unit: Unit, units: UnitNames | None, text: str) -> float:
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
