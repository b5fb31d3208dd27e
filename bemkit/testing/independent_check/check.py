"""The independent check of one solution: the conditions of contact at each node, and all other conditions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.results.contact_table import ContactTable
from bemkit.results.solution import Solution
from bemkit.solvers.active_sets import NodeStatus
from bemkit.testing.independent_check.balance import (
    energy_mismatch,
    imbalance,
    load_mismatch,
    negative_energy,
    reciprocity_mismatch,
    support_mismatch,
)
from bemkit.testing.independent_check.boundary import CONTACT_LIMIT, EPSILON, Boundary, beyond, largest, scales_of
from bemkit.testing.independent_check.half_plane import Surface
from bemkit.testing.independent_check.nodes import Fields, hidden_overlap
from bemkit.testing.independent_check.verdict import Violations
from bemkit.testing.independent_check.views import BodyView, view_of


@dataclass(frozen=True, eq=False)
class ContactMeasurements:
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


def measured_contact(fields: Fields) -> ContactMeasurements:
    """Return the contact quantities in the friction laws.

    Displacements are those of the boundary field, tractions those of the table. Slip counts from the load step before,
    and from the undeformed body if there is none.
    """
    solution, before, _, nodes, scales = fields
    table = solution.contact
    law = solution.scene.law_at(table.part, np.column_stack([table.x, table.y]))
    law = law if solution.motion is None else law.at_slip(solution.motion)
    motion = nodes.components(nodes.displacement)
    # of a far motion normals that differ by round-off make more than contact strains the body by; see `table_mismatch`
    approach = np.where(np.abs(motion[:, 0] - table.u_n) <= scales.turned, table.u_n, motion[:, 0])
    slip = motion[:, 1]
    if before is not None:
        slip = slip - nodes.components(before.boundary.displacement[nodes.nodes])[:, 1]
        turned = scales.turned + scales_of(before).turned  # after a large motion more than all there is of a small one
        slip = np.sign(slip) * np.maximum(np.abs(slip) - turned, 0.0)
    units = np.broadcast_to(scales.length, slip.shape), np.broadcast_to(scales.stress, slip.shape)
    return measure(table, law, approach, slip, nodes.is_supported, units)


def measure(
    table: ContactTable,
    law: FrictionLaw,
    approach: FloatArray,
    slip: FloatArray,
    is_supported: BoolArray,
    units: tuple[FloatArray, FloatArray],
) -> ContactMeasurements:
    """Return the quantities in the friction laws.

    Parameters
    ----------
    table : ContactTable
    law : FrictionLaw
        Of its nodes.
    approach, slip : (n_contact,) arrays [m]
        Displacements along the direction of contact, and tangential since the state before.
    is_supported : (n_contact,) bool array
        Nodes that no friction law governs.
    units : two (n_contact,) arrays [m], [Pa]
    """
    length, stress = units
    clearance = np.where(np.isfinite(table.gap), table.gap - approach, np.inf) / length
    pressure, shear = -table.sigma_n / stress, table.sigma_t / stress
    acts_across_gap = np.broadcast_to(np.asarray(law.acts_across_gap), pressure.shape)
    held = np.maximum(np.abs(pressure), np.where(acts_across_gap | is_supported, 0.0, np.abs(shear)))
    # A node that is held by less than it is away counts as open (its complementarity says by how much): whether
    # cohesion acts shall not depend on a traction of 1e-16.
    acts = (held > np.abs(clearance)) | acts_across_gap
    bound = np.where(acts, law.bound(np.minimum(table.sigma_n, 0.0)), 0.0) / stress
    return ContactMeasurements(pressure, shear, clearance, slip / length, held, bound, ~is_supported)


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

    A node at a corner between two contact parts belongs to one of them, with the lengths of both: its force makes other
    tractions on the elements there than the node says, and so on their neighbours, which are excluded.
    """
    solution, _, boundary, nodes, scales = fields
    nodal, owner = np.zeros_like(solution.boundary.points), np.full(len(solution.boundary.points), "", dtype=object)
    nodal[nodes.nodes], owner[nodes.nodes] = nodes.traction, solution.contact.part
    worst, beside = [0.0], _beside_corners(solution, boundary)
    for part in solution.scene.contact_parts:
        elements = solution.mesh.part(part.name)
        own = elements[np.isin(owner[boundary.nodes[elements]].astype(str), ["", part.name]).all(axis=1)]
        own = own[~beside[own]]
        mean = np.einsum("eqc,eq->ec", boundary.interpolated(nodal)[own], boundary.shares[own])
        mean /= boundary.lengths[own][:, None]
        stated = solution.boundary.traction[own]
        # elements as short as the round-off of coordinates have lengths, and tractions, of few digits
        round_off = 64.0 * EPSILON * np.abs(solution.mesh.nodes).max() / boundary.lengths[own]
        off = np.abs(mean - stated) - round_off[:, None] * np.abs(stated)
        worst.append(largest(off / scales.stress))
    return max(worst)


def _beside_corners(solution: BodyView, boundary: Boundary) -> BoolArray:
    """Return (n_elements,) bool: the elements at nodes of two contact parts, and those next to them."""
    parts = [np.unique(boundary.nodes[solution.mesh.part(part.name)]) for part in solution.scene.contact_parts]
    nodes, counts = np.unique(np.concatenate([np.zeros(0, np.intp), *parts]), return_counts=True)
    at_corner = np.isin(boundary.nodes, nodes[counts > 1]).any(axis=1)
    return np.asarray(np.isin(boundary.nodes, boundary.nodes[at_corner]).any(axis=1))


