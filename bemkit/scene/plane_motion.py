"""What moves as it is told or as forces drive it: rigid bodies, and half-planes far away."""

from __future__ import annotations

import math
from dataclasses import Field, replace
from typing import Any, ClassVar, Self

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.errors import InputError

COMPONENTS = (("x", "force_x"), ("y", "force_y"), ("turn", "moment"))
"""The three motions in the plane, each with the load that does work on it."""


class PlaneMotion:
    """The part that frozen dataclasses with these fields have in common.

    Of each motion and its load one is given, and the other follows; what is given of neither does not move.
    """

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]
    x: float | None
    y: float | None
    turn: float | None
    force_x: float | None
    force_y: float | None
    moment: float | None

    def check_motion(self, owner: str = "") -> None:
        """Refuse numbers that are not finite, and a motion that is given together with its load.

        Parameters
        ----------
        owner : str
            What moves, for messages, with a colon and a space behind it.
        """
        for motion, load in COMPONENTS:
            for key in (motion, load):
                value = getattr(self, key)
                if value is not None and not math.isfinite(value):
                    raise InputError(f"{owner}{key} is {value}: give a finite number")
            if getattr(self, motion) is not None and getattr(self, load) is not None:
                raise InputError(
                    f"{owner}{motion} is {getattr(self, motion)} and {load} is {getattr(self, load)}: give one of "
                    "them, the other follows"
                )

    @property
    def is_driven(self) -> BoolArray:
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
        """Return the same with its given motions and loads multiplied by a number."""
        return self.multiplied(np.full(3, factor), np.full(3, factor))

    def multiplied(self, motions: FloatArray, loads: FloatArray) -> Self:
        """Return the same with its given motions and loads multiplied by numbers (3,) each."""
        keys = [key for pair in COMPONENTS for key in pair]
        factors = dict(zip(keys, np.column_stack([motions, loads]).ravel().tolist(), strict=True))
        given = {key: getattr(self, key) for key in keys}
        return replace(self, **{key: factors[key] * value for key, value in given.items() if value is not None})
