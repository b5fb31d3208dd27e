"""Round bodies that no support or friction keeps from turning.

A body whose contact sides are arcs about one point can turn about it; without friction no contact resists. The same
holds for several bodies joined by friction, if their sides in contact with others are such arcs. Their elements do
resist, because they only interpolate the rotation: the difference of the mesh from a circle would balance any load that
turns such a body.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import format_point
from bemkit.geometry.neighbours import common_centre
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.geometry.vectors import cross, norms
from bemkit.model.placed import PlacedBody
from bemkit.model.prepared import Prepared
from bemkit.scene.conditions import Clamped, Load, PrescribedDisplacement, Roller
from bemkit.scene.unit_names import amount
from bemkit.solvers.base import ContactSolution, Status

_N_POINTS = 12
_BALANCED = 1e-6
"""Moment that counts as none, relative to the sum of the sizes of the moments of all loads."""
_UNSETTLED = (Status.STALLED, Status.CYCLING, Status.MAX_STEPS, Status.INNER_FAILED, Status.SINGULAR)
"""Failures of a solve whose cause may be a motion that nothing holds."""


_Side: TypeAlias = tuple[PlacedBody, IntArray]
"""A body, and elements of its boundary."""


def with_turning_checked(prepared: Prepared, result: ContactSolution) -> ContactSolution:
    """Return the outcome of a solve, named UNSOLVABLE_LOAD if only its mesh keeps a body from turning.

    A failed solve is named so too if the load turns a body, else SINGULAR if a body may turn under any load. Bodies
    that friction joins are judged together; the loads of those with forces inside are not.
    """
    if not (result.is_converged or result.status in _UNSETTLED):
        return result
    status, reason = Status.UNSOLVABLE_LOAD, turned_by_load(prepared)
    if not (reason or result.is_converged):
        reasons = (_loose(*group) for group in _joined_by_friction(prepared))
        status, reason = Status.SINGULAR, next(filter(None, reasons), "")
    return result.named(status, reason) if reason else result


def turned_by_load(prepared: Prepared) -> str:
    """Describe how the load turns bodies that neither supports nor friction keep from turning; empty if it does not."""
    reasons = (_turned(prepared, *group) for group in _joined_by_friction(prepared))
    return next(filter(None, reasons), "")


def _joined_by_friction(prepared: Prepared) -> list[tuple[list[PlacedBody], list[_Side]]]:
    """Return bodies that friction joins, and the sides by which they touch others without; none that friction holds."""
    bodies, rows = prepared.bodies, prepared.rows
    group, is_held = np.arange(len(bodies)), np.zeros(len(bodies), bool)
    for contact in rows:
        if contact.law.is_frictionless:
            continue
        if 0 <= contact.other < len(bodies):
            group[group == group[contact.other]] = group[contact.body]
        else:
            is_held[contact.body] = True
    sides: dict[int, list[_Side]] = {}
    for contact in rows:
        ends = [(contact.body, contact.elements), (contact.other, contact.other_elements)]
        ends = [(k, elements) for k, elements in ends if 0 <= k < len(bodies)]
        if len(ends) == 1 or group[contact.body] != group[contact.other]:
            for k, elements in ends:
                sides.setdefault(int(group[k]), []).append((bodies[k], elements))
    members = {k: np.flatnonzero(group == k) for k in sides}
    return [([bodies[m] for m in members[k]], sides[k]) for k in sides if not is_held[members[k]].any()]


def _turned(prepared: Prepared, bodies: list[PlacedBody], sides: list[_Side]) -> str:
    """Describe how the load turns bodies that may turn by these sides; empty if it does not."""
    centre = _centre_of_turning(bodies, sides)
    if centre is None or any(body.scene.body_forces for body in bodies):
        return ""
    moment, size = (sum(values) for values in zip(*(_moment(body, centre) for body in bodies), strict=True))
    if abs(moment) <= _BALANCED * size:
        return ""
    by = amount(prepared.scene.depth * abs(moment), "energy", prepared.scene.result_units)
    sense = "anticlockwise" if moment > 0.0 else "clockwise"
    return (
        f"the load turns {_titles(bodies)} {sense} about {_place(bodies, centre)} with {by}, and contacts that are "
        "round and without friction do not resist: give them friction, hold what turns by a support, or change the load"
    )


def _loose(bodies: list[PlacedBody], sides: list[_Side]) -> str:
    """State that bodies may turn by these sides; empty if they may not."""
    centre = _centre_of_turning(bodies, sides)
    if centre is None:
        return ""
    return (
        f"nothing but the mesh keeps {_titles(bodies)} from turning about {_place(bodies, centre)}, since the contacts "
        "are round and without friction: give them friction, or hold what turns by a support or by symmetry"
    )


def _titles(bodies: list[PlacedBody]) -> str:
    if len(bodies) == 1:
        return bodies[0].title
    return "bodies " + " and ".join(repr(body.name) for body in bodies)


def _place(bodies: list[PlacedBody], centre: FloatArray) -> str:
    return format_point(centre, max(body.mesh.diameter for body in bodies), digits=4)


def _centre_of_turning(bodies: list[PlacedBody], sides: list[_Side]) -> FloatArray | None:
    """Return the point (2,) [m] about which bodies may turn by these sides; None if they may not."""
    if not all(_may_turn(body) for body in bodies):
        return None
    return common_centre([(body.mesh, elements) for body, elements in sides])


def _may_turn(body: PlacedBody) -> bool:
    """Whether a body can turn: no support, no symmetry, no half-plane."""
    is_held = any(isinstance(part.condition, Clamped | Roller | PrescribedDisplacement) for part in body.scene.parts)
    mesh = body.mesh
    is_bounded = not mesh.is_exterior and mesh.surface is None
    return is_bounded and mesh.symmetry is None and not is_held


def _moment(body: PlacedBody, centre: FloatArray) -> tuple[float, float]:
    """Return the moment [N] of the loads per thickness about a point, and that of their sizes."""
    mesh, (xi, weights) = body.mesh, gauss_legendre(_N_POINTS)
    moment = size = 0.0
    for part, elements in body.scene.parts_on(mesh):
        if isinstance(part.condition, Load):
            points, normals = mesh.points(elements, xi), mesh.normals_at(elements, xi)
            load = part.condition.at(points.reshape(-1, 2), normals.reshape(-1, 2)).reshape(points.shape)
            shares = mesh.jacobian(elements, xi) * weights
            moment += float(np.sum(cross(points - centre, load) * shares))
            size += float(np.sum(norms(points - centre) * norms(load) * shares))
    return moment, size
