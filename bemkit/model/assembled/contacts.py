"""The contacts of elastic bodies, node by node: among them by mortar integrals, with rigid bodies and obstacles."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.condensation.nodes import nodes_on
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.mortar.congruent import CongruentCouplings, PlacedSide
from bemkit.contact.mortar.facing import find_facing, is_non_mortar
from bemkit.contact.mortar.sides import ContactSide
from bemkit.errors import InputError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.reflection import antisymmetric_dofs
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry import Symmetry
from bemkit.model.assembled.placed import PlacedBody
from bemkit.model.contact_data import FacingPart, find_contact
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.assembly import Assembly, ContactPair
from bemkit.scene.symmetry import check_law_symmetry

OVERLAP_TOLERANCE = 1e-6
"""Share of the size of the smaller body by which shapes may overlap without anybody meaning it: round-off of curves."""
HELD_COSINE = 1e-3
"""Cosine of the angle between the free direction of a supported node and the direction of contact below which it does
not approach."""

_FACES_LINE = 0.5
"""Component of a normal towards a symmetry line from which on an element faces it."""
_DIGITS = 9
"""Decimals of lengths of contacts relative to the longest: round-off shall not decide which of two is longer."""


class OverlapError(InputError):
    """Bodies that overlap by more than an interference that was given."""


@dataclass(frozen=True, eq=False)
class ContactRows:
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
    on_body : sparse (n, n_nodes) array
        The relative displacement of row i is ``frame[i] @ (on_body[i] @ u - on_other[i] @ u_other)``.
    on_other : sparse (n, n_nodes) array, (n, 2, 3) array or None
        Of a rigid body how its motions displace what the nodes may touch.
    elements, other_elements : int arrays
        Of both sides; none of a rigid obstacle.
    tangent_follows : (n,) bool array
        Where a support, or a second obstacle in a corner, gives the tangential displacement.
    is_on_line : (n,) bool array
        Where the node lies on a symmetry line across its tangent: neither slips nor carries friction.
    is_frictionless : (n,) bool array
        Where a support holds the node in one direction and the partner moves: the tangent follows from both, and a
        friction of its own would repeat what other nodes say.
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
    on_body: sparse.csr_array
    on_other: sparse.csr_array | FloatArray | None
    elements: IntArray
    other_elements: IntArray
    tangent_follows: BoolArray
    is_on_line: BoolArray
    is_frictionless: BoolArray

    @property
    def n_contact(self) -> int:
        """Number of nodes."""
        return self.nodes.size

    def is_coupled_like(self, other: ContactRows) -> bool:
        """Whether its nodes take part in both sides as they do in another step of the same load history."""
        if isinstance(self.on_other, sparse.csr_array):
            return self.on_body is other.on_body and self.on_other is other.on_other
        columns = ((self.nodes, other.nodes), (self.weights, other.weights))
        return self.name == other.name and all(np.array_equal(one, two) for one, two in columns)


def listed_contacts(assembly: Assembly, bodies: Sequence[PlacedBody]) -> tuple[ContactPair, ...]:
    """Return all contacts between bodies: those that are listed, and those of bodies found touching."""
    if assembly.touching is None:
        return assembly.contacts
    sides, names, owners = [], [], []
    for number, body in enumerate(bodies):
        for part in assembly.contact_parts(body.body):
            elements = body.mesh.part(part)
            if elements.size:  # none beyond a symmetry line
                sides.append(ContactSide(body.space, elements))
                names.append(f"{body.name}.{part}")
                owners.append(number)
    if assembly.symmetry is not None:
        _check_images(sides, names, assembly.symmetry, assembly.touching.within)
    known = {frozenset(pair.sides) for pair in assembly.contacts}
    found = []
    for first, second in find_facing(sides, assembly.touching.within, owners=owners):
        pair = ContactPair(
            (names[first], names[second]),
            assembly.touching.law,
            multipliers_on=names[first],
            reach=assembly.touching.reach,
        )
        if frozenset(pair.sides) not in known:
            found.append(pair)
    return (*assembly.contacts, *found)


def _check_images(sides: Sequence[ContactSide], names: Sequence[str], symmetry: Symmetry, within: float) -> None:
    """Refuse sides (n,) of which a part faces its own image at a symmetry line."""
    places = np.array([np.inf if place is None else place for place in (symmetry.x, symmetry.y)])
    for side, name in zip(sides, names, strict=True):
        normals = side.mesh.normals_at(side.elements, np.zeros(1))[:, 0]
        is_near = places - side.mesh.centres[side.elements] <= 0.5 * within
        if np.any(is_near & (normals > _FACES_LINE)):
            raise InputError(
                f"side {name!r} faces its own image at the symmetry line {symmetry}, which touching does not find: "
                "give it an obstacle there, such as a half-plane, or list the contacts"
            )


def body_rows(
    assembly: Assembly,
    bodies: Sequence[PlacedBody],
    conditions: Sequence[NodalConditions],
    with_obstacles: Sequence[ContactRows],
) -> Iterator[ContactRows]:
    """Yield the contacts between elastic bodies; those with obstacles and rigid bodies are known.

    Notes
    -----
    Where two contact sides of one body meet in a corner, the node there carries a multiplier of only one contact: of
    that with a rigid obstacle, else of the longer one, the first of equally long ones. Three bodies that meet in a
    point would otherwise be tied in a circle, and their tractions there would not be unique. The other contact
    hands its share to its neighbours, as at crosspoints of mortar methods [Wohlmuth2000].
    """
    numbers = {body.name: number for number, body in enumerate(bodies)}
    pairs = assembly.elastic_contacts
    ordered = [_ordered(pair, bodies, numbers) for pair in pairs]
    lengths = [min(float(side.space.mesh.lengths[side.elements].sum()) for _, _, side in one) for one in ordered]
    taken: list[dict[int, str]] = [{} for _ in bodies]  # node -> the part that has its multiplier
    for rows in with_obstacles:
        taken[rows.body].update(dict.fromkeys(rows.nodes.tolist(), rows.part))
    found: dict[int, ContactRows] = {}
    couplings = CongruentCouplings()
    for k in np.argsort(-np.round(np.array(lengths) / max(lengths, default=1.0), _DIGITS), kind="stable").tolist():
        (first, part, side), (second, _, other_side) = ordered[k]
        own_nodes, normals = nodes_on(side.space, side.elements)
        held = ~approaches(own_nodes, normals, conditions[first].frame, conditions[first].is_fixed)
        crossed = np.array([taken[first].get(node, part) != part for node in own_nodes.tolist()])
        without = own_nodes[held | crossed]
        try:
            reach = reach_of(pairs[k], bodies[first].mesh, bodies[second].mesh)
            coupling = couplings.couple(
                PlacedSide(side, bodies[first].body.placement),
                PlacedSide(other_side, bodies[second].body.placement),
                without,
                reach,
            )
        except ValueError as error:
            raise type(error)(f"contact {pairs[k].name!r}: {error}") from error
        if assembly.symmetry is not None:
            law, modulus = assembly.law_of(pairs[k]), bodies[first].material.plane_modulus
            check_law_symmetry(pairs[k].name, law, coupling.points, assembly.symmetry, modulus)
        size = min(bodies[number].mesh.diameter for number in (first, second))
        check_overlap(pairs[k], coupling.overlap, coupling.deepest, size)
        for number, name, one in ordered[k]:
            for node in nodes_on(one.space, one.elements)[0].tolist():
                taken[number].setdefault(node, name)
        on_line = nodes_on_lines(side.space)[coupling.nodes]
        is_held = np.asarray(conditions[first].is_fixed[coupling.nodes].any(axis=1)) & ~on_line
        found[k] = ContactRows(
            pairs[k].name,
            assembly.law_of(pairs[k]),
            part,
            first,
            second,
            coupling.nodes,
            coupling.points,
            coupling.arc_length,
            coupling.frame,
            coupling.weights,
            coupling.gap + pairs[k].gap,
            sparse.csr_array(coupling.on_non_mortar),
            sparse.csr_array(coupling.on_mortar),
            side.elements,
            other_side.elements,
            on_line | is_held,
            on_line,
            is_held,
        )
    yield from (found[k] for k in range(len(pairs)))


def nodes_on_lines(space: BoundarySpace) -> BoolArray:
    """Return (n_nodes,) bool: nodes of a space that lie on a symmetry line of its mesh."""
    if space.mesh.symmetry is None:
        return np.zeros(space.n_dofs // 2, bool)
    return np.asarray(antisymmetric_dofs(space).reshape(-1, 2).any(axis=1))


_NamedSide = tuple[int, str, ContactSide]


def _ordered(pair: ContactPair, bodies: Sequence[PlacedBody], numbers: dict[str, int]) -> tuple[_NamedSide, _NamedSide]:
    """Return the sides of a contact, the one with the multipliers first."""
    sides = []
    for body, part in pair.elastic_parts:
        number = numbers[body]
        sides.append((number, part, ContactSide(bodies[number].space, bodies[number].mesh.part(part))))
    one, two = sides
    is_first = is_non_mortar(one[2], two[2]) if pair.multipliers_on is None else pair.multipliers_on == pair.sides[0]
    return (one, two) if is_first else (two, one)


def approaches(nodes: IntArray, directions: FloatArray, frame: FloatArray, is_fixed: BoolArray) -> BoolArray:
    """Return (n,) bool: nodes that their supports let move along directions (n, 2)."""
    free = np.where(is_fixed[nodes][:, :, None], 0.0, frame[nodes])
    return np.asarray(np.abs(np.einsum("nkc,nc->nk", free, directions)).max(axis=1) > HELD_COSINE)


def reach_of(pair: ContactPair, one: BoundaryMesh, two: BoundaryMesh) -> float:
    """Return the largest distance [m] of points of two bodies that may come to touch."""
    return 0.5 * min(one.diameter, two.diameter) if pair.reach is None else pair.reach


def check_overlap(pair: ContactPair, overlap: float, deepest: FloatArray, size: float) -> None:
    """Refuse bodies that overlap, at the point `deepest`, by more than the interference of their contact.

    Raises
    ------
    OverlapError
    """
    if overlap > pair.interference + OVERLAP_TOLERANCE * size:
        x, y = deepest
        raise OverlapError(
            f"contact {pair.name!r}: the bodies overlap by {overlap:.4g} at ({x:.6g}, {y:.6g}), and an "
            f"interference of {pair.interference:g} is given: move them apart, or give the interference that is meant"
        )


def obstacle_rows(
    assembly: Assembly, bodies: Sequence[PlacedBody], conditions: Sequence[NodalConditions]
) -> Iterator[ContactRows]:
    """Yield the contacts with fixed obstacles and with rigid bodies.

    Notes
    -----
    A rigid body is measured at its position before it moves. Its point that a node may touch lies at the gap along the
    direction of contact: this point, not the node, is what friction drags along and what the moment of the contact is
    taken at.
    """
    rigid = {body.name: number for number, body in enumerate(assembly.rigid)}
    pairs = {pair.name: pair for pair in assembly.contacts if pair.rigid_body is not None}
    for number, body in enumerate(bodies):
        own = [pair for pair in pairs.values() if pair.elastic_parts[0][0] == body.name]
        if not own and not body.scene.contact_parts:
            continue
        facing = [_facing(pair, assembly) for pair in own]
        found = find_contact(body.scene, body.mesh, body.space_in_place, facing)
        frames, fixed = conditions[number].frame, conditions[number].is_fixed
        can_touch = approaches(found.nodes.nodes, found.nodes.directions, frames, fixed)
        for name in dict.fromkeys(found.parts):
            rows = (np.array(found.parts) == name) & can_touch
            nodes, gap, points = found.nodes.take(rows), found.gap[rows], found.points[rows]
            if not nodes.nodes.size:
                continue
            where = (np.arange(nodes.nodes.size), nodes.nodes)
            shape = (nodes.nodes.size, body.space.n_dofs // 2)
            if name in pairs:
                pair, deepest = pairs[name], int(np.argmin(gap))
                check_overlap(pair, -float(gap[deepest]), points[deepest], body.mesh.diameter)
                touched = points + np.where(np.isfinite(gap), gap, 0.0)[:, None] * nodes.directions
                k = rigid[str(pair.rigid_body)]
                title, part, law, other = name, _part(pair), assembly.law_of(pair), len(bodies) + k
                gap, on_other = gap + pair.gap, assembly.rigid[k].motions_at(touched)
            else:
                title, part, law, other, on_other = f"{body.name}.{name}", name, body.scene.laws[name], -1, None
            is_held = np.asarray(fixed[nodes.nodes].any(axis=1))
            moves = on_other is not None and bool(assembly.rigid[k].is_driven.any())
            yield ContactRows(
                title,
                law,
                part,
                number,
                other,
                nodes.nodes,
                points,
                found.arc_length[rows],
                nodes.frame,
                nodes.weights * body.mesh.diameter,
                gap,
                sparse.csr_array((np.ones(nodes.nodes.size), where), shape),
                on_other,
                body.mesh.part(part),
                np.zeros(0, np.intp),
                nodes.is_shared | is_held,
                np.zeros(nodes.nodes.size, bool),
                is_held if moves else np.zeros_like(is_held),
            )


def _facing(pair: ContactPair, assembly: Assembly) -> FacingPart:
    obstacle = assembly.rigid_body_of(pair).obstacle
    return FacingPart(pair.name, _part(pair), obstacle, assembly.law_of(pair).is_frictionless)


def _part(pair: ContactPair) -> str:
    return pair.elastic_parts[0][1]
