"""The contacts of elastic bodies with obstacles and rigid bodies, node by node; the form of all contacts."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from operator import itemgetter
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.contact_nodes import approaches
from bemkit.contact.laws import FrictionLaw, Frictionless, LawError, LawOfCoefficients
from bemkit.contact.obstacle import RigidHalfPlane
from bemkit.errors import InputError, format_point
from bemkit.geometry.spaces import dof_points
from bemkit.model.contact_data import ContactData, FacingPart, find_contact
from bemkit.model.placed import PlacedBody, groups
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.body_scene import BodyScene
from bemkit.scene.conditions import name_at_obstacle
from bemkit.scene.scene import Scene

if TYPE_CHECKING:
    from scipy import sparse

    from bemkit.scene.contacts import ContactPair

OVERLAP_TOLERANCE = 1e-6
"""Unintended overlap of shapes by round-off of curves, relative to the size of the smaller body."""
_SAME_DIRECTION = 1e-12


class OverlapError(InputError):
    """Bodies that overlap by more than an interference that was given."""


@dataclass(frozen=True, eq=False)
class ContactInterface:
    """The nodes of one contact: where relative displacements and tractions are unknown.

    Parameters
    ----------
    name : str
        Of the contact; of a fixed obstacle ``"body.part"``.
    law : FrictionLaw
    part : str
        Of the body, where the nodes are.
    body, other : int
        The body whose nodes these are (the non-mortar side), and its partner: rigid bodies count on after the elastic
        ones, and a fixed obstacle is -1.
    nodes : (n,) array
        Scalar dofs of the body.
    points : (n, 2) array [m]
    arc_length : (n,) array [m]
        From the start of the side.
    frame : (n, 2, 2) array
        Direction of contact, out of the body, and tangent.
    weights, gap : (n,) arrays [m]
    couplings : two sparse (n, n_nodes) arrays, or None
        Between elastic bodies the relative displacement of row i is ``frame[i] @ (B[i] @ u - C[i] @ u_other)`` with
        both of them. With an obstacle or a rigid body row i belongs to node ``nodes[i]`` only.
    motions : (n, 2, 3) array or None
        How the motions of a rigid body displace what the nodes may touch.
    elements, other_elements : int arrays
        Of both sides; none of a rigid obstacle.
    tangent_follows : (n,) bool array
        Where a support, or a second obstacle in a corner, gives the tangential displacement.
    is_on_line : (n,) bool array
        Where the node lies on a symmetry line across its tangent: neither slips nor carries friction.
    is_frictionless : (n,) bool array
        Where a support holds the node in one direction and the partner moves: the tangent follows from both, and a
        friction of its own would repeat what other nodes say. And where a node faces away from an obstacle whose
        friction acts across gaps.
    """

    name: str
    law: FrictionLaw
    part: str
    body: int
    other: int
    nodes: IntArray
    points: FloatArray
    arc_length: FloatArray
    frame: FloatArray
    weights: FloatArray
    gap: FloatArray
    couplings: tuple[sparse.csr_array, sparse.csr_array] | None
    motions: FloatArray | None
    elements: IntArray
    other_elements: IntArray
    tangent_follows: BoolArray
    is_on_line: BoolArray
    is_frictionless: BoolArray

    @property
    def n_contact(self) -> int:
        """Number of nodes."""
        return self.nodes.size

    def at_nodes(self, values: FloatArray) -> FloatArray:
        """Return the values (n, ...) of each row from those of the nodes of the body (n_nodes, ...)."""
        return np.asarray(values[self.nodes] if self.couplings is None else self.couplings[0] @ values)

    def acting_at(self, bodies: Sequence[PlacedBody]) -> list[FloatArray]:
        """Return the points (n, 2) [m] of the force of each row on the body, and on its partner if that is elastic.

        A node that takes a share of others is not the point of its force.
        """
        points = [self.at_nodes(dof_points(bodies[self.body].space))]
        if self.couplings is not None:
            points.append(np.asarray(self.couplings[1] @ dof_points(bodies[self.other].space)))
        return points

    @property
    def touched_nodes(self) -> list[tuple[int, IntArray]]:
        """The elastic bodies, and their nodes that take part."""
        if self.couplings is None:
            return [(self.body, self.nodes)]
        return [(number, np.asarray(of.indices)) for number, of in zip(self.sides, self.couplings, strict=True)]

    @property
    def sides(self) -> tuple[int, int]:
        """The body and its partner."""
        return self.body, self.other

    def add_forces(self, forces: FloatArray, of_bodies: Sequence[FloatArray]) -> None:
        """Add the forces (n, 2) of the contact nodes to those of the nodes of each elastic body (n_nodes, 2)."""
        if self.couplings is None:
            np.add.at(of_bodies[self.body], self.nodes, forces)
            return
        on_body, on_other = self.couplings
        of_bodies[self.body][:] += on_body.T @ forces
        of_bodies[self.other][:] -= on_other.T @ forces

    def is_coupled_like(self, other: ContactInterface) -> bool:
        """Whether its nodes take part in both sides as they do in another step of the same load history."""
        if self.couplings is not None:
            return self.couplings is other.couplings
        columns = ((self.nodes, other.nodes), (self.weights, other.weights))
        is_alike = self.name == other.name and all(np.array_equal(one, two) for one, two in columns)
        return is_alike and np.allclose(self.frame, other.frame, rtol=0.0, atol=_SAME_DIRECTION)


def may_overlap(scene: Scene, bodies: Sequence[BodyScene]) -> bool:
    """Whether there are other bodies, or obstacles of finite size, that a body may overlap beside its contacts."""
    is_finite = any(not isinstance(obstacle, RigidHalfPlane) for body in bodies for obstacle in body.obstacles.values())
    return len(bodies) > 1 or bool(scene.rigid) or is_finite


def check_overlap(pair: ContactPair, overlap: float, deepest: FloatArray, size: float) -> None:
    """Check that bodies overlap, at the point `deepest`, by no more than the interference of their contact.

    Raises
    ------
    OverlapError
    """
    if overlap > pair.interference + OVERLAP_TOLERANCE * size:
        raise OverlapError(
            f"contact {pair.name!r}: the bodies overlap by {overlap:.4g} at {format_point(deepest, size, digits=6)}, "
            f"and its interference is {pair.interference:g}: move them apart, give coordinates with more digits, or "
            "list the contact with an interference"
        )


def candidates_of(scene: Scene, bodies: Sequence[PlacedBody]) -> list[ContactData]:
    """Return the nodes of each body that may touch an obstacle or a rigid body, held by supports or not."""
    facing: dict[str, list[FacingPart]] = {body.name: [] for body in bodies}
    obstacles = {each.name: each.obstacle for each in scene.rigid}
    for pair in scene.contacts:
        if pair.rigid_body is not None:
            ((name, part),) = pair.elastic_parts
            is_frictionless = scene.law_of(pair).is_frictionless
            facing[name].append(FacingPart(pair.name, part, obstacles[pair.rigid_body], is_frictionless))
    return [find_contact(body.scene, body.mesh, body.space_in_place, facing[body.name]) for body in bodies]


def obstacle_rows(
    scene: Scene,
    bodies: Sequence[PlacedBody],
    candidates: Sequence[ContactData],
    conditions: Sequence[NodalConditions],
) -> Iterator[ContactInterface]:
    """Yield the contacts with fixed obstacles and with rigid bodies.

    Notes
    -----
    A rigid body is measured at its position before it moves. Its point that a node may touch lies at the gap along the
    direction of contact: this point, not the node, is what friction drags along and what the moment of the contact is
    taken at.
    """
    rigid = {body.name: number for number, body in enumerate(scene.rigid)}
    pairs = {pair.name: pair for pair in scene.contacts if pair.rigid_body is not None}
    shared = {side for pair in scene.elastic_contacts for side in pair.elastic_parts}
    for number, (body, found) in enumerate(zip(bodies, candidates, strict=True)):
        fixed = conditions[number].is_fixed
        can_touch = approaches(found.nodes.nodes, found.nodes.directions, conditions[number])
        for name in dict.fromkeys(found.parts):
            rows = np.equal(found.parts, name) & can_touch
            if name in pairs and (body.name, _part(pairs[name])) in shared:
                rows &= np.isfinite(found.gap)  # nodes that face away belong to the other body
            nodes, gap, points = found.nodes.take(rows), found.gap[rows], found.points[rows]
            if not nodes.nodes.size:
                continue
            motions: FloatArray | None = None
            title, part, law, other = name_at_obstacle(body.name, name), name, body.scene.laws.get(name, scene.law), -1
            if name in pairs:
                pair, deepest = pairs[name], int(np.argmin(gap))
                check_overlap(pair, -float(gap[deepest]), points[deepest], body.mesh.diameter)
                touched = points + np.where(np.isfinite(gap), gap, 0.0)[:, None] * nodes.directions
                k = rigid[str(pair.rigid_body)]
                title, part, law, other = name, _part(pair), scene.law_of(pair), len(bodies) + k
                gap, motions = gap + pair.gap_at(points), scene.rigid[k].motions_at(touched)
            is_held = np.asarray(fixed[nodes.nodes].any(axis=1))
            faces_away = np.isinf(gap) & np.any(law.acts_across_gap)
            moves = motions is not None and bool(scene.rigid[other - len(bodies)].is_load_controlled.any())
            yield ContactInterface(
                name=title,
                law=law,
                part=part,
                body=number,
                other=other,
                nodes=nodes.nodes,
                points=points,
                arc_length=found.arc_length[rows],
                frame=nodes.frame,
                weights=nodes.weights * body.mesh.diameter,
                gap=gap,
                couplings=None,
                motions=motions,
                elements=body.mesh.part(part),
                other_elements=np.zeros(0, np.intp),
                tangent_follows=nodes.is_shared | is_held,
                is_on_line=np.zeros(nodes.nodes.size, bool),
                is_frictionless=faces_away | is_held if moves else faces_away,
            )


def retained_for(
    bodies: Sequence[PlacedBody], conditions: Sequence[NodalConditions], rows: Sequence[ContactInterface]
) -> tuple[NodalConditions, ...]:
    """Retain all nodes that a contact row involves, alike in all bodies that share a mesh."""
    touched = [np.zeros(body.space.n_dofs // 2, bool) for body in bodies]
    for one in rows:
        for number, nodes in one.touched_nodes:
            touched[number][nodes] = True
    for group in groups(bodies):
        union = np.any([touched[number] for number in group], axis=0)
        for number in group.tolist():
            touched[number] = union
    pairs = zip(conditions, touched, strict=True)
    return tuple(replace(of_body, is_retained=nodes[:, None] & ~of_body.is_fixed) for of_body, nodes in pairs)


def law_of_rows(contacts: Sequence[ContactInterface]) -> FrictionLaw:
    """Return the friction law of the nodes of all contacts, in physical units.

    Raises
    ------
    LawError
        If a coefficient is not finite or negative somewhere; the message names the contact.
    """
    laws: dict[object, tuple[FrictionLaw, list[IntArray]]] = {}
    first = 0
    for rows in contacts:
        numbers = first + np.arange(rows.n_contact)
        first += rows.n_contact
        for law, chosen in ((rows.law, ~rows.is_frictionless), (Frictionless(), rows.is_frictionless)):
            if not chosen.any():
                continue
            is_uniform = isinstance(law, LawOfCoefficients) and law.is_uniform
            try:
                evaluated = law if is_uniform else law.at(rows.points)
                if isinstance(evaluated, LawOfCoefficients):
                    evaluated = evaluated.with_lists(itemgetter(chosen))
                elif not chosen.all():
                    evaluated = law.at(rows.points[chosen])
            except ValueError as error:
                kind = "part" if rows.other < 0 else "contact"
                raise LawError(f"{kind} {rows.name!r}: friction law: {error}") from error
            laws.setdefault(law if is_uniform else first, (evaluated, []))[1].append(numbers[chosen])
    if len(laws) < 2:
        return next((law for law, _ in laws.values()), Frictionless())
    from bemkit.contact.further_laws import PiecewiseLaw

    return PiecewiseLaw(*zip(*((law, np.concatenate(nodes)) for law, nodes in laws.values()), strict=True))


def _part(pair: ContactPair) -> str:
    return pair.elastic_parts[0][1]
