"""How a half-plane moves far away, in a scene: as it is told, or as forces drive it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import check_pair
from bemkit.errors import InputError
from bemkit.geometry.outline import Outline
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Roller
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.mesh_options import MeshOptions

_COMPONENTS = (("x", "force_x"), ("y", "force_y"), ("turn", "moment"))


@dataclass(frozen=True, kw_only=True)
class FarField:
    """Motion or load of a half-plane far away from its surface.

    Of each motion and its load one is given, and the other follows; what is given of neither does not move. A rigid
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
        Where the forces act, and about which it turns.

    Raises
    ------
    InputError
        If a number is not finite, or a motion is given together with its load.
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
        check_pair("centre", self.centre)
        for motion, load in _COMPONENTS:
            for key in (motion, load):
                value = getattr(self, key)
                if value is not None and not math.isfinite(value):
                    raise InputError(f"{key} is {value}: give a finite number")
            if getattr(self, motion) is not None and getattr(self, load) is not None:
                raise InputError(
                    f"{motion} is {getattr(self, motion)} and {load} is {getattr(self, load)}: give one of them, the "
                    "other follows"
                )

    @property
    def is_driven(self) -> BoolArray:
        """(3,) bool array: the motions x, y, turn that a load drives, and that are unknown."""
        return np.array([getattr(self, load) is not None for _, load in _COMPONENTS])

    @property
    def motion(self) -> FloatArray:
        """(3,) array [m, m, rad]: the given motions, zero where a load is given."""
        return np.array([getattr(self, motion) or 0.0 for motion, _ in _COMPONENTS])

    @property
    def load(self) -> FloatArray:
        """(3,) array [N/m, N/m, N m/m]: the given loads, zero where a motion is given."""
        return np.array([getattr(self, load) or 0.0 for _, load in _COMPONENTS])

    def scaled(self, factor: float) -> FarField:
        """Return the given motions and loads multiplied by a number."""
        names = [entry.name for entry in fields(self) if entry.name != "centre"]
        given = {name: getattr(self, name) for name in names}
        return replace(self, **{name: factor * value for name, value in given.items() if value is not None})


def check_half_plane(
    outline: Outline, far: FarField | None, discretisation: Discretisation, mesh: MeshOptions, parts: Sequence[Part]
) -> None:
    """Refuse in a scene what a half-plane does not have, and a far field of other bodies.

    Raises
    ------
    InputError
        Naming the key, its value and the remedy.
    """
    if outline.surface is None:
        if far is not None:
            raise InputError(
                f"far is {far}, but the body is no half-plane: hold or load its parts, or give the shape "
                "'half-plane' or 'periodic-half-plane'"
            )
        return
    if not (discretisation.is_symmetric and getattr(discretisation, "degree", 0) == 1) or discretisation.needs_accuracy:
        raise InputError(
            f"discretisation is {discretisation}, but tractions on a half-plane are constant on each element: choose "
            "the discretisation 'linear', or leave it out"
        )
    if outline.surface.is_periodic:
        _check_periodic(far, mesh, parts)


def _check_periodic(far: FarField | None, mesh: MeshOptions, parts: Sequence[Part]) -> None:
    if far is not None and (far.turn or far.moment is not None):
        name = "turn" if far.turn else "moment"
        raise InputError(f"far.{name} is {getattr(far, name)}: a periodic half-plane cannot turn: leave it out")
    for part in parts:
        if isinstance(part.condition, Clamped | PrescribedDisplacement | Roller):
            raise InputError(
                f"part {part.name!r} holds the surface of a periodic half-plane: hold it far away, or let the part "
                "touch an obstacle"
            )
    if mesh.accuracy is not None:
        raise InputError(
            f"mesh.accuracy is {mesh.accuracy}: the elements of a periodic half-plane are equal: give elements"
        )
    if not any(isinstance(part.condition, Contact) for part in parts):
        raise InputError("no part of the periodic half-plane is in contact: give one an obstacle")
