"""How a half-plane moves far away, in a scene: as it is told, or as forces drive it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from bemkit.contact.obstacle import check_pair
from bemkit.errors import InputError
from bemkit.geometry.outline import Outline
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Roller
from bemkit.scene.discretisation import Discretisation
from bemkit.scene.mesh_options import MeshOptions
from bemkit.scene.plane_motion import PlaneMotion


@dataclass(frozen=True, kw_only=True)
class FarField(PlaneMotion):
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
        self.check_motion()


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
