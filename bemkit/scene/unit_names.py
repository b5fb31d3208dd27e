"""The names of the units that a scene is stated in; they label results and change no number."""

from __future__ import annotations

from dataclasses import dataclass, fields

from bemkit.errors import InputError
from bemkit.scene.known_units import length_in_metres, name_of_force

_LONGEST = 24


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
        Of forces per thickness, stress times length, such as ``"N/mm"``; derived from the other two if not given.

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
                known = name_of_force(self.length, self.stress)
                object.__setattr__(self, "force", known or f"{self.stress} {self.length}")
                continue
            if not (isinstance(name, str) and name.strip() and name.isprintable() and len(name) <= _LONGEST):
                raise InputError(f"units.{entry.name} is {name!r}: give a short name such as 'mm' or 'MPa'")

    @property
    def energy(self) -> str:
        """Unit of energies and moments per thickness."""
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
