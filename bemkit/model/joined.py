"""Bodies that are condensed and joined at their contacts, and the same bodies in another load step."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.joined.joined_bodies import JoinedBodies
from bemkit.contact.joined.member import Member
from bemkit.model.coupling import gap_operator, prescribed
from bemkit.model.placed import groups, shape_numbers
from bemkit.model.prepared import Prepared, PreparedBody
from bemkit.model.units import motion_units
from bemkit.operators.counts import OperationCounts
from bemkit.operators.steklov_poincare import CondensedMap, SteklovPoincare
from bemkit.operators.steklov_poincare.forces_inside import condensed_under


def joined_bodies(prepared: Prepared, condensed: Sequence[CondensedMap]) -> JoinedBodies:
    """Return bodies that are condensed, one of each shape with its stiffness, joined at their contacts."""
    numbers, firsts = shape_numbers(prepared.bodies), [int(group[0]) for group in groups(prepared.bodies)]
    motions = [_motions(prepared.bodies[first], condensed[first].n_pressures) for first in firsts]
    n_pressures = [map_.n_pressures for map_ in condensed]
    members = tuple(
        Member(
            stiffness=condensed[firsts[number]].stiffness,
            load=map_.load,
            motions=motions[number],
            modulus=body.material.plane_modulus / prepared.units.modulus,
            name=body.name,
            n_pressures=map_.n_pressures,
            bulk_modulus=body.material.bulk_modulus / prepared.units.modulus,
        )
        for map_, body, number in zip(condensed, prepared.bodies, numbers, strict=True)
    )
    return JoinedBodies(
        members=(*members, *rigid_members(prepared)),
        gap_operator=gap_operator(prepared, n_pressures),
        prescribed=prescribed(prepared),
        weights=prepared.column("weights") / prepared.units.length,
        tangent_follows=prepared.tangent_follows,
        is_dense=any(n_pressures) or None,
    )


def joined_under(
    prepared: Prepared, before: Prepared, joined: JoinedBodies, condensed: Sequence[CondensedMap]
) -> JoinedBodies:
    """Return the joined bodies of a step, whose condensed maps are given; those of the step before keep factors."""
    if not (before.has_same_unknowns(prepared) and before.is_coupled_like(prepared)):
        return joined_bodies(prepared, condensed)
    loads = [*(map_.load for map_ in condensed), *(member.load for member in rigid_members(prepared))]
    return joined.under(loads, prescribed(prepared))


def condensed_under_step(
    prepared: Prepared, before: Prepared, elastic: Sequence[SteklovPoincare], condensed: Sequence[CondensedMap]
) -> tuple[tuple[CondensedMap, ...], OperationCounts]:
    """Return the condensed maps of all bodies in another step, and the work of that."""
    if not before.has_same_unknowns(prepared):
        result = _condensed_again(prepared, elastic)
    else:
        result = tuple(
            old if _is_loaded_alike(*bodies) else _condensed_under(old, map_, *bodies)
            for old, map_, *bodies in zip(condensed, elastic, before.bodies, prepared.bodies, strict=True)
        )
    work = (result[int(group[0])].work for group in groups(prepared.bodies))
    return result, sum(work, OperationCounts())


def _condensed_again(prepared: Prepared, elastic: Sequence[SteklovPoincare]) -> tuple[CondensedMap, ...]:
    """Condense the bodies onto other nodes in contact; copies once."""
    pairs = [(elastic[group[0]], prepared.bodies[group[0]]) for group in groups(prepared.bodies)]
    return for_copies([map_.condense(body.conditions, body.force) for map_, body in pairs], prepared.bodies)


def for_copies(of_shapes: Sequence[CondensedMap], bodies: Sequence[PreparedBody]) -> tuple[CondensedMap, ...]:
    """Return the condensed maps of all bodies from those of the first of each shape, whose stiffness copies share."""
    firsts = [group[0] for group in groups(bodies)]
    return tuple(
        of_shapes[number] if k == firsts[number] else loaded_alone(of_shapes[number], body)
        for k, (number, body) in enumerate(zip(shape_numbers(bodies), bodies, strict=True))
    )


def _condensed_under(
    condensed: CondensedMap, elastic: SteklovPoincare, before: PreparedBody, body: PreparedBody
) -> CondensedMap:
    """Return a condensed map under the loads and the motion far away of a body in another step."""
    if before.far_motion == body.far_motion:
        return loaded_alone(condensed, body)
    again = elastic.condense(body.conditions, body.force)  # its stiffness is the same
    return replace(again, stiffness=condensed.stiffness)


def loaded_alone(condensed: CondensedMap, body: PreparedBody) -> CondensedMap:
    """Return a condensed map under the loads of a body."""
    return condensed_under(condensed, body.conditions, body.force, body.inside)


def _is_loaded_alike(one: PreparedBody, two: PreparedBody) -> bool:
    """Whether loads, body forces, prescribed displacements and motions far away are the same objects in two steps."""
    data, other = ((body.force, body.inside, body.conditions.displacement) for body in (one, two))
    return one.far_motion == two.far_motion and all(a is b for a, b in zip(data, other, strict=True))


def _motions(body: PreparedBody, n_pressures: int) -> FloatArray:
    """Return the rigid motions (n_motions, n_retained) that no support resists; they cause no pressure."""
    conditions = body.conditions
    along = np.einsum("nkc,mnc->mnk", conditions.frame, body.free_modes)
    return np.pad(along[:, conditions.is_retained], ((0, 0), (0, n_pressures)))


def rigid_members(prepared: Prepared) -> tuple[Member, ...]:
    """Return a member for each rigid body that loads drive.

    A rigid body takes the largest modulus of all bodies, so that its partners decide.
    """
    units = prepared.units
    modulus = max(body.material.plane_modulus for body in prepared.bodies) / units.modulus
    members = []
    for body in prepared.scene.rigid:
        is_load_controlled = body.is_load_controlled
        n_driven = int(np.count_nonzero(is_load_controlled))
        if n_driven:
            load = (prepared.scene.load_on(body) / motion_units(units) / prepared.force_unit)[is_load_controlled]
            members.append(Member(np.zeros((n_driven, n_driven)), load, np.eye(n_driven), modulus, body.name))
    return tuple(members)
