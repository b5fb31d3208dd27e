"""The contacts between elastic bodies, node by node, coupled by mortar integrals."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import sparse

from bemkit.arrays import BoolArray
from bemkit.contact.contact_nodes import approaches, nodes_on
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.mortar.congruent import CongruentCouplings, PlacedSide
from bemkit.contact.mortar.facing import find_facing, is_non_mortar
from bemkit.contact.mortar.sides import ContactSide
from bemkit.errors import InputError
from bemkit.formulas import choices
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.geometry.symmetry.lines import Symmetry
from bemkit.model.contacts import ContactInterface, check_overlap
from bemkit.model.placed import PlacedBody
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.contacts import ContactPair
from bemkit.scene.scene import Scene
from bemkit.scene.symmetry import check_law_symmetry

_FACES_LINE = 0.5
"""Least component of a normal towards a symmetry line of an element that faces it."""
_DIGITS = 9
"""Decimals of lengths of contacts relative to the longest: round-off shall not decide which of two is longer."""


def touching_pairs(scene: Scene, bodies: Sequence[PlacedBody]) -> tuple[tuple[ContactPair, bool], ...]:
    """Return the contacts of free sides that face each other, besides those that are listed; see `Touching`.

    Each comes with whether the meshes resolve it. The first side of each has the multipliers.

    Raises
    ------
    InputError
        If `Touching.names` has a side that is not free, or a symmetry line shows a side its own image.
    """
    touching = scene.touching
    if touching is None:
        return ()
    sides, names, owners = [], [], []
    for number, body in enumerate(bodies):
        for part in scene.touching_parts(body.body):
            elements = body.mesh.part(part)
            if elements.size:  # none beyond a symmetry line
                sides.append(ContactSide(body.space, elements))
                names.append(f"{body.name}.{part}")
                owners.append(number)
    if scene.symmetry is not None:
        _check_images(sides, names, scene.symmetry, touching.within)
    known, given = {frozenset(pair.sides) for pair in scene.contacts}, _given_sides(touching.names, names)
    law = scene.law_of(touching)
    facing = find_facing(sides, touching.within, owners=owners, has_friction=not law.is_frictionless)
    ordered = [((names[pair.non_mortar], names[pair.mortar]), pair.is_resolved) for pair in facing]
    ordered = [(both[::-1] if both[::-1] in given else both, is_resolved) for both, is_resolved in ordered]
    return tuple(
        (ContactPair(both, multipliers_on=both[0]), is_resolved)
        for both, is_resolved in ordered
        if frozenset(both) not in known
    )


def _given_sides(given: Sequence[str], names: Sequence[str]) -> set[tuple[str, ...]]:
    """Return the pairs of sides in the names of contacts, all of which must be free sides."""
    pairs = {name: tuple(name.split(" / ")) for name in given}
    for name, sides in pairs.items():
        if len(sides) != 2 or not set(sides) <= set(names):
            raise InputError(
                f"touching.names has {name!r}: give 'side / side' of the free sides {choices(sides[0], list(names))}"
            )
    return set(pairs.values())


def _check_images(sides: Sequence[ContactSide], names: Sequence[str], symmetry: Symmetry, within: float) -> None:
    """Refuse sides (n,) that face their own image at a symmetry line."""
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
    scene: Scene,
    bodies: Sequence[PlacedBody],
    conditions: Sequence[NodalConditions],
    with_obstacles: Sequence[ContactInterface],
) -> Iterator[ContactInterface]:
    """Yield the contacts between elastic bodies; those with obstacles and rigid bodies are known.

    Notes
    -----
    Where two contact sides of one body meet in a corner, the node there carries a multiplier of only one contact: of
    that with a rigid obstacle, else of the longer one, the first of equally long ones. Three bodies that meet in a
    point would otherwise be tied in a circle, and their tractions there would not be unique. The neighbours receive the
    share of the other contact, as at crosspoints of mortar methods [Wohlmuth2000].
    """
    numbers = {body.name: number for number, body in enumerate(bodies)}
    pairs = scene.elastic_contacts
    laws = [scene.law_of(pair) for pair in pairs]
    ordered = [_ordered(pair, law, bodies, numbers) for pair, law in zip(pairs, laws, strict=True)]
    lengths = [min(float(side.space.mesh.lengths[side.elements].sum()) for _, _, side in one) for one in ordered]
    taken: list[dict[int, str]] = [{} for _ in bodies]  # node -> the part that has its multiplier
    for rows in with_obstacles:
        taken[rows.body].update(dict.fromkeys(rows.nodes.tolist(), rows.part))
    found: dict[int, ContactInterface] = {}
    couplings = CongruentCouplings()
    for k in np.argsort(-np.round(np.array(lengths) / max(lengths, default=1.0), _DIGITS), kind="stable").tolist():
        (first, part, side), (second, _, other_side) = ordered[k]
        own_nodes, normals = nodes_on(side.space, side.elements)
        held = ~approaches(own_nodes, normals, conditions[first])
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
        if scene.symmetry is not None:
            modulus = bodies[first].material.plane_modulus
            check_law_symmetry(pairs[k].name, laws[k], coupling.points, scene.symmetry, modulus)
        size = min(bodies[number].mesh.diameter for number in (first, second))
        check_overlap(pairs[k], coupling.overlap, coupling.deepest, size)
        for number, name, one in ordered[k]:
            for node in nodes_on(one.space, one.elements)[0].tolist():
                taken[number].setdefault(node, name)
        on_line = nodes_on_lines(side.space)[coupling.nodes]
        is_held = np.asarray(conditions[first].is_fixed[coupling.nodes].any(axis=1)) & ~on_line
        found[k] = ContactInterface(
            name=pairs[k].name,
            law=laws[k],
            part=part,
            body=first,
            other=second,
            nodes=coupling.nodes,
            points=coupling.points,
            arc_length=coupling.arc_length,
            frame=coupling.frame,
            weights=coupling.weights,
            gap=coupling.gap + pairs[k].gap_at(coupling.points),
            couplings=(sparse.csr_array(coupling.on_non_mortar), sparse.csr_array(coupling.on_mortar)),
            motions=None,
            elements=side.elements,
            other_elements=other_side.elements,
            tangent_follows=on_line | is_held,
            is_on_line=on_line,
            is_frictionless=is_held,
        )
    yield from (found[k] for k in range(len(pairs)))


def nodes_on_lines(space: BoundarySpace) -> BoolArray:
    """Return (n_nodes,) bool: nodes of a space that lie on a symmetry line of its mesh."""
    if space.mesh.symmetry is None:
        return np.zeros(space.n_dofs // 2, bool)
    return np.asarray(antisymmetric_dofs(space).reshape(-1, 2).any(axis=1))


_NamedSide = tuple[int, str, ContactSide]


def _ordered(
    pair: ContactPair, law: FrictionLaw, bodies: Sequence[PlacedBody], numbers: dict[str, int]
) -> tuple[_NamedSide, _NamedSide]:
    """Return the sides of a contact, the one with the multipliers first."""
    sides = []
    for body, part in pair.elastic_parts:
        number = numbers[body]
        elements = bodies[number].mesh.part(part)
        if not elements.size:
            raise InputError(
                f"contact {pair.name!r}: the side '{body}.{part}' lies beyond the symmetry line "
                f"({bodies[number].mesh.symmetry}), where images replace all contacts: remove the contact, or name the "
                "image of the side"
            )
        sides.append((number, part, ContactSide(bodies[number].space, elements)))
    one, two = sides
    if pair.multipliers_on is None:
        is_first = is_non_mortar(one[2], two[2], has_friction=not law.is_frictionless)
    else:
        is_first = pair.multipliers_on == pair.sides[0]
    return (one, two) if is_first else (two, one)


def reach_of(pair: ContactPair, one: BoundaryMesh, two: BoundaryMesh) -> float:
    """Return the largest distance [m] of points of two bodies that may come to touch."""
    return 0.5 * min(one.diameter, two.diameter) if pair.reach is None else pair.reach
