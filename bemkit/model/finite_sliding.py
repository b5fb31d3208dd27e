"""Contacts that move so far along their surfaces that gaps and directions of the undeformed bodies no longer hold.

Contact is linearised about the undeformed bodies: each node keeps its partner, its gap and its direction. A motion
along a plane changes none of these. Any other motion that is long beside the deformation puts the contact forces in
the wrong place: bodies may then come to rest where there is no equilibrium.
"""

from __future__ import annotations

from typing import TypeGuard

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.contact_nodes import nodes_on
from bemkit.contact.obstacle import SIMPLE_OBSTACLES, DirectedObstacle, Obstacle
from bemkit.geometry.placement import Placement
from bemkit.geometry.spaces import element_nodes
from bemkit.geometry.vectors import norms, turned_left
from bemkit.model.contacts import ContactInterface
from bemkit.model.placed import PlacedBody
from bemkit.model.prepared import Prepared
from bemkit.scene.unit_names import amount

_OFF = 0.2
"""Change of gaps that makes pressures wrong, relative to the displacement by contact forces."""
_FAR = 5.0
"""Motion against an oblique contact that makes it wrong, in displacements by contact forces."""
_LEAST_COSINE = 0.866
"""Cosine of the angle by which a direction of contact may turn: 30 degrees."""
_LEAST_FACING = 0.5
"""Cosine of 60 degrees between the normal of a body and the direction of contact, below which contact is oblique."""
_BESIDE = 0.01
"""Share of an unknown motion within which a node lies at either side of a corner."""
_SHARE_OF_ZONE = 0.05
"""Largest motion that is longer than an element, relative to the length of contact."""


def why_off(
    prepared: Prepared,
    rows: ContactInterface,
    motion: FloatArray,
    displacement: FloatArray,
    is_pressed: BoolArray,
    deformation: float,
) -> str:
    """Describe how far the nodes of a contact move; empty if gaps and directions still hold.

    Parameters
    ----------
    prepared : Prepared
    rows : ContactInterface
    motion : (3,) array [m, m, rad]
        Of the rigid body; zero if the partner is none.
    displacement : (n, 2) array [m]
        Relative, normal and tangential.
    is_pressed : (n,) bool array
    deformation : float [m]
        The displacement that contact forces cause. A motion along the surface that is shorter, or shorter than the
        distance of nodes, changes no place that the solution knows.
    """
    short = max(deformation, float(rows.weights[is_pressed].mean()))
    number = rows.other - len(prepared.bodies)
    if number < 0 <= rows.other:
        is_off = _is_off_side(rows, displacement[:, 1], is_pressed, short, deformation)
    else:
        is_off = _is_off_obstacle(prepared, rows, motion, displacement, is_pressed, short, _OFF * deformation)
        if norms(displacement[is_pressed]).max() > _FAR * deformation:
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


def _is_off_side(
    rows: ContactInterface, slide: FloatArray, is_pressed: BoolArray, short: float, deformation: float
) -> bool:
    """Whether another elastic body has moved (n,) [m] by more than its elements, or to a place with another gap."""
    if np.abs(slide[is_pressed]).max() > max(short, _SHARE_OF_ZONE * float(rows.weights[is_pressed].sum())):
        return True
    # both sides turn by the same angle from their mean normal: half of the change of the gap belongs to the partner
    order = np.argsort(rows.arc_length)
    s, gap, far = rows.arc_length[order], rows.gap[order], slide - np.clip(slide, -short, short)
    changes = [np.interp(rows.arc_length + sign * far, s, gap) - rows.gap for sign in (-1.0, 1.0)]
    return bool(0.5 * np.abs(changes)[:, is_pressed].max() > _OFF * deformation)


def _is_off_obstacle(
    prepared: Prepared,
    rows: ContactInterface,
    motion: FloatArray,
    displacement: FloatArray,
    is_pressed: BoolArray,
    short: float,
    tolerance: float,
) -> bool:
    """Whether nodes have moved to places where the obstacle has another distance or direction, or is inside."""
    number = rows.other - len(prepared.bodies)
    fixed = prepared.bodies[rows.body].scene.obstacles
    obstacle = fixed[rows.part] if number < 0 else prepared.scene.rigid[number].obstacle
    if not is_in_the_plane(obstacle):
        return False
    points, normals = rows.points, rows.frame[:, 0]
    gap = obstacle.gap(points, normals)
    relative = np.einsum("nk,nkc->nc", displacement, rows.frame)
    carried, placement, centre = np.zeros_like(points), Placement(), np.zeros(2)
    if rows.motions is not None:
        x, y, turn = motion.tolist()
        carried, placement = rows.motions @ motion, Placement((x, y), float(np.degrees(turn)))
        centre = np.array(prepared.scene.rigid[number].centre)
    body = prepared.bodies[rows.body]
    tangents = np.zeros((body.space.n_dofs // 2, 2))
    nodes, outward = nodes_on(body.space_in_place, rows.elements)
    tangents[nodes] = turned_left(outward)
    tangents = tangents[rows.nodes]
    along = np.sum(relative * tangents, axis=1)[:, None]
    turned_normals = placement.turned_back(normals)
    is_off = np.ones(rows.n_contact, bool)
    # a node that meets a corner of the obstacle may also lie beside it
    for unknown, beside in ((0.0, 0.0), (short, 0.0), (short, _BESIDE * short), (short, -_BESIDE * short)):
        moved = relative - (np.clip(along, -unknown, unknown) + beside) * tangents
        # the rigid body moves back to its place, and takes the points along
        back = centre + placement.back(points + moved + carried - centre)
        followed, direction = obstacle.gap(back, turned_normals), obstacle.approach(back, turned_normals)
        expected = gap - np.sum(moved * normals, axis=1)
        cosine = np.sum(direction * turned_normals, axis=1)
        is_wrong = (np.abs(followed - expected) > tolerance) | (cosine < _LEAST_COSINE)
        is_off &= np.where(is_pressed, is_wrong, followed < np.minimum(gap, 0.0) - tolerance)
    return bool(is_off.any())


def _is_oblique(body: PlacedBody, rows: ContactInterface, is_pressed: BoolArray) -> bool:
    """Whether a pressed node touches at a large angle to the sides of the body that meet there."""
    elements, space = rows.elements, body.space
    normals = body.mesh.normals_at(elements, element_nodes(space)[elements])
    towards = np.zeros((space.n_dofs // 2, 2))
    towards[rows.nodes] = rows.frame[:, 0]
    facing = np.full(len(towards), -1.0)
    np.maximum.at(facing, space.element_dofs[elements], np.sum(normals * towards[space.element_dofs[elements]], axis=2))
    return bool((facing[rows.nodes[is_pressed]] < _LEAST_FACING).any())


def is_in_the_plane(obstacle: Obstacle) -> TypeGuard[DirectedObstacle]:
    """Whether an obstacle has a position in the plane, so that its distance from a point that has moved is known."""
    if isinstance(obstacle, SIMPLE_OBSTACLES):
        return True
    from bemkit.contact.polygon import RigidPolygon
    from bemkit.contact.signed_distance import SignedDistance
    from bemkit.contact.spline import RigidSpline

    return isinstance(obstacle, RigidPolygon | RigidSpline | SignedDistance)
