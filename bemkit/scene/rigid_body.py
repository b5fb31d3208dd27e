"""Rigid bodies among the elastic ones of an assembly: obstacles that move as they are told, or as forces drive them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import Obstacle, check_pair
from bemkit.errors import InputError
from bemkit.scene.plane_motion import PlaneMotion


@dataclass(frozen=True, kw_only=True)
class RigidBody(PlaneMotion):
    """A rigid obstacle that moves.

    Of each motion and its load one is given, and the other follows; what is given of neither does not move.

    Parameters
    ----------
    name : str
        Without a dot: contacts name the body by it, ``("plate.top", "punch")``.
    obstacle : Obstacle
        Its shape, where it stands before it moves.
    centre : (float, float) [m]
        The point whose motion is `x`, `y`, about which it turns, and where its forces act.
    x, y : float, optional [m]
    turn : float, optional [rad]
        Anticlockwise; small, as all motions are: a point at r from the centre moves by ``turn`` times r turned by 90
        degrees.
    force_x, force_y : float, optional [N/m]
    moment : float, optional [N m/m]
        About the centre, anticlockwise.

    Raises
    ------
    InputError
        If the name is empty or has a dot, a number is not finite, or a motion is given together with its load.
    """

    name: str
    obstacle: Obstacle
    centre: tuple[float, float] = (0.0, 0.0)
    x: float | None = None
    y: float | None = None
    turn: float | None = None
    force_x: float | None = None
    force_y: float | None = None
    moment: float | None = None

    def __post_init__(self) -> None:
        if not self.name or not self.name.isprintable() or "." in self.name:
            raise InputError(f"the rigid body name {self.name!r} does not do: give printable text without a dot")
        object.__setattr__(self, "centre", tuple(self.centre))
        check_pair(f"rigid body {self.name!r}: centre", self.centre)
        self.check_motion(f"rigid body {self.name!r}: ")

    def motions_at(self, points: FloatArray) -> FloatArray:
        """Return (n, 2, 3): how the motions x, y, turn displace points (n, 2) [m] of the body."""
        x, y = (points - np.array(self.centre)).T
        one, zero = np.ones_like(x), np.zeros_like(x)
        return np.stack([np.stack([one, zero, -y], axis=1), np.stack([zero, one, x], axis=1)], axis=1)
