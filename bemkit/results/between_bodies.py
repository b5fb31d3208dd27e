"""How far the bodies of a solved assembly violate the contact conditions between the nodes."""

from __future__ import annotations

from collections.abc import Callable, Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.condensation.nodes import contact_frame
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.mortar.congruent import stand_alike
from bemkit.contact.mortar.projection import mean_directions
from bemkit.contact.mortar.segments import Segments, common_refinement, facing_points
from bemkit.contact.mortar.sides import ContactSide
from bemkit.geometry.placement import Placement
from bemkit.model.body_contacts import reach_of
from bemkit.results.between_nodes import (
    BetweenNodes,
    Interpolation,
    law_between,
    points_between,
    sample_at_obstacle,
    violations_at,
)
from bemkit.results.contact_table import ContactTable
from bemkit.results.least_clearance import PointsBetween, Sample, nearest_only, with_least_clearances
from bemkit.results.part_forces import RigidResult
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.assembly import Assembly, ContactPair
from bemkit.scene.conditions import Contact
from bemkit.scene.plane_motion import RigidBody

_LIGHTEST = 1e-3
"""A body that carries less than this share of what the others carry is measured by this share."""


class _Measured(NamedTuple):
    """A contact of an assembly, the elastic bodies that it joins, its law, and what measures points of it."""

    name: str
    bodies: tuple[str, ...]
    law: FrictionLaw
    measure: Callable[[], PointsBetween]


def violations_between_bodies(
    assembly: Assembly,
    bodies: Mapping[str, SolvedBody],
    sides: Mapping[str, Sequence[tuple[str, str]]],
    rigid: Mapping[str, RigidResult],
    contact: ContactTable,
    motion: SlipHistory | None = None,
    names: Collection[str] | None = None,
) -> dict[str, BetweenNodes]:
    """Measure displacements and tractions of an assembly along its contacts, without running anything again.

    Parameters
    ----------
    assembly : Assembly
    bodies : mapping of str to SolvedBody
        By name.
    sides : mapping of str to sequence of (str, str)
        Body and part of both sides of each contact, first the one with the nodes.
    rigid : mapping of str to RigidResult
        By name.
    contact : ContactTable
    motion : SlipHistory, optional
        Of the contact nodes, for laws that depend on slip or time.
    names : collection of str, optional
        The contacts to measure; by default all. What they are relative to comes from all in either case.

    Returns
    -------
    dict of str to BetweenNodes
        By contact of the table.

    Notes
    -----
    Points lie on the pieces on which the functions of both sides are smooth, and face each other along the mean of both
    normals. Tractions of both sides are measured, with one clearance. They are relative to those on the body of the
    contact that carries less, and lengths to the displacement of the softer one, so that a light block is not judged by
    the heaviest. Without any contact force lengths are relative to the larger displacement of the two.
    """
    stated = [*_at_obstacles(assembly, bodies, rigid), *_at_bodies(assembly, bodies, sides)]
    forces = {name: 0.0 for name in bodies}
    stresses = dict(forces)
    size = np.hypot(contact.sigma_n, contact.sigma_t)
    for name, partners, _, _ in stated:
        rows = contact.rows(name)
        for body in partners:
            forces[body] += float(contact.weight[rows] @ size[rows])
            stresses[body] = max(stresses[body], float(size[rows].max(initial=0.0)))
    violations: dict[str, BetweenNodes] = {}
    moved = {name: float(np.abs(body.boundary.displacement).max()) for name, body in bodies.items()}
    for name, partners, law, measure in stated:
        if names is not None and name not in names:
            continue
        modulus = min(bodies[body].scene.material.plane_modulus for body in partners)
        force, stress = (
            max(min(of[body] for body in partners), _LIGHTEST * max(of.values())) for of in (forces, stresses)
        )
        with np.errstate(all="ignore"):  # results that are not finite are measured by nan
            values = measure()
            violations[name] = violations_at(
                values,
                law_between(law, values, contact, name, motion),
                stress or 1.0,
                force / modulus or max(moved[body] for body in partners) or max(moved.values()) or 1.0,
            )
    return violations


