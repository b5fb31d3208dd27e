"""Corners at which contact tractions are singular, so that the elements there have large errors of tractions.

A block that slides on its whole side is the simplest case: towards its corners the pressure grows like a power of the
distance that depends on the friction. The exponents are those of `bemkit.results.wedge`.
"""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.laws import FrictionLaw
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import break_nodes
from bemkit.geometry.vectors import angles_between, norms
from bemkit.results.contact_table import ContactTable
from bemkit.results.solved_body import SolvedBody
from bemkit.results.wedge import FREE, HELD, ROLLER, WedgeSide, leading_exponent
from bemkit.results.zone_ends import NEIGHBOURHOOD
from bemkit.scene.conditions import Clamped, Contact, PrescribedDisplacement, Roller
from bemkit.solvers.active_sets import NodeStatus

_PARALLEL = 1e-6
"""Component along the normal or the tangent that counts as zero."""
_BESIDE = 1e-3
"""Local coordinate beside the middle of an element: the nearer one of its two ends is then certain."""
DIGITS = 6
"""Digits to which angles are rounded: round-off of short elements must not separate equal ones."""
BEFORE, AFTER = 0, 1
"""The element that ends at a node, and the one that starts there."""


@dataclass(frozen=True)
class SingularCorner:
    """A place where contact tractions grow like a power of the distance.

    Parameters
    ----------
    x, y : float [m]
    exponent : float
        Tractions behave like ``r**(exponent - 1)``; see `bemkit.results.wedge.leading_exponent`.
    before, after : tuple of int
        The elements in contact within `NEIGHBOURHOOD` of the corner, at least one on each side in contact: before the
        corner along the boundary, and after it. Empty for a side that is not in contact.
    partner : str
        The other elastic body; empty at a rigid obstacle.
    """

    x: float
    y: float
    exponent: float
    before: tuple[int, ...]
    after: tuple[int, ...]
    partner: str = ""

    @property
    def elements(self) -> tuple[int, ...]:
        """The elements of both sides."""
        return self.before + self.after

    def beside(self, mesh: BoundaryMesh) -> list[tuple[int, int]]:
        """Return of each side in contact the element at the corner, and the first one that lies further away."""
        sides = ((self.before, BEFORE), (self.after, AFTER))
        return [(side[0], _next(mesh, side[-1], way)) for side, way in sides if side]

    def as_dict(self) -> dict[str, Any]:
        """Return place and exponent as JSON can hold them."""
        return {"x": self.x, "y": self.y, "exponent": self.exponent}


def singular_corners(
    body: SolvedBody, contact: ContactTable, *, motion: SlipHistory | None = None, unknown: Collection[str] = ()
) -> tuple[SingularCorner, ...]:
    """Return the corners and ends of contact parts at which contact tractions grow without bound.

    Contact reaches them, and the conditions on their two sides admit singular tractions. The contact nodes beside them
    show whether they stick, and the direction of slip. Symmetry lines and half-planes have none.

    Parameters
    ----------
    body : SolvedBody
    contact : ContactTable
        Of its contact with rigid obstacles.
    motion : SlipHistory, optional
        In a load history, for laws that depend on it.
    unknown : collection of str
        Parts that touch other elastic bodies: corners beside them are not judged.
    """
    mesh = body.mesh
    if mesh.surface is not None:
        return ()
    given, (ends, starts) = GivenSides(body, contact, motion, unknown), mesh.node_elements.T
    chosen = break_nodes(mesh) & (given.may_touch[ends] | given.may_touch[starts]) & (ends != starts)
    corners = []
    for node in np.flatnonzero(chosen).tolist():
        before, after = int(ends[node]), int(starts[node])
        incoming, outgoing = given.at_end(before), given.at_start(after)
        if incoming is None or outgoing is None:
            continue
        touches = [given.may_touch[k] and side.holds_normal for k, side in ((before, incoming), (after, outgoing))]
        if not any(touches):
            continue
        angle = round(angle_between(mesh, before, after), DIGITS)
        exponent = leading_exponent(angle, outgoing, incoming, body.scene.material.kappa)
        if exponent is not None:
            x, y = mesh.nodes[node].tolist()
            near = [given.near(k, way) if touches[way] else () for k, way in ((before, BEFORE), (after, AFTER))]
            corners.append(SingularCorner(x, y, exponent, before=near[BEFORE], after=near[AFTER]))
    return tuple(corners)


def _next(mesh: BoundaryMesh, element: int, way: int) -> int:
    """Return the element before or after another one."""
    return int(mesh.node_elements[mesh.elements[element, way], way])