def resultant_mismatch(solution: Solution) -> float:
    """Return the difference [-] of the reported forces from sums over the table."""
    table = solution.contact
    areas = solution.scene.depth * table.weight
    size = float(areas @ np.hypot(table.sigma_n, table.sigma_t)) or 1.0
    normal = abs(solution.force_normal + float(areas @ table.sigma_n))
    tangential = abs(solution.force_tangential - float(areas @ table.sigma_t))
    return max(normal, tangential) / size


def slip_opposition(measured: ContactMeasurements) -> float:
    """Return the largest slip [-] that friction does not fully oppose: the smaller of slip and missing traction."""
    missing = np.abs(measured.shear + np.sign(measured.slip) * measured.bound)
    return largest(np.minimum(np.abs(measured.slip), missing)[measured.obeys_friction])


def status_mismatch(status: IntArray, measured: ContactMeasurements) -> float:
    """Return the largest violation [-] of the conditions of the status of a node."""
    direction = np.select([status == NodeStatus.SLIP_FORWARD, status == NodeStatus.SLIP_BACKWARD], [1.0, -1.0])
    slides_freely = measured.bound <= CONTACT_LIMIT
    against = np.where(slides_freely, 0.0, np.minimum(-direction * measured.slip, measured.bound))
    unopposed = np.abs(measured.shear + direction * measured.bound)
    is_open, sticks = status == NodeStatus.SEPARATED, status == NodeStatus.STICK
    friction = np.where(sticks, np.abs(measured.slip), np.where(is_open, 0.0, np.maximum(against, unopposed)))
    friction[~measured.obeys_friction] = 0.0
    return max(largest(measured.held[is_open]), largest(np.abs(measured.clearance)[~is_open]), largest(friction))


def contact_violations(measured: ContactMeasurements, solution: Solution, *, knows_slip: bool) -> dict[str, float]:
    """Return the violations of the conditions of contact; see `Violations`.

    At the end of a load history slip that counts from the step before is not known without that step: `knows_slip`.
    """
    n_steps = 0 if solution.loading is None else len(solution.loading.steps)
    knows_slip = knows_slip or n_steps <= 1
    return {
        "penetration": largest(-measured.clearance),
        "tension": largest(-measured.pressure),
        "complementarity": largest(np.minimum(measured.held, np.abs(measured.clearance))),
        "cone_excess": largest((np.abs(measured.shear) - measured.bound)[measured.obeys_friction]),
        "slip_opposition": slip_opposition(measured) if knows_slip else 0.0,
        "status": status_mismatch(solution.contact.status, measured) if knows_slip else 0.0,
    }


def is_finite(solution: Solution) -> bool:
    """Return whether all fields are numbers; distances to obstacles out of reach may be infinite."""
    columns = solution.contact.columns()
    distances = [columns.pop(name) for name in ("gap", "clearance")]
    of_bodies = (
        field for body in solution.bodies.values() for field in (*vars(body.boundary).values(), np.array(body.energy))
    )
    known = all(bool(np.isfinite(field).all()) for field in (*columns.values(), *of_bodies))
    return known and not any(np.isnan(field).any() for field in distances)


@dataclass(frozen=True, kw_only=True)
class IndependentCheck(Violations):
    """Violations found in the fields of a solution, dimensionless; zero is perfect.

    Those of equilibrium are the work of loads and contact tractions on the rigid motions that no support holds; of a
    half-plane, of tractions and loads far away on the motions that these drive. Reciprocity is that with point forces
    and centres of dilatation outside of the body and with uniform stresses; half-planes, whose displacements are exact,
    have none.

    Parameters
    ----------
    obstacle : float
        Gap of the table against the distance measured again, beyond the round-off of the coordinates.
    table : float
        Displacements of the table against those of the boundary at the same points; reported forces against sums.
    tractions : float
        Tractions of elements against loads and against the contact tractions of the table.
    """

    obstacle: float
    table: float
    tractions: float


def violations_of_body(solution: Solution, before: Solution | None = None) -> IndependentCheck:
    """Check the fields of a solution; see `IndependentCheck`.

    Slip counts from the end of the load step before. Without that, friction against slip is not checked at the end of a
    load history.
    """
    if not is_finite(solution):
        return IndependentCheck.not_finite()
    parts = Fields.of(view_of(solution), None if before is None else view_of(before))
    return IndependentCheck(
        numbers=0.0,
        obstacle=obstacle_mismatch(parts),
        table=max(table_mismatch(parts), resultant_mismatch(solution)),
        tractions=max(traction_mismatch(parts), load_mismatch(parts)),
        supports=support_mismatch(parts),
        **contact_violations(measured_contact(parts), solution, knows_slip=before is not None),
        **_balances(parts),
        coarseness=float(parts.boundary.lengths.max()) / solution.mesh.diameter,
        hidden_overlap=hidden_overlap(parts),
    )


def _balances(parts: Fields) -> dict[str, float]:
    """Return the balances of work between tractions and displacements."""
    if parts.solution.mesh.surface is None:
        return {
            "equilibrium": imbalance(parts),
            "negative_energy": negative_energy(parts),
            "energy": energy_mismatch(parts),
            "elasticity": 0.0,
            "reciprocity": reciprocity_mismatch(parts),
        }
    surface = Surface.of(parts)
    return {
        "equilibrium": surface.imbalance(),
        "negative_energy": surface.negative_energy(),
        "energy": surface.energy_mismatch(),
        "elasticity": surface.elasticity_mismatch(),
        "reciprocity": 0.0,
    }
