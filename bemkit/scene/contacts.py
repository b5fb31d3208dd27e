"""Contacts of elastic bodies with each other and with rigid bodies."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.formulas import ScalarField, check_field, choices, closest, evaluate_field
from bemkit.scene.body import Body
from bemkit.scene.objects import check_objects
from bemkit.scene.plane_motion import RigidBody


def body_and_part(side: str) -> tuple[str, str]:
    """Return the names of body and part in the name of a side, ``"body.part"``."""
    body, part = side.split(".", 1)
    return body, part


@dataclass(frozen=True)
class ContactPair:
    """Two sides of bodies that may touch.

    Parameters
    ----------
    sides : (str, str)
        Each ``"body.part"``, ``"body.side"`` by the name of a side or group of its shape, ``"body.side, side"``, or
        ``"body.*"`` for its whole boundary; one of them may be the name of a `RigidBody`. Two sides of one body may
        touch, too, as in a split ring.
    law : FrictionLaw, optional
        By default that of the scene.
    gap : float, Expression or callable (x, y) -> (n,) array [m]
        Added to the distance of the shapes, at points of the side with the multipliers; negative presses bodies
        together that are drawn touching.
    interference : float [m]
        Largest intended overlap of the shapes as they are drawn; more is an error.
    multipliers_on : str, optional
        The side on whose nodes contact is decided; by default see `bemkit.contact.mortar`. Never a rigid body.
    reach : float [m], optional
        Largest distance of points that may come to touch; by default half the size of the smaller body. Round bodies
        with many neighbours need less, so that no point faces two of them.

    Raises
    ------
    InputError
        If neither name has a dot, a side shall touch itself, a length is not finite, the gap is no number, formula or
        function, the reach is not positive, or the multipliers are on neither side.
    """

    sides: tuple[str, str]
    law: FrictionLaw | None = None
    gap: ScalarField = 0.0
    interference: float = 0.0
    multipliers_on: str | None = None
    reach: float | None = None

    def __post_init__(self) -> None:
        check_objects(self, "contact")
        object.__setattr__(self, "sides", tuple(self.sides))
        if len(self.sides) != 2 or not self.elastic_sides:
            raise InputError(
                f"contact sides are {self.sides}: give two, each as 'body.side', or one as the name of a rigid body"
            )
        if self.sides[0] == self.sides[1]:
            raise InputError(f"the contact of {self.sides[0]!r} is with itself: give two sides")
        check_field(self.gap, f"contact {self.name!r}: gap")
        if not 0.0 <= self.interference < np.inf:
            raise InputError(f"contact {self.name!r}: interference is {self.interference}: give a length, not negative")
        _check_reach(self.reach, f"contact {self.name!r}: reach")
        if self.multipliers_on is not None and self.multipliers_on not in self.elastic_sides:
            raise InputError(
                f"contact {self.name!r}: multipliers_on is {self.multipliers_on!r}: give one of the two sides, "
                "and not a rigid body"
            )

    @property
    def name(self) -> str:
        """Name of the contact in results."""
        return " / ".join(self.sides)

    def gap_at(self, points: FloatArray) -> FloatArray:
        """Return the gap (n,) [m] that is added at points (n, 2) [m]."""
        return evaluate_field(self.gap, points)

    @property
    def elastic_sides(self) -> tuple[str, ...]:
        """The sides of elastic bodies: two, or the one that faces a rigid body."""
        return tuple(side for side in self.sides if "." in side)

    @property
    def elastic_parts(self) -> tuple[tuple[str, str], ...]:
        """The elastic sides as pairs (body, part or side)."""
        return tuple(body_and_part(side) for side in self.elastic_sides)

    @property
    def rigid_body(self) -> str | None:
        """The name of the rigid body, None between elastic ones."""
        return next((side for side in self.sides if "." not in side), None)


@dataclass(frozen=True)
class Touching:
    """Puts every two free sides of different bodies that face each other in contact.

    Parameters
    ----------
    within : float [m]
        Largest distance of sides that face each other.
    law : FrictionLaw, optional
        By default that of the scene.
    reach : float [m], optional
        Of each contact found; see `ContactPair`.
    names : tuple of str
        Of contacts that may be found, ``"body.part / body.part"``: the side named first has the multipliers. By default
        see `bemkit.contact.mortar`.

    Raises
    ------
    InputError
        If the distance is negative or not finite, or the reach not positive.
    """

    within: float
    law: FrictionLaw | None = None
    reach: float | None = None
    names: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_objects(self, "touching")
        _check_reach(self.reach, "touching.reach")
        if not 0.0 <= self.within < np.inf:
            raise InputError(f"touching.within is {self.within}: give a length, zero or positive")


def _check_reach(reach: float | None, name: str) -> None:
    if reach is not None and not reach > 0.0:
        raise InputError(f"{name} is {reach}: give a positive length")


SideNames = Callable[[Body], Sequence[tuple[str, str]]]
"""Body -> the name and the group of each of its sides."""


def check_contacts(
    contacts: Sequence[ContactPair], rigid: Sequence[RigidBody], bodies: Mapping[str, Body], side_names: SideNames
) -> None:
    """Raise InputError if a contact names an unknown side or is listed twice, or a rigid body has no contact.

    Parameters
    ----------
    contacts : sequence of ContactPair
    rigid : sequence of RigidBody
    bodies : mapping of str to Body
        The placed bodies by name.
    side_names : callable (body) -> sequence of (str, str)
        The name and the group of each side.
    """
    pairs = Counter(frozenset(pair.sides) for pair in contacts)
    for pair in contacts:
        if pairs[frozenset(pair.sides)] > 1:
            raise InputError(f"contact {pair.name!r} is listed twice: remove one")
        for side in pair.elastic_sides:
            _check_side(side, bodies, side_names)
    _check_rigid(contacts, rigid)


def _check_rigid(contacts: Sequence[ContactPair], rigid: Sequence[RigidBody]) -> None:
    known = [body.name for body in rigid]
    named = [pair.rigid_body for pair in contacts if pair.rigid_body is not None]
    for name in named:
        if name not in known:
            listed = f"the rigid bodies are {', '.join(known)}" if known else "there is no rigid body"
            raise InputError(
                f"a contact names {name!r}: {listed}{closest(name, known)}; write a side of an elastic body as "
                "'body.side'"
            )
    for name in known:
        if name not in named:
            raise InputError(f"rigid body {name!r} touches nothing: list a contact with it, or remove it")


def _check_side(side: str, bodies: Mapping[str, Body], side_names: SideNames) -> None:
    body, part = body_and_part(side)
    if body not in bodies:
        raise InputError(f"a contact names {side!r}: the bodies are {choices(body, list(bodies))}")
    placed = bodies[body]
    if any(part == stated.name for stated in placed.parts) or not any(part in names for names in side_names(placed)):
        _ = placed.contact_part(part)