def angle_between(mesh: BoundaryMesh, before: int, after: int) -> float:
    """Return the angle [rad] of the body between the end of one element and the start of the next."""
    return float(np.pi - angles_between(_normal(mesh, before, 1.0), _normal(mesh, after, -1.0)))


def _normal(mesh: BoundaryMesh, element: int, xi: float) -> FloatArray:
    return np.asarray(mesh.normals_at(np.array([element]), np.array([xi]))[0, 0])


class GivenSides:
    """Conditions on the elements of a solved body at either of their ends."""

    def __init__(
        self, body: SolvedBody, contact: ContactTable, motion: SlipHistory | None, unknown: Collection[str]
    ) -> None:
        self._scene, self._mesh, self._table, self._motion = body.scene, body.mesh, contact, motion
        self._unknown = unknown
        self._part = np.full(body.mesh.n_elements, "", dtype=object)
        for part in body.scene.parts:
            self._part[body.mesh.part(part.name)] = part.name
        self._conditions = {part.name: part.condition for part in body.scene.parts}
        self.may_touch: BoolArray = np.isin(self._part, [part.name for part in body.scene.contact_parts])

    def at_start(self, element: int) -> WedgeSide | None:
        """Return the condition at the start of an element; None if unknown, or a displacement at an angle to it."""
        return self._at(element, -1.0)

    def at_end(self, element: int) -> WedgeSide | None:
        """Return the same where it ends."""
        return self._at(element, 1.0)

    def near(self, element: int, way: int) -> tuple[int, ...]:
        """Return the elements of its part from an element on that lie within `NEIGHBOURHOOD`, itself in any case."""
        lengths, members = self._mesh.lengths, self._part == self._part[element]
        room, found = NEIGHBOURHOOD * float(lengths[members].sum()) - float(lengths[element]), [element]
        while True:
            element = _next(self._mesh, element, way)
            room -= float(lengths[element])
            if room < 0.0 or not members[element]:
                return tuple(found)
            found.append(element)

    def _at(self, element: int, xi: float) -> WedgeSide | None:
        if self._part[element] in self._unknown:
            return None
        condition = self._conditions.get(self._part[element])
        if isinstance(condition, Contact):
            return self._in_contact(element, xi)
        if isinstance(condition, PrescribedDisplacement):
            return _displaced(_normal(self._mesh, element, xi), np.array(condition.is_prescribed))
        if isinstance(condition, Clamped):
            return HELD
        return ROLLER if isinstance(condition, Roller) else FREE

    def _in_contact(self, element: int, xi: float) -> WedgeSide | None:
        """Return the status of a contact node, see `touching_side`; None if the part has no node."""
        rows = np.flatnonzero(self._table.rows(self._part[element]))
        if not rows.size:  # both nodes of a part of one element belong to its neighbours
            return None
        law = self._scene.laws[self._part[element]].at(self._table.points[rows])
        law = law if self._motion is None else law.at_slip(self._motion.of(rows))
        return touching_side(self._table, law, beside_middle(self._mesh, element, xi), rows)


def beside_middle(mesh: BoundaryMesh, element: int, xi: float) -> FloatArray:
    """Return the point (2,) beside the middle of an element towards an end at xi, so that equally near nodes differ."""
    return np.asarray(mesh.points(np.array([element]), np.array([_BESIDE * xi]))[0, 0])


def touching_side(table: ContactTable, law: FrictionLaw, point: FloatArray, rows: IntArray) -> WedgeSide:
    """Return the condition of the contact node nearest to a point among some rows, with the law at these."""
    nearest = int(np.argmin(norms(table.points[rows] - point)))
    status = NodeStatus(int(table.status[rows[nearest]]))
    if status in (NodeStatus.SEPARATED, NodeStatus.STICK):
        return FREE if status is NodeStatus.SEPARATED else HELD
    slope = -float(law.bound_derivative(np.minimum(table.sigma_n[rows], 0.0))[nearest])
    return WedgeSide(holds_normal=True, friction=slope if status is NodeStatus.SLIP_FORWARD else -slope)


def _displaced(normal: FloatArray, is_given: BoolArray) -> WedgeSide | None:
    """Return a side with one or both displacements along the axes given; None if one lies at an angle."""
    if is_given.all():
        return HELD
    along_normal = float(np.abs(normal[is_given]).max())
    if along_normal > 1.0 - _PARALLEL:
        return ROLLER
    return WedgeSide(holds_tangent=True) if along_normal < _PARALLEL else None
