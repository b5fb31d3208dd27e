"""The contacts of a solution: sides, obstacles, and the rows of its table in frames of their own."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle
from bemkit.results.contact_table import ContactTable
from bemkit.results.part_forces import RigidResult
from bemkit.results.solution import Solution
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.contacts import ContactPair
from bemkit.testing.independent_check.bodies import MeasuredBody, fixed_obstacles_of
from bemkit.testing.independent_check.boundary import mean_normals
from bemkit.testing.independent_check.obstacles import distance_to
from bemkit.testing.independent_check.sides import Relative, Side, measure_flat

GRAZING_COSINE = 2e-3
"""Largest cosine between the body's normal and the direction of contact of a node that may face away: it would slide
five hundred times as far as it approaches, and normals at nodes are means over elements."""


@dataclass(frozen=True, eq=False)
class Facing:
    """A rigid obstacle that a part faces.

    Parameters
    ----------
    obstacle : Obstacle
    centre : (2,) array [m]
        About which it turns.
    motion, before : RigidResult or None
        How it moved, and how far until the end of the load step before; None of one that does not move.
    """

    obstacle: Obstacle
    centre: FloatArray
    motion: RigidResult | None = None
    before: RigidResult | None = None

    def displacement(self, points: FloatArray, motion: RigidResult | None) -> FloatArray:
        """Return displacements (n, 2) [m] of its points (n, 2) by a motion."""
        if motion is None:
            return np.zeros_like(points)
        arm = points - self.centre
        return np.column_stack([motion.x - motion.turn * arm[:, 1], motion.y + motion.turn * arm[:, 0]])


@dataclass(frozen=True, eq=False)
class MeasuredContact:
    """A contact of a body with an obstacle or with another body, and its m rows of the table measured again.

    Parameters
    ----------
    name : str
    pair : ContactPair or None
        None at fixed obstacles.
    owner : Side
        With the nodes.
    partner : Side or None
        The other elastic side.
    facing : Facing or None
        The obstacle, if there is no partner.
    table, before : ContactTable
        Its rows, and those of the load step before.
    law : FrictionLaw
        At its nodes.
    nodes : (m,) int array
        Rows of the displacement of the owner.
    offset : (m,) array [m]
        Distance of the points of the table from those rows' points.
    direction : (m, 2) array [-]
        Of contact: into the obstacle at its nearest point; towards an elastic partner as the solution says.
    distance : (m,) array [m]
        To the obstacle before it moves; infinite where the body faces away from it, and of an elastic partner.
    is_grazing : (m,) bool array
        Nodes for which round-off decides whether they face the obstacle.
    """

    name: str
    pair: ContactPair | None
    owner: Side
    partner: Side | None
    facing: Facing | None
    table: ContactTable
    before: ContactTable | None
    law: FrictionLaw
    nodes: IntArray
    offset: FloatArray
    direction: FloatArray
    distance: FloatArray
    is_grazing: BoolArray

    @property
    def sides(self) -> tuple[tuple[Side, float], ...]:
        """The elastic sides with the signs of the forces on them."""
        return ((self.owner, 1.0),) if self.partner is None else ((self.owner, 1.0), (self.partner, -1.0))

    @cached_property
    def flat(self) -> Relative | None:
        """Two flat sides measured on each other; None of others, and at obstacles."""
        if self.partner is None or self.pair is None:
            return None
        return measure_flat(self.owner, self.partner, self.pair)

    @property
    def is_shared(self) -> bool:
        """Whether several obstacles face the part, of which the nearest counts at each point."""
        return self.facing is not None and self.owner.body.touched.count(self.owner.part) > 1

    @property
    def frame(self) -> FloatArray:
        """(m, 2, 2) array [-]: rows are the direction of contact and its quarter turn."""
        return np.stack([self.direction, np.column_stack([-self.direction[:, 1], self.direction[:, 0]])], axis=1)

    @property
    def forces_along(self) -> FloatArray:
        """(m, 2) array [N/m]: forces on the owner along the rows of `frame`."""
        return self.table.weight[:, None] * np.column_stack([self.table.sigma_n, self.table.sigma_t])

    @cached_property
    def forces(self) -> FloatArray:
        """(m, 2) array [N/m]: forces on the owner in x and y."""
        return np.asarray(np.einsum("nk,nkc->nc", self.forces_along, self.frame))

    @cached_property
    def touched(self) -> FloatArray:
        """(m, 2) array [m]: the points that the nodes may touch."""
        reach = np.where(np.isfinite(self.table.gap), self.table.gap, 0.0) - gap_of(self.pair, self.table.points)
        return np.asarray(self.table.points + reach[:, None] * self.direction)

    @property
    def is_supported(self) -> BoolArray:
        """(m,) bool array: nodes of supports, part of whose force is a reaction, which no friction law governs."""
        return np.isin(self.nodes, self.owner.body.supported_nodes)

    @property
    def stated_displacement(self) -> FloatArray:
        """(m, 2) array [m]: relative displacement along the rows of `frame` by the table."""
        return np.column_stack([self.table.u_n, self.table.u_t])

    @cached_property
    def displacement(self) -> FloatArray:
        """(m, 2) array [m]: relative displacement along the rows of `frame`.

        At obstacles from the boundary field; between elastic bodies, where it is a mean, from the table.
        """
        if self.facing is None:
            return self.stated_displacement
        return self._relative(self.facing, self.owner.body.solved, self.facing.motion)

    @property
    def slip(self) -> FloatArray:
        """(m,) array [m]: tangential displacement since the load step before, beyond round-off."""
        slip = self.displacement[:, 1]
        if self.facing is None:
            slip = slip if self.before is None else slip - self.before.u_t
        elif self.owner.body.before is not None:
            slip = slip - self._relative(self.facing, self.owner.body.before, self.facing.before)[:, 1]
        return np.asarray(np.sign(slip) * np.maximum(np.abs(slip) - self.owner.body.scales.slipped, 0.0))

    def _relative(self, facing: Facing, body: SolvedBody, motion: RigidResult | None) -> FloatArray:
        relative = body.boundary.displacement[self.nodes] - facing.displacement(self.touched, motion)
        return np.asarray(np.einsum("nkc,nc->nk", self.frame, relative))

    @property
    def length(self) -> float:
        """Unit of displacements [m]: that of the softer body."""
        return max(side.body.scales.length for side, _ in self.sides)

    @property
    def stress(self) -> float:
        """Unit of tractions [Pa]: that of the body that carries less, but for round-off that the other passes on."""
        scales = [side.body.scales for side, _ in self.sides]
        return max(min(each.stress for each in scales), *(each.trusted for each in scales))

    @property
    def turned(self) -> float:
        """Round-off of components of displacements [m]."""
        return max(side.body.scales.turned for side, _ in self.sides)


def gap_of(pair: ContactPair | None, points: FloatArray) -> FloatArray:
    """Return the gap (n,) [m] that a contact adds at points (n, 2)."""
    return np.zeros(len(points)) if pair is None else pair.gap_at(points)


def measured_contacts(
    solution: Solution, before: Solution | None, bodies: Mapping[str, MeasuredBody]
) -> Iterator[MeasuredContact]:
    """Yield the contacts of a solution, those with fixed obstacles first."""
    for name, body in bodies.items():
        for part, obstacle in fixed_obstacles_of(body.solved).items():
            contact, facing = name_at_obstacle(name, part), Facing(obstacle, np.zeros(2))
            yield _measured(solution, before, contact, None, (Side(body, part),), facing)
    for pair in solution.scene.contacts:
        sides = tuple(Side(bodies[side.body], side.part) for side in solution.contact_sides[pair.name])
        yield _measured(solution, before, pair.name, pair, sides, _moving(solution, before, pair))


def _moving(solution: Solution, before: Solution | None, pair: ContactPair) -> Facing | None:
    """Return the obstacle of a contact with a rigid body that moves."""
    if pair.rigid_body is None:
        return None
    rigid = solution.scene.rigid_body_of(pair)
    earlier = None if before is None else before.rigid[rigid.name]
    return Facing(rigid.obstacle, np.array(rigid.centre, float), solution.rigid[rigid.name], earlier)


def _measured(
    solution: Solution,
    before: Solution | None,
    name: str,
    pair: ContactPair | None,
    sides: tuple[Side, ...],
    facing: Facing | None,
) -> MeasuredContact:
    owner, table = sides[0], solution.contact.renamed({name: name})
    points, rows = table.points, np.flatnonzero(solution.contact.rows(name))
    boundary, body = owner.body.boundary, owner.body.solved
    own = np.unique(boundary.nodes[owner.elements])
    offset, nearest = (np.asarray(each) for each in cKDTree(body.boundary.points[own]).query(points))
    law, nodes = solution.laws[name].at(points), own[nearest]
    if facing is None:
        distance, direction, is_grazing = np.full(len(rows), np.inf), solution.contact_directions[rows], rows < 0
    else:
        normals = mean_normals(body, boundary, owner.part)[nodes]
        distance, direction = distance_to(facing.obstacle, points, normals)
        cosine = np.sum(direction * normals, axis=1)
        distance = np.where(cosine > GRAZING_COSINE, distance + gap_of(pair, points), np.inf)
        is_grazing = np.abs(cosine) <= GRAZING_COSINE
    return MeasuredContact(
        name=name,
        pair=pair,
        owner=owner,
        partner=sides[1] if len(sides) > 1 else None,
        facing=facing,
        table=table,
        before=None if before is None else before.contact.renamed({name: name}),
        law=law if solution.motion is None else law.at_slip(solution.motion.of(rows)),
        nodes=nodes,
        offset=offset,
        direction=np.asarray(direction),
        distance=distance,
        is_grazing=is_grazing,
    )
