"""Transitions: the places where the contact status, or the direction of slip, changes between contact nodes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.contact_table import ContactTable
from bemkit.solvers.active_sets import NodeStatus

FLICKER = 1e-8
"""Changes of status within this share of a side count as one. Clearances grow like d**1.5 with the distance d from the
edge: close to it they are round-off, and the status may change from node to node."""


@dataclass(frozen=True)
class Transition:
    """A point of a contact part where the contact status changes.

    Parameters
    ----------
    part : str
    x, y : float [m]
    s : float [m]
        Arc length from the start of the part.
    from_status, to_status : str
        ``"separated"``, ``"slip"`` or ``"stick"``, in the direction of growing s.
    """

    part: str
    x: float
    y: float
    s: float
    from_status: str
    to_status: str

    @property
    def is_of_contact(self) -> bool:
        """Whether a zone of contact ends there, and not one of sticking only."""
        return "separated" in (self.from_status, self.to_status)

    def as_dict(self) -> dict[str, str | float]:
        """Return the entries under the names of the results file."""
        return {name.removesuffix("_status"): value for name, value in vars(self).items()}

    @classmethod
    def of(cls, row: Mapping[str, Any]) -> Transition:
        """Return the transition from the entries of `as_dict`."""
        return cls(*(row[entry.name.removesuffix("_status")] for entry in fields(cls)))


_FIRST_FITTED, _LEAST_FITTED = 4, 8
"""Number of the first node, counted from a transition, to which a power law is fitted, since nodes beside a transition
have the largest errors; and the least number of nodes for a fit."""
_POWER_LAW_RANGE = 0.1
"""Distance from the transition, relative to the size of the zone, up to which nodes are fitted."""
_POWERS = (1.3, 1.7)
"""Range of the power; sliding friction changes it from 3/2."""
_MOST_STEPS = 20
"""Newton steps of the fit."""
_AT_BOUND = 1e-9
"""Round-off of friction at its bound."""
_LEAST_ZONE = 0.5
"""Least length of a zone, relative to the zone that ends halfway between its own and the neighbouring nodes."""


def find_transitions(contact: ContactTable, slip: FloatArray | None = None) -> tuple[Transition, ...]:
    """Find where the status changes along each contact part.

    Parameters
    ----------
    contact : ContactTable
    slip : (n_contact,) array [m], optional
        Under the incremental law ``u_t`` less its value at the end of the step before; ``u_t`` itself by default.

    Returns
    -------
    tuple of Transition
        In order along each part. A mere change of the direction of slip is not a transition.

    Notes
    -----
    Near the end of a smooth contact zone at distance d the clearance grows like d^(3/2), and so does the slip near the
    end of a stick zone. Its power 2/3, extrapolated from the last two open (or slipping) nodes, therefore crosses zero
    at the transition; on the paper's examples this is within a quarter of the node distance. Sliding friction changes
    the power somewhat (to 1.44 and 1.56 on Example 1): on meshes that are fine there place and power are fitted to the
    nodes of a tenth of the zone but the four next to the transition, where the computed solution has the largest
    errors. If that fails, as at the edge of an obstacle, or if two transitions would remove the narrow zone between
    them, the transition lies halfway between the two nodes that differ.
    """
    slip = contact.u_t if slip is None else slip
    table, rows = contact.unrolled
    words = table.status_words()
    changes = [i for i in np.flatnonzero(table.is_joined).tolist() if words[i] != words[i + 1]]
    places = np.array([_transition_place(table, slip[rows], words, i) for i in changes])
    arc_lengths, x, y = _kept_apart(table, changes, places), np.zeros(len(changes)), np.zeros(len(changes))
    parts = [table.part[i] for i in changes]
    for part in dict.fromkeys(parts):
        of_part, nodes = np.equal(parts, part), table.rows(part)
        for coordinate, column in ((x, table.x), (y, table.y)):
            coordinate[of_part] = np.interp(arc_lengths[of_part], table.s[nodes], column[nodes])
    at = zip(changes, parts, x.tolist(), y.tolist(), arc_lengths.tolist(), strict=True)
    found = [Transition(part, a, b, contact.wrapped(part, s), words[i], words[i + 1]) for i, part, a, b, s in at]
    return _in_order(contact, found) if contact.circumferences else tuple(found)


def friction_across_gaps(contact: ContactTable, bound: FloatArray) -> ContactTable:
    """Return the table with the status of friction at separated nodes where it acts, as by Tresca's law.

    Parameters
    ----------
    contact : ContactTable
    bound : (n_contact,) array [Pa]
        Of friction, zero where it does not act.

    Returns
    -------
    ContactTable
        All other nodes are separated.
    """
    acts = ~contact.is_closed & (bound > 0.0)
    slips = np.abs(contact.sigma_t) >= (1.0 - _AT_BOUND) * bound
    direction = np.where(contact.sigma_t < 0.0, NodeStatus.SLIP_FORWARD, NodeStatus.SLIP_BACKWARD)
    friction = np.where(slips, direction, NodeStatus.STICK)
    return replace(contact, status=np.where(acts, friction, NodeStatus.SEPARATED).astype(np.intp))


def unrolled(contact: ContactTable, transitions: Sequence[Transition]) -> tuple[ContactTable, tuple[Transition, ...]]:
    """Return `ContactTable.unrolled`, and the transitions by its arc lengths, in their order there."""
    table, _ = contact.unrolled
    if not contact.circumferences:
        return table, tuple(transitions)
    start = {part: float(table.s[table.part.index(part)]) for part in contact.circumferences}
    moved = [replace(each, s=contact.wrapped(each.part, each.s, start.get(each.part, 0.0))) for each in transitions]
    return table, _in_order(table, moved)


def _in_order(contact: ContactTable, transitions: Sequence[Transition]) -> tuple[Transition, ...]:
    """Return transitions in the order of the parts of a table, and along each part."""
    order = {part: k for k, part in enumerate(contact.parts)}
    return tuple(sorted(transitions, key=lambda each: (order[each.part], each.s)))


def resolved_transitions(contact: ContactTable, transitions: Sequence[Transition]) -> tuple[Transition, ...]:
    """Return the transitions between zones of several nodes each, of a table that is `unrolled`.

    A zone of a single node is not resolved by the mesh yet, or a support holds its node.
    """
    resolved: list[Transition] = []
    for part in contact.parts:
        of_part = [transition for transition in transitions if transition.part == part]
        ends = [-np.inf, *(transition.s for transition in of_part), np.inf]
        has_several = np.histogram(contact.s[contact.rows(part)], ends)[0] > 1
        is_resolved = has_several[:-1] & has_several[1:]
        resolved += [transition for transition, keep in zip(of_part, is_resolved, strict=True) if keep]
    return tuple(resolved)


def unresolved_contacts(contact: ContactTable, resolved: Sequence[Transition]) -> list[tuple[str, tuple[float, float]]]:
    """Return the parts and middle nodes of zones in contact between separated nodes without a resolved transition.

    Such a zone is a single node, or zones of single nodes lie at both its ends. The next mesh keeps a node there, else
    it may miss the contact.
    """
    is_pressed, joined = contact.sigma_n < 0.0, contact.is_joined
    changes = np.flatnonzero(~joined | (is_pressed[:-1] != is_pressed[1:])).tolist()
    places = []
    for before, end in pairwise(changes):  # zones of nodes before + 1 ... end
        k = (before + 1 + end) // 2
        part, low, high = str(contact.part[k]), contact.s[before], contact.s[end + 1]
        if is_pressed[k] and joined[before] and joined[end]:
            if not any(each.part == part and low <= each.s <= high for each in resolved):
                places.append((part, (float(contact.x[k]), float(contact.y[k]))))
    return places


def _kept_apart(contact: ContactTable, changes: list[int], places: FloatArray) -> FloatArray:
    """Return the arc lengths of transitions, halfway between their nodes where `places` leave too little of a zone."""
    result = places.copy()
    halfway = np.array([(contact.s[i] + contact.s[i + 1]) / 2.0 for i in changes])
    for part in dict.fromkeys(contact.part[i] for i in changes):
        of_part = [k for k, i in enumerate(changes) if contact.part[i] == part]
        ends = contact.s[contact.rows(part)][[0, -1]]
        least = _LEAST_ZONE * np.diff(halfway[of_part], prepend=ends[0], append=ends[1])
        for _ in of_part:  # a transition that moves back may come too close to the next one
            is_lost = np.diff(result[of_part], prepend=ends[0], append=ends[1]) < least
            result[of_part] = np.where(is_lost[:-1] | is_lost[1:], halfway[of_part], result[of_part])
    return result


def _transition_place(contact: ContactTable, slip: FloatArray, words: list[str], i: int) -> float:
    """Return the arc length of the transition between the nodes i and i + 1; see `find_transitions`."""
    looser = ("separated", "slip", "stick")
    is_forward = looser.index(words[i]) < looser.index(words[i + 1])
    last, tighter, step = (i, i + 1, -1) if is_forward else (i + 1, i, 1)
    middle = float(contact.s[i] + contact.s[i + 1]) / 2.0
    zone = [last]
    while 0 <= (k := zone[-1] + step) < contact.n_contact and (words[k], contact.part[k]) == (
        words[last],
        contact.part[last],
    ):
        zone.append(k)
    if len(zone) < 2 or contact.s[tighter] == contact.s[last]:  # two rows of one node in a corner
        return middle
    field = contact.clearance if words[last] == "separated" else np.abs(slip)
    distance = _distance_to_zero(np.abs(contact.s[zone] - contact.s[last]), field[zone])
    if distance is None:
        return middle
    gap = contact.s[tighter] - contact.s[last]
    return float(contact.s[last] + np.clip(distance / abs(gap), 0.0, 2.0) * gap)


def _distance_to_zero(s: FloatArray, field: FloatArray) -> float | None:
    """Return how far before s = 0 a field vanishes that falls towards it like a power; None if it does not fall."""
    if not (np.isfinite(field[:2]).all() and field[1] > field[0] >= 0.0):
        return None
    share = (field[0] / field[1]) ** (2.0 / 3.0)
    distance = float(s[1] * share / (1.0 - share))
    fitted = slice(_FIRST_FITTED, int(np.searchsorted(s, _POWER_LAW_RANGE * s[-1])))
    if s[fitted].size < _LEAST_FITTED or not np.all((field[fitted] > 0.0) & np.isfinite(field[fitted])):
        return distance
    place, power = _fitted_power_law(s[fitted], field[fitted], distance)
    is_likely = _POWERS[0] <= power <= _POWERS[1] and abs(place - distance) <= s[_FIRST_FITTED]
    return place if is_likely else distance


def _fitted_power_law(s: FloatArray, field: FloatArray, distance: float) -> tuple[float, float]:
    """Fit log f = a + power log(s + distance) + b s by Newton's method; return distance and power."""
    length, logarithms, power = float(s[-1]), np.log(field / field[-1]), 1.5
    for _ in range(_MOST_STEPS):
        relative = (s + distance) / length
        columns = np.stack([np.ones_like(s), np.log(relative), s / length], axis=1)
        power = float(np.linalg.lstsq(columns, logarithms, rcond=None)[0][1])
        with_derivative = np.column_stack([columns, power / relative])
        step = length * float(np.linalg.lstsq(with_derivative, logarithms, rcond=None)[0][-1])
        distance = max(distance + step, -0.9 * float(s[0]))
        if abs(step) <= 1e-12 * s[0]:
            break
    return distance, power


class SlipReversal(NamedTuple):
    """A place of a contact where the direction of slip changes.

    Parameters
    ----------
    place : Transition
        From slip to slip, where the slip changes its sign.
    n_sticking : int
        Nodes that stick in between: one or none.
    jump : float [Pa]
        Of friction, from one node that slips to the other.
    """

    place: Transition
    n_sticking: int
    jump: float


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
                reversals.append(SlipReversal(wrapped, n_sticking, float(table.sigma_t[i + beyond] - table.sigma_t[i])))
    return tuple(reversals)


def _where_slip_vanishes(contact: ContactTable, i: int, k: int) -> Transition:
    """Return the place between two nodes by their displacements, or halfway if these do not change their sign."""
    slip, share = contact.u_t[[i, k]], 0.5
    if slip[0] * slip[1] < 0.0:
        share = float(slip[0] / (slip[0] - slip[1]))
    x, y, s = ((1.0 - share) * column[i] + share * column[k] for column in (contact.x, contact.y, contact.s))
    return Transition(contact.part[i], float(x), float(y), float(s), "slip", "slip")
