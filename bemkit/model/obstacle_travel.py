"""How obstacles that load steps move travel along the bodies that they touch: friction follows them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.obstacle import Obstacle, RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.signed_distance import SignedDistance
from bemkit.contact.spline import RigidSpline
from bemkit.errors import InputError
from bemkit.model.prepared import Prepared

_ROUND_OFF = 1e-12
"""Largest difference of a shifted obstacle from another one, relative to the coordinates."""


def obstacle_travel(before: Prepared, after: Prepared) -> FloatArray:
    """Return how far (n_contact,) [m] fixed obstacles travel along the tangents of contact nodes between two steps.

    Raises
    ------
    InputError
        If an obstacle with friction turns or changes its shape: how it travels is not known then.
    """
    travels = [np.zeros(0)]
    for rows in after.rows:
        travel = np.zeros(rows.n_contact)
        if rows.other < 0 and not rows.law.is_frictionless:
            one, two = (step.bodies[rows.body].scene.obstacles[rows.part] for step in (before, after))
            shift = shift_between(one, two)
            if shift is None:
                raise InputError(
                    f"contact {rows.name!r}: its obstacle turns or changes its shape between two steps, and friction "
                    "has to follow it: only shift it, or use a rigid body"
                )
            travel = rows.frame[:, 1] @ shift
        travels.append(travel)
    return np.concatenate(travels)


def shift_between(before: Obstacle, after: Obstacle) -> FloatArray | None:
    """Return the shift (2,) [m] that moves an obstacle to another place; None if no shift does.

    An obstacle without a position, such as a `Gap`, only approaches.
    """
    if before == after:
        return np.zeros(2)
    match before, after:
        case RigidHalfPlane(), RigidHalfPlane():
            is_shift = replace(before, point=after.point) == after
            return np.subtract(after.point, before.point) if is_shift else None
        case RigidCircle(), RigidCircle():
            return np.subtract(after.centre, before.centre)
        case RigidCavity(), RigidCavity():
            return np.subtract(after.centre, before.centre)
        case RigidPolygon(), RigidPolygon():
            return _common_shift(np.array(before.vertices), np.array(after.vertices))
        case RigidSpline(), RigidSpline():
            return _common_shift(np.array(before.points), np.array(after.points))
        case (SignedDistance(), _) | (_, SignedDistance()):
            return None
    return np.zeros(2) if type(before) is type(after) else None


def _common_shift(before: FloatArray, after: FloatArray) -> FloatArray | None:
    if before.shape != after.shape:
        return None
    shifts = after - before
    size = float(np.abs([before, after]).max())
    return np.asarray(shifts[0]) if np.ptp(shifts, axis=0).max() <= _ROUND_OFF * size else None
