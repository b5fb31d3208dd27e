"""Checks that the contacts of a scene name what there is."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence

from bemkit.errors import InputError
from bemkit.formulas import choices, closest
from bemkit.scene.body import Body
from bemkit.scene.contacts import ContactPair, body_and_part
from bemkit.scene.plane_motion import RigidBody

SideNames = Callable[[Body], Sequence[tuple[str, str]]]
"""Body -> the name and the group of each of its sides."""


def check_contacts(
    contacts: Sequence[ContactPair], rigid: Sequence[RigidBody], bodies: Mapping[str, Body], side_names: SideNames
) -> None:
    """Raise InputError if a contact names what does not exist or is listed twice, or a rigid body touches nothing.

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
