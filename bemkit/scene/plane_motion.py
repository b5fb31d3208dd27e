"""Prescribed and driven rigid motions: of rigid bodies in a scene, and of half-planes far away."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import Obstacle, check_pair
from bemkit.errors import InputError
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.scene.objects import check_objects

COMPONENTS = (("x", "force_x"), ("y", "force_y"), ("turn", "moment"))
"""The three motions in the plane, each with its conjugate load."""


@dataclass(frozen=True, kw_only=True)
class PlaneMotion:
    """Motions of a rigid body, or of a half-plane far away, and the loads that drive them.

    Of each motion and its load one is given, and the other follows. If neither is given, the motion is zero.
    """

    x: float | None = None
    y: float | None = None
    turn: float | None = None
    force_x: float | None = None
    force_y: float | None = None
    moment: float | None = None
    centre: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        object.__setattr__(self, "centre", tuple(self.centre))
        check_pair(f"{self._owner}centre", self.centre)
        for motion, load in COMPONENTS:
            for key in (motion, load):
                value = getattr(self, key)
                if value is not None and not math.isfinite(value):
                    raise InputError(f"{self._owner}{key} is {value}: give a finite number")
            if getattr(self, motion) is not None and getattr(self, load) is not None:
                raise InputError(
                    f"{self._owner}{motion} is {getattr(self, motion)} and {load} is {getattr(self, load)}: give one "
                    "of them, the other follows"
                )

    @property
    def _owner(self) -> str:
        """Name of the body for messages, followed by a colon and a space."""
        return ""

    @property
    def is_load_controlled(self) -> BoolArray:
        """(3,) bool array: the motions x, y, turn that a load drives, and that are unknown."""
        return np.array([getattr(self, load) is not None for _, load in COMPONENTS])

    @property
    def motion(self) -> FloatArray:
        """(3,) array [m, m, rad]: the given motions, zero where a load is given."""
        return np.array([getattr(self, motion) or 0.0 for motion, _ in COMPONENTS])

    @property
    def load(self) -> FloatArray:
        """(3,) array [N/m, N/m, N m/m]: the given loads, zero where a motion is given."""
        return np.array([getattr(self, load) or 0.0 for _, load in COMPONENTS])

    def scaled(self, factor: float) -> Self:
        """Return it with given motions and loads multiplied by a number."""
        return self.multiplied(np.full(3, factor), np.full(3, factor))

    def multiplied(self, motions: FloatArray, loads: FloatArray) -> Self:
        """Return the same with its given motions and loads multiplied by numbers (3,) each."""
        keys = [key for pair in COMPONENTS for key in pair]
        factors = dict(zip(keys, np.column_stack([motions, loads]).ravel().tolist(), strict=True))
        given = {key: getattr(self, key) for key in keys}
        return replace(self, **{key: factors[key] * value for key, value in given.items() if value is not None})


@dataclass(frozen=True, kw_only=True)
class RigidBody(PlaneMotion):
    """A rigid obstacle that moves.

    Of each motion and its load one is given, and the other follows. If neither is given, the motion is zero.

    Parameters
    ----------
    name : str
        Without a dot: contacts name the body by it, ``("plate.top", "punch")``.
    obstacle : Obstacle
        Its shape, in its position before it moves.
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

    def __post_init__(self) -> None:
        if not self.name or not self.name.isprintable() or "." in self.name:
            raise InputError(f"the rigid body name {self.name!r} does not do: give printable text without a dot")
        check_objects(self, f"rigid body {self.name!r}")
        super().__post_init__()

    @property
    def _owner(self) -> str:
        return f"rigid body {self.name!r}: "

    def motions_at(self, points: FloatArray) -> FloatArray:
        """Return (n, 2, 3): how the motions x, y, turn displace points (n, 2) [m] of the body."""
        return rigid_motions(points, np.array(self.centre), 1.0)


@dataclass(frozen=True, kw_only=True)
class FarField(PlaneMotion):
    """Motion or load of a half-plane far away from its surface.

    Of each motion and its load one is given, and the other follows. If neither is given, the motion is zero. A rigid
    indenter that is pressed down with a force is a half-plane that is pressed up against it with the same force.

    Parameters
    ----------
    x, y : float, optional [m]
    turn : float, optional [rad]
        Anticlockwise about the centre; small.
    force_x, force_y : float, optional [N/m]
        On the half-plane; on each period of a periodic one.
    moment : float, optional [N m/m]
        On the half-plane about the centre, anticlockwise.
    centre : (float, float) [m]
        Where the forces act, and about which it turns and is strained.
    strain : float [-]
        Strain of the whole half-plane along its surface, from a bulk stress of E' times the strain, as in a specimen
        under tension or bending below a pad. Zero by default.

    Raises
    ------
    InputError
        If a number is not finite, or a motion is given together with its load.
    """

    strain: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if not math.isfinite(self.strain):
            raise InputError(f"strain is {self.strain}: give a finite number")

    def scaled(self, factor: float) -> Self:
        """Return it with given motions, loads and strain multiplied by a number."""
        return replace(super().scaled(factor), strain=factor * self.strain)
