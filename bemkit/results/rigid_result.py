"""How a rigid body moved, and what held or drove it."""

from __future__ import annotations

from dataclasses import asdict, dataclass


@dataclass(frozen=True)
class RigidResult:
    """A rigid body of a solved assembly.

    Parameters
    ----------
    name : str
    x, y : float [m]
        How its centre moved.
    turn : float [rad]
        Anticlockwise.
    force_x, force_y : float [N/m]
        What acts on it besides its contacts: its given load, or the reaction that moves it as it is told. Contacts
        exert the opposite.
    moment : float [N m/m]
        The same about its centre, anticlockwise.
    """

    name: str
    x: float
    y: float
    turn: float
    force_x: float
    force_y: float
    moment: float

    def as_dict(self) -> dict[str, float | str]:
        """Return the entries by name."""
        return asdict(self)
