"""How far elastic bodies violate the conditions of contact with each other between the nodes."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.contact_nodes import contact_frame
from bemkit.contact.mortar.congruent import congruence_key
from bemkit.contact.mortar.projection import mean_directions
from bemkit.contact.mortar.segments import Segments, common_refinement, facing_points
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.placement import Placement
from bemkit.model.body_contacts import reach_of
from bemkit.results.points_between import (
    AddedGap,
    Interpolation,
    MeasuredContact,
    PointsBetween,
    points_between,
    with_least_clearances,
)
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.contacts import ContactPair

if TYPE_CHECKING:
    from bemkit.results.solved_scene import SolvedScene


def contacts_between_bodies(solution: SolvedScene) -> Iterator[MeasuredContact]:
    """Yield the contacts between elastic bodies, first with the tractions of one side, then with those of the other."""
    scene, solved, sides = solution.scene, solution.bodies, solution.contact_sides
    placements = {body.name: body.placement for body in scene.placed_bodies}
    known: dict[Hashable, _Facing] = {}

    def measured(pair: ContactPair, names: tuple[str, str], parts: tuple[str, str]) -> PointsBetween:
        one, two = (solved[name] for name in names)
        reach = reach_of(pair, one.mesh, two.mesh)
        alike = congruence_key((one.mesh, placements[names[0]]), (two.mesh, placements[names[1]]), reach)
        key = (alike, parts)
        if key not in known:
            known[key] = _Facing.of((one, two), parts, placements[names[0]], reach)
        return known[key].values((one, two), placements[names[0]], pair.gap_at)

    for pair in scene.elastic_contacts:
        (one, part), (two, other) = sides[pair.name]
        measure = partial(measured, pair, (one, two), (part, other))
        yield MeasuredContact(pair.name, (one, two), scene.law_of(pair), measure)


@dataclass(frozen=True, eq=False)
class _Facing:
    """Points of two sides that face each other, for all pairs of bodies in the same relative position.

    Parameters
    ----------
    placement : Placement
        Of the body with the multipliers when points and vectors were computed.
    sides : two ContactSide
        That of the body with the multipliers, and the other one.
    bodies : two SolvedBody
        In the same order.
    directions : (n_knots, 2) array
        Of the projection.
    segments : Segments
        That face the other side.
    xi : (q,) array
        Points on each.
    """

    placement: Placement
    sides: tuple[ContactSide, ContactSide]
    bodies: tuple[SolvedBody, SolvedBody]
    directions: FloatArray
    segments: Segments
    xi: FloatArray

    @classmethod
    def of(
        cls,
        bodies: tuple[SolvedBody, SolvedBody],
        parts: Sequence[str],
        placement: Placement,
        reach: float,
    ) -> _Facing:
        one, two = (
            ContactSide(body.scene.discretisation.displacement_space(body.mesh), body.mesh.part(part))
            for body, part in zip(bodies, parts, strict=True)
        )
        directions = mean_directions(one, two, reach)
        segments = common_refinement(one, two, directions, reach)
        xi = points_between(max(one.space.degree, two.space.degree))
        return cls(placement, (one, two), bodies, directions, segments.covered(), xi)

    @cached_property
    def _whole(self) -> _FacingPoints:
        n = self.segments.row.size
        return self.at(np.arange(n), np.full(n, -1.0), np.ones(n))

    def at(self, pieces: IntArray, low: FloatArray, high: FloatArray) -> _FacingPoints:
        """Return the points of intervals of pieces, and what they face."""
        one, two = self.sides
        segments = self.segments.within(pieces, low, high)
        places = facing_points(segments, one, two, self.directions, self.xi, np.ones_like(self.xi))
        xi, row = places.xi, places.row
        before, half = np.cumsum(one.lengths) - one.lengths, 0.5 * one.lengths[row, None]
        return _FacingPoints(
            (
                Interpolation.at(self.bodies[0], one.elements[row], xi),
                Interpolation.at(self.bodies[1], two.elements[places.partner], places.eta),
            ),
            (before[row, None] + half * (1.0 + xi)).ravel(),
            one.points(row, xi).reshape(-1, 2),
            np.asarray(one.directions(self.directions, row, xi)).reshape(-1, 2),
            places.gap.reshape(-1, 2),
        )

    def values(self, bodies: tuple[SolvedBody, SolvedBody], placement: Placement, gap: AddedGap) -> PointsBetween:
        """Return clearance and tractions at points of the sides, first with those of one side, then of the other."""
        n = self.segments.row.size
        known: dict[bytes, _FacingPoints] = {}
        one_sided = [
            with_least_clearances(partial(self._sample, side, bodies, placement, gap, known), n, self.xi)
            for side in (0, 1)
        ]
        return PointsBetween(*(np.concatenate(columns) for columns in zip(*one_sided, strict=True)))

    def _sample(
        self,
        side: int,
        bodies: tuple[SolvedBody, SolvedBody],
        placement: Placement,
        gap: AddedGap,
        known: dict[bytes, _FacingPoints],
        pieces: IntArray,
        low: FloatArray,
        high: FloatArray,
    ) -> PointsBetween:
        """Return clearance at points of intervals of pieces, and the tractions of one of the sides, 0 or 1.

        Intervals that are searched for one side are known when the other one is searched.
        """
        if np.all(high - low == 2.0):
            at = self._whole
        elif (key := b"".join(each.tobytes() for each in (pieces, low, high))) in known:
            at = known[key]
        else:
            at = known[key] = self.at(pieces, low, high)
        points = placement.forward(self.placement.back(at.points))
        directions, gaps = (
            placement.turned(self.placement.turned_back(vectors)) for vectors in (at.directions, at.gap)
        )
        displacements = (
            fields.displacement(body).reshape(-1, 2) for fields, body in zip(at.fields, bodies, strict=True)
        )
        one, two = displacements
        clearance = gap(points) + np.sum((gaps - one + two) * directions, axis=1)
        traction = (1.0, -1.0)[side] * at.fields[side].traction(bodies[side]).reshape(-1, 2)
        sigma_n, sigma_t = np.einsum("nkc,nc->kn", contact_frame(directions), traction)
        step = sum(fields.step(body).ravel() for fields, body in zip(at.fields, bodies, strict=True))
        return PointsBetween(points, at.s, directions, clearance, sigma_n, sigma_t, np.asarray(step))


class _FacingPoints(NamedTuple):
    """Points of two sides that face each other.

    Parameters
    ----------
    fields : two Interpolation
        Of the body with the multipliers, and of the other one.
    s : (n,) array [m]
    points, directions, gap : (n, 2) arrays
        The gap is the vector from one side to the other.
    """

    fields: tuple[Interpolation, Interpolation]
    s: FloatArray
    points: FloatArray
    directions: FloatArray
    gap: FloatArray
