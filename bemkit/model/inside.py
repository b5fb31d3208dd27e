"""Body forces and heat of the bodies of a scene."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

from bemkit.model.particular import particular_solution
from bemkit.model.placed import PlacedBody
from bemkit.model.units import Units
from bemkit.operators.steklov_poincare.forces_inside import ForcesInside
from bemkit.scene.body_forces import BodyForce, seen_from


def forces_inside_of(
    bodies: Sequence[PlacedBody], units: Units, kept: Mapping[int, ForcesInside | None]
) -> list[ForcesInside | None]:
    """Return the body forces of each body in the units of a scene; copies with the same rotation share them.

    Those that are kept are given by the numbers of their bodies.
    """
    known: dict[tuple[int, tuple[BodyForce, ...]], ForcesInside | None] = {}
    insides = []
    for number, body in enumerate(bodies):
        if number in kept:
            insides.append(kept[number])
            continue
        forces = tuple(seen_from(force, body.turn) for force in body.body.body_forces)
        key = (id(body.own_mesh), forces)
        if key not in known:
            own_units = body.units(units.modulus, units.stress * units.length)
            known[key] = None
            if forces:
                scene = replace(body.scene, body_forces=forces)
                solution = particular_solution(scene, body.own_mesh, own_units.modulus, own_units.stress)
                known[key] = ForcesInside.of(solution, body.own_space)
        insides.append(known[key])
    return insides
