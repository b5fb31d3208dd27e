"""The contact table against the fields of the bodies: gaps, displacements, tractions, reported forces, rigid bodies."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.polynomial import legendre

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.geometry.quadrature import gauss_lobatto
from bemkit.geometry.vectors import norms
from bemkit.results.solution import Solution
from bemkit.testing.independent_check.bodies import MeasuredBody
from bemkit.testing.independent_check.contacts import MeasuredContact, gap_of
from bemkit.testing.independent_check.scales import EPSILON, beyond, largest
from bemkit.testing.independent_check.sides import Side


def gap_mismatch(contact: MeasuredContact) -> float:
    """Return the largest difference [-] of gaps from distances measured again, of obstacles and of flat sides."""
    table, scales, distance = contact.table, contact.owner.body.scales, contact.distance
    if contact.flat is not None:
        distance = contact.flat.distance + gap_of(contact.pair, contact.table.points)
    elif contact.facing is not None and not contact.is_shared:
        if np.any((np.isfinite(table.gap) != np.isfinite(distance)) & ~contact.is_grazing):
            return float("inf")
    known = np.isfinite(table.gap) & np.isfinite(distance)
    coordinates = max(scales.coordinates, 64.0 * EPSILON * largest(np.abs(contact.table.points)))
    return beyond(np.abs(table.gap[known] - distance[known]), coordinates, contact.length)


def displacement_mismatch(contact: MeasuredContact) -> float:
    """Return the largest difference [-] of the displacements in the table from those of the boundary.

    At obstacles those at the same points, between flat sides means. Clearances are gaps less displacements.
    """
    table, scales = contact.table, contact.owner.body.scales
    known, round_off = np.isfinite(table.gap), scales.coordinates + contact.turned
    rows = contact.stated_displacement
    differences = [table.clearance[known] - (table.gap - table.u_n)[known], contact.offset]
    flat = contact.flat
    if contact.facing is not None:
        # an obstacle that turns moves at the point that a node may touch, which others lack
        differences.append((rows - contact.displacement)[known | (contact.pair is None)])
    elif flat is not None and abs(table.weight.sum() - flat.length) <= 1e-9 * flat.length:
        # slivers beside nodes that others hold carry no multiplier
        differences.append((table.weight @ rows - flat.means) / flat.length)
    return max(beyond(np.abs(each), round_off, contact.length) for each in differences)


def resultant_mismatch(solution: Solution, contacts: Iterable[MeasuredContact]) -> float:
    """Return the largest difference [-] of the reported forces of contacts from sums over the table.

    At fixed obstacles the tractions go on to nodes that supports hold: see `_at_held_nodes`.
    """
    worst, measured = [0.0], {contact.name: contact for contact in contacts}
    for stated in solution.contacts:
        contact, depth = measured[stated.name], solution.scene.depth
        if not contact.table.n_contact:
            continue
        normal, tangential = depth * (contact.forces_along.sum(axis=0) + _at_held_nodes(contact, measured.values()))
        size = depth * float(np.abs(contact.forces_along).sum() + contact.stress * contact.table.weight.min())
        worst += [abs(stated.force_normal + normal) / size, abs(stated.force_tangential - tangential) / size]
    return float(np.max(worst))


def _at_held_nodes(contact: MeasuredContact, contacts: Iterable[MeasuredContact]) -> FloatArray:
    """Return the force (2,) [N/m] of a fixed obstacle at nodes without contact that supports hold, along its frame.

    Beside corners between two contact parts tractions have the size that elements state; see `nodal_mismatch`.
    """
    body, boundary, total = contact.owner.body, contact.owner.body.boundary, np.zeros(2)
    if contact.facing is None or contact.pair is not None:
        return total
    touching = np.concatenate([each.nodes for each in contacts if each.owner.body is body and each.facing is not None])
    held = np.setdiff1d(_held_both_ways(body), touching)
    elements = body.solved.mesh.part(contact.owner.part)
    nodes, traction = boundary.nodes[elements], np.zeros_like(body.solved.boundary.points)
    traction[contact.nodes] = contact.forces / contact.table.weight[:, None]
    is_known, beside_corners = np.isin(nodes, contact.nodes), _beside_corners(body)
    for k in np.flatnonzero(np.isin(nodes, held).any(axis=1) & is_known.any(axis=1)).tolist():
        own = slice(k, k + 1)
        values = _continued(traction[nodes[own]], is_known[own], nodes[own])[0]
        lengths = boundary.basis[elements[k]] @ boundary.shares[elements[k]]
        if beside_corners[elements[k]] and (mean := lengths @ values / lengths.sum()).any():
            values = values * (body.solved.boundary.traction[elements[k]] @ mean) / (mean @ mean)
        force = (np.isin(nodes[k], held) * lengths) @ values
        # along the frame of the nearest contact node of the element; others may lie across a thin body
        beside = np.flatnonzero(np.isin(contact.nodes, nodes[k]))
        point = body.solved.boundary.points[nodes[k]][np.isin(nodes[k], held)][0]
        total += contact.frame[beside[int(np.argmin(norms(contact.table.points[beside] - point)))]] @ force
    return total


def _held_both_ways(body: MeasuredBody) -> IntArray:
    """Return the nodes that supports hold in two directions."""
    products = np.zeros((len(body.solved.boundary.points), 2, 2))
    for elements, directions, _ in body.boundary.held:
        np.add.at(products, body.boundary.nodes[elements], np.einsum("enc,end->encd", directions, directions))
    return np.flatnonzero(np.linalg.det(products) > EPSILON)


def nodal_mismatch(measured: MeasuredBody, contacts: Iterable[MeasuredContact]) -> float:
    """Return the largest difference [-] of mean tractions of elements at obstacles from those that nodes interpolate.

    To nodes that a support holds, which have no force of contact, the polynomials of elements are continued.

    A node at a corner between two contact parts belongs to one of them, with the lengths of both: its force makes other
    tractions on the elements there than the node says, and so on their neighbours, which are excluded.
    """
    body, boundary = measured.solved, measured.boundary
    at_obstacles = [each for each in contacts if each.owner.body is measured and each.facing is not None]
    nodal, owner = np.zeros_like(body.boundary.points), np.full(len(body.boundary.points), "", dtype=object)
    for contact in at_obstacles:
        np.add.at(nodal, contact.nodes, contact.forces / contact.table.weight[:, None])
        owner[contact.nodes] = contact.owner.part
    worst, beside = [0.0], _beside_corners(measured)
    for part in {contact.owner.part for contact in at_obstacles}:
        elements = body.mesh.part(part)
        owners = owner[boundary.nodes[elements]].astype(str)
        # supports hold the other nodes, and whole elements that have no node of the table
        is_own = np.isin(owners, ["", part]).all(axis=1) & (owners == part).any(axis=1)
        own = elements[is_own & ~beside[elements]]
        values = _continued(nodal[boundary.nodes[own]], owner[boundary.nodes[own]] == part, boundary.nodes[own])
        mean = np.einsum("enc,enq,eq->ec", values, boundary.basis[own], boundary.shares[own])
        mean /= boundary.lengths[own][:, None]
        stated = body.boundary.traction[own]
        # elements as short as the round-off of coordinates have lengths, and tractions, of few digits
        round_off = 64.0 * EPSILON * np.abs(body.mesh.nodes).max() / boundary.lengths[own]
        off = np.abs(mean - stated) - round_off[:, None] * np.abs(stated)
        worst.append(largest(off / measured.scales.stress))
    return float(np.max(worst))


def _continued(values: FloatArray, is_known: BoolArray, nodes: IntArray) -> FloatArray:
    """Return values (m, n_local, 2) whose unknown ones are those of the polynomial through the others.

    Zero if they were against the nearest known one: contact does not pull.
    """
    result = values.copy()
    for k in np.flatnonzero(~is_known.all(axis=1)).tolist():
        degree = np.unique(nodes[k]).size - 1  # rows of lower degrees repeat their last node
        own = np.array([*range(degree), nodes.shape[1] - 1])
        xi, known = gauss_lobatto(degree), is_known[k, own]
        fitted = legendre.legfit(xi[known], values[k, own[known]], int(known.sum()) - 1)
        for place in np.flatnonzero(~known):
            nearest = np.flatnonzero(known)[np.argmin(np.abs(np.flatnonzero(known) - place))]
            value = legendre.legval(xi[place], fitted)
            result[k, own[place]] = value if value @ values[k, own[nearest]] > 0.0 else 0.0
    return result


def _beside_corners(measured: MeasuredBody) -> BoolArray:
    """Return (n_elements,) bool: the elements at nodes of two contact parts, and those next to them."""
    mesh, nodes = measured.solved.mesh, measured.boundary.nodes
    parts = [np.unique(nodes[mesh.part(part)]) for part in set(measured.touched)]
    found, counts = np.unique(np.concatenate([np.zeros(0, np.intp), *parts]), return_counts=True)
    at_corner = np.isin(nodes, found[counts > 1]).any(axis=1)
    return np.asarray(np.isin(nodes, nodes[at_corner]).any(axis=1))


def reaction_mismatch(contacts: Sequence[MeasuredContact]) -> float:
    """Return the largest difference [-] of the forces on the elements of a side from those of its contacts.

    Where elastic bodies touch: at each obstacle tractions are compared; see `nodal_mismatch`.
    """
    forces: dict[tuple[str, str], tuple[Side, float, np.ndarray]] = {}
    between = [side for contact in contacts if contact.partner is not None for side, _ in contact.sides]
    touching = {(side.body.solved.name, side.part) for side in between}
    for contact in contacts:
        for side, sign in contact.sides:
            key = side.body.solved.name, side.part
            _, size, force = forces.get(key, (side, 0.0, np.zeros(2)))
            size += float(np.abs(contact.forces).sum())
            forces[key] = side, size, force + sign * contact.forces.sum(axis=0)
    worst = [0.0]
    for side, size, force in (forces[key] for key in touching):
        boundary, stress = side.body.boundary, side.body.scales.stress
        on_elements = boundary.forces[side.elements]
        size += float(np.abs(on_elements).sum()) + stress * float(boundary.lengths.min())
        if not np.isin(boundary.nodes[side.elements], side.body.supported_nodes).any():
            worst.append(float(np.abs(on_elements.sum(axis=(0, 1)) - force).max()) / size)
    return float(np.max(worst))


def rigid_mismatch(solution: Solution, bodies: Iterable[MeasuredBody], contacts: Iterable[MeasuredContact]) -> float:
    """Return the largest difference [-] of the motions and loads of rigid bodies from the prescribed ones.

    The load on each balances its contacts, at the points that the nodes may touch.
    """
    worst, diameter = [0.0], max(body.solved.mesh.diameter for body in bodies)
    for rigid in solution.scene.rigid:
        total, size, found = np.zeros(3), 0.0, solution.rigid[rigid.name]
        for contact in contacts:
            known = np.isfinite(contact.table.gap)
            if contact.pair is None or contact.pair.rigid_body != rigid.name or not known.any():
                continue
            arm, force = (contact.touched - rigid.centre)[known], contact.forces[known]
            total += [*force.sum(axis=0), float(np.sum(arm[:, 0] * force[:, 1] - arm[:, 1] * force[:, 0]))]
            size += float(np.abs(force).sum())
            size += contact.owner.body.scales.stress * float(contact.table.weight[known].min())
        reach = np.array([1.0, 1.0, diameter])
        reaction = np.array([found.force_x, found.force_y, found.moment]) / solution.scene.depth
        driven = np.where(rigid.is_load_controlled, reaction - solution.scene.load_on(rigid), 0.0)
        worst += [float(np.abs(each / reach).max()) / (size or 1.0) for each in (reaction - total, driven)]
        motion = np.array([found.x, found.y, found.turn])
        worst.append(float(np.abs(np.where(rigid.is_load_controlled, 0.0, motion - rigid.motion)).max()))
    return float(np.max(worst))
