"""What a random arrangement consists of, and what holds its lowest body."""

from __future__ import annotations

from dataclasses import dataclass, field

from bemkit.contact.obstacle import HalfPlane
from bemkit.scene.assembly import ContactPair, Touching
from bemkit.scene.body import Body
from bemkit.scene.conditions import Clamped, Contact, Part, PrescribedDisplacement, Roller
from bemkit.studies.stability.random_scenes.draw import Draw


@dataclass(frozen=True)
class Layout:
    """Bodies in their places, and what touches what."""

    bodies: tuple[Body, ...]
    contacts: tuple[ContactPair, ...] = field(default_factory=tuple)
    touching: Touching | None = None


def base(draw: Draw, side: str) -> tuple[Part, ...]:
    """Draw what holds a body from below: now and then nothing."""
    weights = {"clamped": 6.0, "given": 1.0, "rollers": 0.4, "obstacle": 0.7, "none": 0.2}
    match draw.one_by_weight(weights):
        case "clamped":
            return (Part("base", Clamped(), (side,)),)
        case "given":
            return (Part("base", PrescribedDisplacement(0.0, draw.between(-1e-4, 1e-4)), (side,)),)
        case "rollers":
            return (Part("base", Roller(), (side,)),)
        case "obstacle":
            return (Part("base", Contact(HalfPlane((0.0, 0.0))), (side,)),)
    return ()
