"""Places where neighbouring contact nodes slip in opposite directions: a stick zone too short for the mesh."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from bemkit.results.contact_table import ContactTable
from bemkit.results.transitions import Transition
from bemkit.solvers.active_sets import NodeStatus


class SlipReversal(NamedTuple):
    """A place of a contact where the direction of slip changes.

    Parameters
    ----------
    place : Transition
        From slip to slip, where the slip changes its sign.
    n_sticking : int
        Nodes that stick in between: one or none.
    """

    place: Transition
    n_sticking: int


def slip_reversals(contact: ContactTable) -> tuple[SlipReversal, ...]:
    """Return where the direction of slip changes along contacts, directly or at a single node that sticks.

    Between opposite directions lies a stick zone, where the tangential traction changes sign; here the mesh does not
    resolve it. For stick zones of several nodes see `resolved_transitions`. Parts without friction are skipped.
    """
    table, _ = contact.unrolled
    direction = np.where(table.status == NodeStatus.SLIP_FORWARD, 1.0, 0.0)
    direction[table.status == NodeStatus.SLIP_BACKWARD] = -1.0
    direction[table.sigma_t == 0.0] = 0.0
    sticks, joined = table.status == NodeStatus.STICK, table.is_joined
    reversals = []
    for n_sticking in (0, 1):
        beyond = n_sticking + 1
        for i in np.flatnonzero(direction[:-beyond] * direction[beyond:] < 0.0).tolist():
            if joined[i : i + beyond].all() and sticks[i + 1 : i + beyond].all():
                place = _where_slip_vanishes(table, i, i + beyond)
                wrapped = replace(place, s=contact.wrapped(place.part, place.s))
                reversals.append(SlipReversal(wrapped, n_sticking))
    return tuple(reversals)


def _where_slip_vanishes(contact: ContactTable, i: int, k: int) -> Transition:
    """Return the place between two nodes by their displacements, or halfway if these do not change their sign."""
    slip, share = contact.u_t[[i, k]], 0.5
    if slip[0] * slip[1] < 0.0:
        share = float(slip[0] / (slip[0] - slip[1]))
    x, y, s = ((1.0 - share) * column[i] + share * column[k] for column in (contact.x, contact.y, contact.s))
    return Transition(contact.part[i], float(x), float(y), float(s), "slip", "slip")
