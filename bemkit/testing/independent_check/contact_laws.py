"""The conditions of contact and friction at the nodes of a contact."""

from __future__ import annotations

import numpy as np

from bemkit.solvers.active_sets import NodeStatus
from bemkit.testing.independent_check.contacts import MeasuredContact
from bemkit.testing.independent_check.scales import CONTACT_LIMIT, largest


def contact_violations(contact: MeasuredContact, *, knows_slip: bool) -> dict[str, float]:
    """Return the violations of the conditions of contact; see `Violations`.

    At the end of a load history slip that counts from the step before is not known without that step: `knows_slip`.
    """
    table, law, length, stress = contact.table, contact.law, contact.length, contact.stress
    pressure, shear, slip = -table.sigma_n / stress, table.sigma_t / stress, contact.slip / length
    # of a far motion normals that differ by round-off make more than contact strains the body by
    approach = contact.displacement[:, 0]
    approach = np.where(np.abs(approach - table.u_n) <= contact.turned, table.u_n, approach)
    clearance = np.where(np.isfinite(table.gap), table.gap - approach, np.inf) / length
    # what shows that a node is in contact: its traction, but for friction that is given across a gap
    acts_across_gap = np.isfinite(table.gap) & np.asarray(law.acts_across_gap)
    held = np.maximum(np.abs(pressure), np.where(acts_across_gap | contact.is_supported, 0.0, np.abs(shear)))
    # A node that is held by less than it is away counts as open (its complementarity says by how much): whether
    # cohesion acts shall not depend on a traction of 1e-16.
    acts = (held > np.abs(clearance)) | acts_across_gap
    bound = np.where(acts, law.bound(np.minimum(table.sigma_n, 0.0)), 0.0) / stress
    # slip that friction does not fully oppose: the smaller of slip and missing traction
    unopposed = np.minimum(np.abs(slip), np.abs(shear + np.sign(slip) * bound))
    # what each status says of slip and friction
    status, free = table.status, ~contact.is_supported
    is_open, sticks = status == NodeStatus.SEPARATED, status == NodeStatus.STICK
    direction = np.select([status == NodeStatus.SLIP_FORWARD, status == NodeStatus.SLIP_BACKWARD], [1.0, -1.0])
    against = np.where(bound <= CONTACT_LIMIT, 0.0, np.minimum(-direction * slip, bound))
    slides = np.maximum(against, np.abs(shear + direction * bound))
    friction = np.select([sticks, is_open], [np.abs(slip), np.zeros_like(slip)], slides)
    unlike = largest(held[is_open]), largest(np.abs(clearance)[~is_open]), largest(friction[free])
    return {
        "penetration": largest(-clearance),
        "tension": largest(-pressure),
        "complementarity": largest(np.minimum(held, np.abs(clearance))),
        "cone_excess": largest((np.abs(shear) - bound)[free]),
        "slip_opposition": largest(unopposed[free]) if knows_slip else 0.0,
        "status": max(unlike) if knows_slip else 0.0,
    }
