"""Corners at which two elastic bodies touch and contact tractions grow without bound, such as the edges of a punch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.operators.material import Material
from bemkit.results.contact_table import ContactTable
from bemkit.results.singular_corners import (
    AFTER,
    BEFORE,
    DIGITS,
    GivenSides,
    SingularCorner,
    angle_between,
    beside_middle,
    touching_side,
)
from bemkit.results.wedge import FREE, JoinedWedge, WedgeSide, joined_exponent
from bemkit.results.zone_ends import LYING_AT, LYING_ON, Side


class _Place(NamedTuple):
    """A point of a side: the elements that end and start there, twice the same one inside of it."""

    side: Side
    before: int
    after: int

    @property
    def angle(self) -> float:
        """The angle [rad] of the body there."""
        if self.before == self.after:
            return float(np.pi)
        return round(angle_between(self.side.mesh, self.before, self.after), DIGITS)

    def given(self, of_body: GivenSides, touching: int) -> WedgeSide | None:
        """Return the condition beside the touching element, before or after the point; None if it is unknown."""
        element = (self.after, self.before)[touching]
        if element in self.side.mesh.part(self.side.part):  # the side goes on, past the end of the other one
            return FREE
        return of_body.at_start(element) if touching == BEFORE else of_body.at_end(element)


def joined_corners(
    one: Side,
    two: Side,
    table: ContactTable,
    law: FrictionLaw,
    given: Mapping[str, GivenSides],
    materials: Mapping[str, Material],
) -> Iterator[tuple[str, SingularCorner]]:
    """Yield the body and the corner, for both bodies, where tractions between two sides grow without bound.

    These are ends of either side that lie on the other one in contact; see `bemkit.results.wedge.joined_exponent`.

    Parameters
    ----------
    one, two : Side
    table : ContactTable
        The rows of their contact.
    law : FrictionLaw
        Of their contact; it needs no history.
    given : mapping of str to GivenSides
        Conditions beside the contacts, by the name of the body; unknown where other contacts follow.
    materials : mapping of str to Material
        By the name of the body.
    """
    law_at_nodes, every_node = law.at(table.points), np.arange(table.n_contact)
    points = [(one, two, point) for point in one.ends]
    same = LYING_AT * min(one.length, two.length)
    points += [(two, one, point) for point in two.ends if all(np.abs(point - p).max() > same for _, _, p in points)]
    for side, other, point in points:
        end, foot = _end_of(side, point), _foot_of(other, point, LYING_ON * min(one.length, two.length))
        if foot is None or end.before == end.after:
            continue
        way = AFTER if end.after in side.mesh.part(side.part) else BEFORE  # of the touching element
        touching = (end.before, end.after)[way], (foot.after, foot.before)[way]
        wedges = end.given(given[side.body], way), foot.given(given[other.body], 1 - way)
        middle = beside_middle(side.mesh, touching[0], 1.0 if way == BEFORE else -1.0)
        contact = touching_side(table, law_at_nodes, middle, every_node)
        is_on_other = touching[1] in other.mesh.part(other.part)
        if contact == FREE or not is_on_other or wedges[0] is None or wedges[1] is None:
            continue
        ordered = [
            JoinedWedge(place.angle, materials[place.side.body].kappa, materials[place.side.body].shear_modulus, beside)
            for place, beside in ((end, wedges[0]), (foot, wedges[1]))
        ]
        exponent = joined_exponent(*(ordered if way == BEFORE else reversed(ordered)), contact)
        if exponent is None:
            continue
        x, y = point.tolist()
        for each, partner, element, its_way in (
            (side, other, touching[0], way),
            (other, side, touching[1], 1 - way),
        ):
            before, after = (given[each.body].near(element, its_way) if its_way == k else () for k in (BEFORE, AFTER))
            yield each.body, SingularCorner(x, y, exponent, before, after, partner.body)


def _end_of(side: Side, point: FloatArray) -> _Place:
    """Return the place of an end of a side."""
    first, last = side.elements[[0, -1]].tolist()
    is_start = np.array_equal(side.mesh.start[first], point)
    return _at_node(side, int(side.mesh.elements[first, 0] if is_start else side.mesh.elements[last, 1]))


def _foot_of(side: Side, point: FloatArray, near: float) -> _Place | None:
    """Return the place on a side nearest to a point; None if that is not near."""
    end, mesh = side.near(point), side.mesh
    places = np.array([2.0 * end.fraction - 1.0])
    if float(np.linalg.norm(mesh.points(np.array([end.element]), places)[0, 0] - point)) > near:
        return None
    if end.distance > LYING_AT * side.length:
        return _Place(side, end.element, end.element)
    return _at_node(side, int(mesh.elements[end.element, int(end.fraction > 0.5)]))


def _at_node(side: Side, node: int) -> _Place:
    return _Place(side, *side.mesh.node_elements[node].tolist())
