"""The same bodies under several scenes: their conditions, contacts and units in common."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import zip_longest
from typing import TYPE_CHECKING

import numpy as np

from bemkit.errors import InputError
from bemkit.model.given import check_same_body
from bemkit.model.placed import PlacedBody, check_body_symmetry
from bemkit.model.units import Units, largest_sizes
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from bemkit.scene.contacts import ContactPair
    from bemkit.scene.plane_motion import RigidBody


def found_contacts(scene: Scene, bodies: Sequence[PlacedBody]) -> tuple[tuple[ContactPair, bool], ...]:
    """Return the contacts found between touching bodies, and whether meshes resolve them; none unless asked for."""
    if scene.touching is None:
        return ()
    from bemkit.model.body_contacts import touching_pairs  # mortars, which single bodies lack

    return touching_pairs(scene, bodies)


def with_found_contacts(scene: Scene, found: Sequence[ContactPair]) -> Scene:
    """Return a scene that lists the contacts that were found between touching bodies, under its own law for them."""
    if scene.touching is None:
        return scene
    pairs = (replace(pair, law=scene.touching.law, reach=scene.touching.reach) for pair in found)
    return scene.with_contacts((*scene.contacts, *pairs))


def find_units(scenes: Sequence[Scene], bodies: Sequence[PlacedBody]) -> Units:
    """Choose units by the largest load of some scenes, the size of the largest body and the most compliant contact.

    Raises
    ------
    OutOfRangeError
        If results in these units could overflow or vanish.
    """
    return max((_units_of(scene, bodies_under(scene, bodies)) for scene in scenes), key=lambda units: units.stress)


def _units_of(scene: Scene, bodies: Sequence[PlacedBody]) -> Units:
    numbers = {body.name: body for body in bodies}
    length = max(body.mesh.diameter for body in bodies)
    moduli = [
        1.0 / sum(1.0 / numbers[body].material.plane_modulus for body, _ in pair.elastic_parts)
        for pair in scene.contacts
    ]
    modulus = min(moduli, default=max(body.material.plane_modulus for body in bodies))
    sizes = [largest_sizes(body.scene, body.mesh, length) for body in bodies]
    motions = [motion for _, motion, _ in sizes]
    for pair in scene.contacts:
        body, part = pair.elastic_parts[0]
        mesh = numbers[body].mesh
        motions.append(max(-float(pair.gap_at(mesh.centres[mesh.part(part)]).min(initial=0.0)), pair.interference))
    motions += [float(np.abs(body.motion / [1.0, 1.0, 1.0 / length]).max()) for body in scene.rigid]
    loads = [load for load, _, _ in sizes]
    loads += [float(np.abs(scene.load_on(body) / [length, length, length**2]).max()) for body in scene.rigid]
    stress = max(*loads, max(motions) / length * modulus)
    stress = stress or max(gap for _, _, gap in sizes) / length * modulus or modulus
    units = Units(np.mean([body.mesh.centre for body in bodies], axis=0), length, modulus, stress)
    units.check_range()
    return units


def bodies_under(scene: Scene, bodies: Sequence[PlacedBody]) -> tuple[PlacedBody, ...]:
    """Return placed bodies under the conditions of another scene; InputError if it has other bodies."""
    names, others = ([body.name for body in some] for some in (bodies, scene.placed_bodies))
    if names != others:
        raise InputError(
            f"the bodies are {_first_of(others)}, and those of the step before {_first_of(names)}: change numbers of "
            "conditions and contacts only"
        )
    under, checked = [], set()
    for placed, body in zip(bodies, scene.placed_bodies, strict=True):
        own_scene = scene.scene_of(body)
        if own_scene is not placed.scene and (pair := (id(placed.scene), id(own_scene))) not in checked:
            check_same_body(placed.scene, own_scene, placed.body.parts, body.parts, body.name)
            check_body_symmetry(own_scene, placed.mesh)
            checked.add(pair)
        spaces = placed.mesh, placed.own_mesh, placed.space, placed.own_space, placed.space_in_place
        under.append(PlacedBody(body, own_scene, *spaces))
    return tuple(under)


def check_step(first: Scene, other: Scene) -> None:
    """Check that a load step has the thickness and the rigid bodies of the first one."""
    if first.thickness != other.thickness:
        raise InputError(f"thickness is {other.thickness} in a load step and {first.thickness} in the first: keep it")
    for body, changed in zip_longest(first.rigid, other.rigid):
        if body is None or changed is None or _layout(body) != _layout(changed):
            raise InputError(
                f"rigid body {(body or changed).name!r} changes its shape, its position or its given motions and "
                "loads: change numbers only, or run the scene on its own"
            )


def _layout(body: RigidBody) -> tuple[object, ...]:
    return body.name, body.obstacle, body.centre, body.is_load_controlled.tolist()


def _first_of(names: Sequence[str]) -> str:
    return ", ".join(repr(name) for name in names[:6]) + (", ..." if len(names) > 6 else "")
