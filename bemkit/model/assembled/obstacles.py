"""The contacts of elastic bodies with rigid ones, node by node: with fixed obstacles, and with those that move."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
from scipy import sparse

from bemkit.model.assembled.contacts import ContactRows, approaches, check_overlap
from bemkit.model.assembled.placed import PlacedBody
from bemkit.model.contact_data import FacingPart, find_contact
from bemkit.operators.steklov_poincare.nodal_conditions import NodalConditions
from bemkit.scene.assembly import Assembly, ContactPair


def obstacle_rows(
    assembly: Assembly, bodies: Sequence[PlacedBody], conditions: Sequence[NodalConditions]
) -> Iterator[ContactRows]:
    """Yield the contacts with fixed obstacles and with rigid bodies.

    Notes
    -----
    A rigid body is measured where it stands before it moves. Its point that a node may touch lies at the gap along the
    direction of contact: this point, not the node, is what friction drags along and what the moment of the contact is
    taken at.
    """
    rigid = {body.name: number for number, body in enumerate(assembly.rigid)}
    pairs = {pair.name: pair for pair in assembly.contacts if pair.rigid_body is not None}
    for number, body in enumerate(bodies):
        own = [pair for pair in pairs.values() if pair.elastic_sides[0].split(".", 1)[0] == body.name]
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
                body.part_elements(part),
                np.zeros(0, np.intp),
                fixed[nodes.nodes].any(axis=1) | nodes.is_shared,
            )


def _facing(pair: ContactPair, assembly: Assembly) -> FacingPart:
    obstacle = assembly.rigid_body_of(pair).obstacle
    return FacingPart(pair.name, _part(pair), obstacle, assembly.law_of(pair).is_frictionless)


def _part(pair: ContactPair) -> str:
    return pair.elastic_sides[0].split(".", 1)[1]
