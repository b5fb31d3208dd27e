"""The conditions of contact and friction at the nodes of a contact."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.solvers.active_sets import NodeStatus
from bemkit.testing.independent_check.contacts import MeasuredContact
from bemkit.testing.independent_check.scales import CONTACT_LIMIT, largest


@dataclass(frozen=True, eq=False)
class ContactMeasurements:
    """Dimensionless quantities in the laws of a contact at each node, all (n_contact,) arrays.

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

    @classmethod
    def of(cls, contact: MeasuredContact) -> ContactMeasurements:
        """Return the quantities in the laws of a contact."""
        table, law, length, stress = contact.table, contact.law, contact.length, contact.stress
        is_supported = contact.is_supported
        # of a far motion normals that differ by round-off make more than contact strains the body by
        approach = contact.displacement[:, 0]
        approach = np.where(np.abs(approach - table.u_n) <= contact.turned, table.u_n, approach)
        clearance = np.where(np.isfinite(table.gap), table.gap - approach, np.inf) / length
        pressure, shear = -table.sigma_n / stress, table.sigma_t / stress
        acts_across_gap = np.broadcast_to(np.asarray(law.acts_across_gap), pressure.shape)
        held = np.maximum(np.abs(pressure), np.where(acts_across_gap | is_supported, 0.0, np.abs(shear)))
        # A node that is held by less than it is away counts as open (its complementarity says by how much): whether
        # cohesion acts shall not depend on a traction of 1e-16.
        acts = (held > np.abs(clearance)) | acts_across_gap
        bound = np.where(acts, law.bound(np.minimum(table.sigma_n, 0.0)), 0.0) / stress
        return cls(pressure, shear, clearance, contact.slip / length, held, bound, ~is_supported)


def contact_violations(contact: MeasuredContact, *, knows_slip: bool) -> dict[str, float]:
    """Return the violations of the conditions of contact; see `Violations`.

    At the end of a load history slip that counts from the step before is not known without that step: `knows_slip`.
    """
    measured = ContactMeasurements.of(contact)
    return {
        "penetration": largest(-measured.clearance),
        "tension": largest(-measured.pressure),
        "complementarity": largest(np.minimum(measured.held, np.abs(measured.clearance))),
        "cone_excess": largest((np.abs(measured.shear) - measured.bound)[measured.obeys_friction]),
        "slip_opposition": _slip_opposition(measured) if knows_slip else 0.0,
        "status": _status_mismatch(contact, measured) if knows_slip else 0.0,
    }


def _slip_opposition(measured: ContactMeasurements) -> float:
    """Return the largest slip [-] that friction does not fully oppose: the smaller of slip and missing traction."""
    missing = np.abs(measured.shear + np.sign(measured.slip) * measured.bound)
    return largest(np.minimum(np.abs(measured.slip), missing)[measured.obeys_friction])


def _status_mismatch(contact: MeasuredContact, measured: ContactMeasurements) -> float:
    """Return the largest violation [-] of the conditions of the status of a node."""
    status = contact.table.status
    direction = np.select([status == NodeStatus.SLIP_FORWARD, status == NodeStatus.SLIP_BACKWARD], [1.0, -1.0])
    slides_freely = measured.bound <= CONTACT_LIMIT
    against = np.where(slides_freely, 0.0, np.minimum(-direction * measured.slip, measured.bound))
    unopposed = np.abs(measured.shear + direction * measured.bound)
    is_open, sticks = status == NodeStatus.SEPARATED, status == NodeStatus.STICK
    friction = np.where(sticks, np.abs(measured.slip), np.where(is_open, 0.0, np.maximum(against, unopposed)))
    friction[~measured.obeys_friction] = 0.0
    return max(largest(measured.held[is_open]), largest(np.abs(measured.clearance)[~is_open]), largest(friction))
