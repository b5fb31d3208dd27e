"""The conditions of contact and friction at each node, and whether the table says the same as the boundary."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.results.solution import Solution
from bemkit.solvers.active_sets import NodeStatus
from bemkit.studies.stability.independent_check.boundary import CONTACT_LIMIT, beyond, largest, scales_of
from bemkit.studies.stability.independent_check.nodes import Fields


@dataclass(frozen=True, eq=False)
class Measured:
    """Dimensionless contact quantities at each node, all (n_contact,) arrays.

    Parameters
    ----------
    pressure, shear : tractions along d and t, pressure positive
    clearance : gap less displacement
    slip : tangential displacement since the state before
    held : what shows that a node is in contact: its traction, but for friction that is given across a gap
    bound : largest shear that the law allows
    obeys_friction : whether a law governs the tangential traction; not where a support shares the node
    """

    pressure: FloatArray
    shear: FloatArray
    clearance: FloatArray
    slip: FloatArray
    held: FloatArray
    bound: FloatArray
    obeys_friction: BoolArray


def measured_contact(fields: Fields) -> Measured:
    """Return the contact quantities that the laws speak of.

    Displacements are those of the boundary field, tractions those of the table. Slip counts from the load step before,
    and from the undeformed body if there is none.
    """
    solution, before, _, nodes, scales = fields
    table = solution.contact
    law = solution.scene.law_at(table.part, np.column_stack([table.x, table.y]))
    motion = nodes.components(nodes.displacement)
    slip = motion[:, 1]
    if before is not None:
        slip = slip - nodes.components(before.boundary.displacement[nodes.nodes])[:, 1]
        turned = scales.turned + scales_of(before).turned  # after a large motion more than all there is of a small one
        slip = np.sign(slip) * np.maximum(np.abs(slip) - turned, 0.0)
    clearance = np.where(np.isfinite(table.gap), table.gap - motion[:, 0], np.inf) / scales.length
    pressure, shear = -table.sigma_n / scales.stress, table.sigma_t / scales.stress
    acts_across_gap = np.broadcast_to(np.asarray(law.acts_across_gap), pressure.shape)
    held = np.maximum(np.abs(pressure), np.where(acts_across_gap | nodes.is_supported, 0.0, np.abs(shear)))
    # A node that is held by less than it is away counts as open (its complementarity says by how much): whether
    # cohesion acts shall not depend on a traction of 1e-16.
    acts = (held > np.abs(clearance)) | acts_across_gap
    bound = np.where(acts, law.bound(np.minimum(table.sigma_n, 0.0)), 0.0) / scales.stress
    return Measured(pressure, shear, clearance, slip / scales.length, held, bound, ~nodes.is_supported)


def obstacle_mismatch(fields: Fields) -> float:
    """Return the largest difference [-] of the table's gaps from distances measured again."""
    gap, nodes, scales = fields.solution.contact.gap, fields.nodes, fields.scales
    if np.any((np.isfinite(gap) != np.isfinite(nodes.distance)) & ~nodes.is_grazing):
        return float("inf")
    known = np.isfinite(gap) & np.isfinite(nodes.distance)
    return beyond(np.abs(gap[known] - nodes.distance[known]), scales.coordinates, scales.length)


def table_mismatch(fields: Fields) -> float:
    """Return the largest difference [-] of the table's displacements from those of the boundary at the same points."""
    table, nodes, scales = fields.solution.contact, fields.nodes, fields.scales
    rows = np.column_stack([table.u_n, table.u_t])
    motion = nodes.components(nodes.displacement)
    known = np.isfinite(table.gap)
    differences = (
        np.abs(rows - motion),
        np.abs(table.clearance[known] - (table.gap - table.u_n)[known]),
        nodes.offset,
    )
    round_off = scales.coordinates + scales.turned
    return max(beyond(difference, round_off, scales.length) for difference in differences)


def traction_mismatch(fields: Fields) -> float:
    """Return the largest difference [-] of mean tractions of contact elements from those that nodes interpolate.

    Elements at a corner that share a node with another contact part are left out: the node belongs to one of them.
    """
    solution, _, boundary, nodes, scales = fields
    nodal, owner = np.zeros_like(solution.boundary.points), np.full(len(solution.boundary.points), "", dtype=object)
    nodal[nodes.nodes], owner[nodes.nodes] = nodes.traction, solution.contact.part
    worst = [0.0]
    for part in solution.scene.contact_parts:
        elements = solution.mesh.part(part.name)
        own = elements[np.isin(owner[boundary.nodes[elements]].astype(str), ["", part.name]).all(axis=1)]
        mean = np.einsum("eqc,eq->ec", boundary.interpolated(nodal)[own], boundary.shares[own])
        mean /= boundary.lengths[own][:, None]
        worst.append(largest(np.abs(mean - solution.boundary.traction[own]) / scales.stress))
    return max(worst)


def resultant_mismatch(solution: Solution) -> float:
    """Return the difference [-] of the reported forces from sums over the table."""
    table = solution.contact
    size = float(table.weight @ np.hypot(table.sigma_n, table.sigma_t)) or 1.0
    normal = abs(solution.force_normal + float(table.weight @ table.sigma_n))
    tangential = abs(solution.force_tangential - float(table.weight @ table.sigma_t))
    return max(normal, tangential) / size


def slip_opposition(measured: Measured) -> float:
    """Return the largest slip [-] that friction does not fully oppose: the smaller of slip and missing traction."""
    missing = np.abs(measured.shear + np.sign(measured.slip) * measured.bound)
    return largest(np.minimum(np.abs(measured.slip), missing)[measured.obeys_friction])


def status_mismatch(solution: Solution, measured: Measured) -> float:
    """Return the largest violation [-] of what the status of a node claims."""
    status = solution.contact.status
    direction = np.select([status == NodeStatus.SLIP_FORWARD, status == NodeStatus.SLIP_BACKWARD], [1.0, -1.0])
    slides_freely = measured.bound <= CONTACT_LIMIT
    against = np.where(slides_freely, 0.0, np.minimum(-direction * measured.slip, measured.bound))
    unopposed = np.abs(measured.shear + direction * measured.bound)
    is_open, sticks = status == NodeStatus.SEPARATED, status == NodeStatus.STICK
    friction = np.where(sticks, np.abs(measured.slip), np.where(is_open, 0.0, np.maximum(against, unopposed)))
    friction[~measured.obeys_friction] = 0.0
    return max(largest(measured.held[is_open]), largest(np.abs(measured.clearance)[~is_open]), largest(friction))
