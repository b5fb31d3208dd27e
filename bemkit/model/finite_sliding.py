"""Contacts that move so far along their surfaces that gaps and directions of the undeformed bodies no longer hold.

Contact is linearised about the undeformed bodies: each node keeps its partner, its gap and its direction. A motion
along a plane changes none of these. Any other motion that is long beside the deformation puts the contact forces in
the wrong place: bodies may then come to rest where there is no equilibrium.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.obstacle import SIMPLE_OBSTACLES, Obstacle, measure_contact
from bemkit.geometry.placement import Placement
from bemkit.geometry.spaces import element_nodes
from bemkit.geometry.vectors import norms, turned_left
from bemkit.model.contacts import ContactInterface
from bemkit.model.placed import PlacedBody
from bemkit.model.prepared import Prepared
from bemkit.scene.conditions import Contact
from bemkit.scene.unit_names import amount

_OFF = 0.2
"""Change of gaps that makes pressures wrong, relative to the displacement by contact forces."""
_LEAST_COSINE = 0.866
"""Cosine of the angle by which a direction of contact may turn: 30 degrees."""
_LEAST_FACING = 0.5
"""Cosine of 60 degrees between the normal of a body and the direction of contact, below which contact is oblique."""
_SHARE_OF_ZONE = 0.05
"""Largest motion that is longer than an element, relative to the length of contact."""


def why_off(
    prepared: Prepared, rows: ContactInterface, displacement: FloatArray, is_pressed: BoolArray, deformation: float
) -> str:
    """Describe how far the pressed nodes of a contact move; empty if gaps and directions still hold.

    Parameters
    ----------
    prepared : Prepared
    rows : ContactInterface
    displacement : (n, 2) array [m]
        Relative, normal and tangential.
    is_pressed : (n,) bool array
    deformation : float [m]
        The displacement that contact forces cause.
    """
    number = rows.other - len(prepared.bodies)
    if number < 0 <= rows.other:
        is_off = _is_off_side(rows, displacement[:, 1], is_pressed, deformation)
    else:
        obstacle = _fixed_obstacle(prepared, rows) if number < 0 else prepared.scene.rigid[number].obstacle
        is_off = _is_off_obstacle(rows, obstacle, displacement, is_pressed, deformation)
        is_off = is_off or _is_oblique(prepared.bodies[rows.body], rows, is_pressed)
    if not is_off:
        return ""
    units = prepared.scene.units
    length = amount(float(norms(displacement[is_pressed]).max()), "length", units, 3)
    beside = amount(deformation, "length", units, 3)
    return (
        f"contact {rows.name!r}: the sides move by {length} along each other, and contact forces displace by {beside}: "
        "draw the bodies where they come to rest, hold what slides, or move it less"
    )


def why_moved_off(
    prepared: Prepared,
    rows: ContactInterface,
    motion: FloatArray,
    displacement: FloatArray,
    is_pressed: BoolArray,
    deformation: float,
) -> str:
    """Describe how far a rigid body has moved (3,) from the gaps of its contact; empty if these still hold.

    Polygons are not judged: beside their corners gaps change with any motion.
    """
    from bemkit.contact.polygon import RigidPolygon

    body = prepared.scene.rigid[rows.other - len(prepared.bodies)]
    if not is_in_the_plane(body.obstacle) or isinstance(body.obstacle, RigidPolygon):
        return ""
    (x, y, turn), centre = motion, np.array(body.centre)
    points, frame, relative = rows.points[is_pressed], rows.frame[is_pressed], displacement[is_pressed]
    gap, _ = measure_contact(body.obstacle, points, frame[:, 0])
    arm = points + gap[:, None] * frame[:, 0] - centre
    moved = points + np.einsum("nk,nkc->nc", relative, frame) + [x, y] + turn * turned_left(arm)
    motion_of_body = Placement((float(x), float(y)), float(np.degrees(turn)))
    # the rigid body moves back to its place, and takes the points along
    back = centre + motion_of_body.back(moved - centre)
    followed, _ = measure_contact(body.obstacle, back, motion_of_body.turned_back(frame[:, 0]))
    if not (np.abs(followed - (gap - relative[:, 0])) > _OFF * deformation).any():
        return ""
    length, beside = (amount(each, "length", prepared.scene.units, 3) for each in (float(np.hypot(x, y)), deformation))
    return (
        f"contact {rows.name!r}: the rigid body moves by {length}, and contact forces displace by {beside}: draw it "
        "where it comes to rest, or move it less"
    )


def _is_off_side(rows: ContactInterface, slide: FloatArray, is_pressed: BoolArray, deformation: float) -> bool:
    """Whether another elastic body has moved (n,) [m] by more than its elements, or to a place with another gap."""
    longest = np.abs(slide[is_pressed]).max()
    zone = rows.weights[is_pressed]
    if longest > max(float(zone.mean()), _SHARE_OF_ZONE * float(zone.sum())):
        return True
    # both sides turn by the same angle from their mean normal: half of the change of the gap belongs to the partner
    order = np.argsort(rows.arc_length)
    s, gap = rows.arc_length[order], rows.gap[order]
    changes = [np.interp(rows.arc_length + sign * slide, s, gap) - rows.gap for sign in (-1.0, 1.0)]
    return bool(0.5 * np.abs(changes)[:, is_pressed].max() > _OFF * deformation)


def _is_off_obstacle(
    rows: ContactInterface, obstacle: Obstacle, displacement: FloatArray, is_pressed: BoolArray, deformation: float
) -> bool:
    """Whether pressed nodes have moved to places where the obstacle has another distance or direction."""
    if not is_in_the_plane(obstacle):
        return False
    points, frame, moved = rows.points[is_pressed], rows.frame[is_pressed], displacement[is_pressed]
    gap, _ = measure_contact(obstacle, points, frame[:, 0])
    followed, direction = measure_contact(obstacle, points + np.einsum("nk,nkc->nc", moved, frame), frame[:, 0])
    off = np.abs(followed - (gap - moved[:, 0]))
    turned = np.sum(direction * frame[:, 0], axis=1)
    return bool((off > _OFF * deformation).any() or (turned < _LEAST_COSINE).any())


def _is_oblique(body: PlacedBody, rows: ContactInterface, is_pressed: BoolArray) -> bool:
    """Whether a pressed node touches at a large angle to the sides of the body that meet there."""
    elements, space = rows.elements, body.space
    normals = body.mesh.normals_at(elements, element_nodes(space)[elements])
    towards = np.zeros((space.n_dofs // 2, 2))
    towards[rows.nodes] = rows.frame[:, 0]
    facing = np.full(len(towards), -1.0)
    np.maximum.at(facing, space.element_dofs[elements], np.sum(normals * towards[space.element_dofs[elements]], axis=2))
    return bool((facing[rows.nodes[is_pressed]] < _LEAST_FACING).any())


def _fixed_obstacle(prepared: Prepared, rows: ContactInterface) -> Obstacle:
    """Return the fixed obstacle of a contact."""
    parts = prepared.bodies[rows.body].scene.parts
    stated = {part.name: part.condition for part in parts if isinstance(part.condition, Contact)}
    return stated[rows.part].obstacle


def is_in_the_plane(obstacle: Obstacle) -> bool:
    """Whether an obstacle has a position in the plane, so that its distance from a point that has moved is known."""
    if isinstance(obstacle, SIMPLE_OBSTACLES):
        return True
    from bemkit.contact.polygon import RigidPolygon
    from bemkit.contact.signed_distance import SignedDistance
    from bemkit.contact.spline import RigidSpline

    return isinstance(obstacle, RigidPolygon | RigidSpline | SignedDistance)
