"""How a rigid body moved, and what held or drove it."""

from __future__ import annotations

from dataclasses import dataclass

from bemkit.results.part_forces import PartForce


@dataclass(frozen=True)
class RigidResult(PartForce):
    """A rigid body of a solved assembly.

    Parameters
    ----------
    name : str
    force_x, force_y : float [N/m]
        What acts on it besides its contacts: its given load, or the reaction that moves it as it is told. Contacts
        exert the opposite.
    moment : float [N m/m]
        The same about its centre, anticlockwise.
    x, y : float [m]
        How its centre moved.
    turn : float [rad]
        Anticlockwise.
    """

    x: float
    y: float
    turn: float