def _at_obstacles(
    assembly: Assembly, bodies: Mapping[str, SolvedBody], rigid: Mapping[str, RigidResult]
) -> Iterator[_Measured]:
    """Yield the contacts with rigid obstacles, fixed and moving; each point belongs to the one that is nearest."""
    moving: dict[str, list[ContactPair]] = {}
    for pair in assembly.contacts:
        if pair.rigid_body is not None:
            moving.setdefault(pair.elastic_parts[0][0], []).append(pair)
    for owner, body in bodies.items():
        scene, mesh = body.scene, body.mesh
        facing: dict[str, list[tuple[str, FrictionLaw, Sample]]] = {}
        for part in scene.parts:
            if isinstance(part.condition, Contact):
                sample = sample_at_obstacle(body, part.condition.obstacle, mesh.part(part.name))
                facing.setdefault(part.name, []).append((f"{owner}.{part.name}", scene.laws[part.name], sample))
        for pair in moving.get(owner, ()):
            part_name = pair.elastic_parts[0][1]
            shift = partial(_moved, assembly.rigid_body_of(pair), rigid[str(pair.rigid_body)])
            obstacle = assembly.rigid_body_of(pair).obstacle
            sample = sample_at_obstacle(body, obstacle, mesh.part(part_name), pair.gap, shift)
            facing.setdefault(part_name, []).append((pair.name, assembly.law_of(pair), sample))
        xi = points_between(scene.discretisation.displacement_space(mesh).degree)
        for part_name, rivals in facing.items():
            samples = [sample for _, _, sample in rivals]
            for k, (name, law, _) in enumerate(rivals):
                sample, n_elements = nearest_only(samples, k), mesh.part(part_name).size
                yield _Measured(name, (owner,), law, partial(with_least_clearances, sample, n_elements, xi))


def _moved(stated: RigidBody, motion: RigidResult, points: FloatArray) -> FloatArray:
    """Return the displacements (n, 2) [m] of a rigid body at points (n, 2)."""
    return np.asarray(stated.motions_at(points) @ np.array([motion.x, motion.y, motion.turn]))


def _at_bodies(
    assembly: Assembly, solved: Mapping[str, SolvedBody], sides: Mapping[str, Sequence[tuple[str, str]]]
) -> Iterator[_Measured]:
    """Yield the contacts between elastic bodies, the tractions of both sides one after the other."""
    placements = {body.name: body.placement for body in assembly.placed_bodies}
    known: dict[Hashable, _Facing] = {}

    def measured(pair: ContactPair, names: tuple[str, str], parts: tuple[str, str]) -> PointsBetween:
        one, two = (solved[name] for name in names)
        reach = reach_of(pair, one.mesh, two.mesh)
        alike = stand_alike((one.mesh, placements[names[0]]), (two.mesh, placements[names[1]]), reach)
        key = (alike, parts)
        if key not in known:
            known[key] = _Facing.of((one, two), parts, placements[names[0]], reach)
        return known[key].values((one, two), placements[names[0]], pair.gap)

    for pair in assembly.elastic_contacts:
        (one, part), (two, other) = sides[pair.name]
        yield _Measured(
            pair.name, (one, two), assembly.law_of(pair), partial(measured, pair, (one, two), (part, other))
        )


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

    def values(self, bodies: tuple[SolvedBody, SolvedBody], placement: Placement, gap: float) -> PointsBetween:
        """Return clearance and tractions at points of the sides, first with those of one side, then of the other."""
        n = self.segments.row.size
        one_sided = [
            with_least_clearances(partial(self._sample, side, bodies, placement, gap), n, self.xi) for side in (0, 1)
        ]
        return PointsBetween(*(np.concatenate(columns) for columns in zip(*one_sided, strict=True)))

    def _sample(
        self,
        side: int,
        bodies: tuple[SolvedBody, SolvedBody],
        placement: Placement,
        gap: float,
        pieces: IntArray,
        low: FloatArray,
        high: FloatArray,
    ) -> PointsBetween:
        """Return clearance at points of intervals of pieces, and the tractions of one of the sides, 0 or 1."""
        is_whole = bool(np.all(high - low == 2.0))
        at = self._whole if is_whole else self.at(pieces, low, high)
        points = placement.forward(self.placement.back(at.points))
        directions, gaps = (
            placement.turned(self.placement.turned_back(vectors)) for vectors in (at.directions, at.gap)
        )
        displacements = (
            fields.displacement(body).reshape(-1, 2) for fields, body in zip(at.fields, bodies, strict=True)
        )
        one, two = displacements
        clearance = gap + np.sum((gaps - one + two) * directions, axis=1)
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
