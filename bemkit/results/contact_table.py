"""The table of the contact nodes of a result, and where the contact status changes between them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError
from bemkit.solvers.active_sets import NodeStatus
from bemkit.table import Column

STATUS_WORDS: Mapping[NodeStatus, str] = MappingProxyType(
    {
        NodeStatus.SEPARATED: "separated",
        NodeStatus.STICK: "stick",
        NodeStatus.SLIP_FORWARD: "slip",
        NodeStatus.SLIP_BACKWARD: "slip",
    }
)
CONTACT_COLUMNS = (
    Column("x", "m", "first coordinate", ".6g"),
    Column("y", "m", "second coordinate", ".6g"),
    Column("s", "m", "arc length from the start of the part", ".6g"),
    Column("u_n", "m", "displacement towards the obstacle or the partner", ".6g"),
    Column("u_t", "m", "displacement along the tangent", ".6g"),
    Column("sigma_n", "Pa", "normal traction, negative where pressed", ".6g"),
    Column("sigma_t", "Pa", "tangential traction", ".6g"),
    Column("gap", "m", "initial distance", ".6g"),
    Column("clearance", "m", "distance left, gap - u_n", ".6g"),
    Column("status", "", "separated, slip or stick; in files 0, 1 stick, 2 slip along the tangent, 3 slip against it"),
    Column("weight", "m", "length of boundary of the node", ".6g"),
    Column("part", "", "contact part or contact of each node"),
)
"""Columns of the contact table in results, tables and files."""
FLICKER = 1e-8
"""Changes of status within this share of a side count as one. Clearances grow like d**1.5 with the distance d from the
edge: close to it they are round-off, and the status may change from node to node."""

_STRAIGHT = 1e-9
"""Distance of nodes from a horizontal line that is round-off, relative to the length of the contact."""
FEW_NODES = 3
"""Largest number of pressed nodes at which the sides of a contact may meet between its nodes, or nowhere."""


@dataclass(frozen=True, eq=False)
class ContactTable:
    """One row per contact node, in order along each contact part.

    Parameters
    ----------
    part : tuple of n_contact str
        Name of the part each node belongs to.
    x, y : (n_contact,) arrays [m]
        Places of the nodes on the undeformed body.
    s : (n_contact,) array [m]
        Arc length from the start of the part.
    u_n, u_t : (n_contact,) arrays [m]
        Displacement along the direction of contact, positive towards the obstacle, and along the tangent.
    sigma_n, sigma_t : (n_contact,) arrays [Pa]
        Traction on the body in the same components; pressed nodes have ``sigma_n < 0``.
    gap : (n_contact,) array [m]
        Initial distance to the obstacle along the direction of contact; infinite where the node cannot touch any.
    clearance : (n_contact,) array [m]
        Distance left, ``gap - u_n``.
    status : (n_contact,) array of `NodeStatus` values
    weight : (n_contact,) array [m]
        Length of boundary of the node.

    Raises
    ------
    ValueError
        If the columns differ in length, or a status is not a `NodeStatus`.
    """

    part: tuple[str, ...]
    x: FloatArray
    y: FloatArray
    s: FloatArray
    u_n: FloatArray
    u_t: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray
    gap: FloatArray
    clearance: FloatArray
    status: IntArray
    weight: FloatArray

    def __post_init__(self) -> None:
        for name, column in self.columns().items():
            if column.shape != (len(self.part),):
                raise InputError(f"{name} has the shape {column.shape}: give ({len(self.part)},), one entry per node")
            read_only(column)
        wrong = np.flatnonzero(~np.isin(self.status, [int(status) for status in NodeStatus]))
        if wrong.size:
            raise InputError(f"status[{wrong[0]}] is {self.status[wrong[0]]}: give values of NodeStatus")

    def __repr__(self) -> str:
        """Return one line."""
        words = self.status_words()
        counts = ", ".join(f"{words.count(word)} {word}" for word in dict.fromkeys(words))
        return f"ContactTable({self.n_contact} nodes{': ' if counts else ''}{counts})"

    @classmethod
    def empty(cls) -> ContactTable:
        """Return the table of a scene without contact."""
        none = np.zeros(0)
        return cls((), *(none,) * 9, np.zeros(0, np.intp), none)

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.part)

    @property
    def parts(self) -> tuple[str, ...]:
        """The names of the contact parts, in their order."""
        return tuple(dict.fromkeys(self.part))

    @property
    def common_direction(self) -> float:
        """1 or -1 if all parts run to the right or to the left along horizontal lines, 0 otherwise."""
        directions = {self.direction(part) for part in self.parts}
        return directions.pop() if len(directions) == 1 else 0.0

    def direction(self, part: str) -> float:
        """Return 1 if a part runs to the right along a horizontal line, -1 to the left, 0 otherwise.

        Slip and friction along the boundary are positive along x in the first case, negative in the second.
        """
        rows = self.rows(part)
        x, y, s = self.x[rows], self.y[rows], self.s[rows]
        if x.size < 2:
            return 0.0
        tolerance = _STRAIGHT * max(float(np.ptp(s)), float(np.abs(x).max()), float(np.abs(y).max()))
        sign = float(np.sign((x[-1] - x[0]) * (s[-1] - s[0])))
        is_straight = np.ptp(y) <= tolerance and np.abs(x - x[0] - sign * (s - s[0])).max() <= tolerance
        return sign if is_straight else 0.0

    def rows(self, part: str) -> BoolArray:
        """Return (n_contact,) bool: the nodes of one part."""
        is_of_part = np.zeros(self.n_contact, bool)
        is_of_part[list(self._nodes.get(part, ()))] = True
        return is_of_part

    def renamed(self, names: Mapping[str, str]) -> ContactTable:
        """Return the rows of some parts, by their names, under other names."""
        rows = [row for row, part in enumerate(self.part) if part in names]
        columns: dict[str, Any] = {key: column[rows] for key, column in self.columns().items()}
        return ContactTable(part=tuple(names[self.part[row]] for row in rows), **columns)

    @cached_property
    def is_joined(self) -> BoolArray:
        """(n_contact - 1,) bool: whether a node and the next one follow each other on one piece of one part."""
        distance = np.hypot(np.diff(self.x), np.diff(self.y))
        # the lengths of two neighbours add up to at least their distance, however graded the mesh is
        reach = (1.0 + 1e-9) * (self.weight[:-1] + self.weight[1:])
        return np.equal(self.part[:-1], self.part[1:]) & (distance <= reach)

    @cached_property
    def _nodes(self) -> Mapping[str, Sequence[int]]:
        """The nodes of each part."""
        nodes: dict[str, list[int]] = {}
        for node, part in enumerate(self.part):
            nodes.setdefault(part, []).append(node)
        return nodes

    def columns(self) -> dict[str, FloatArray | IntArray]:
        """Return the numerical columns by name."""
        return {head.name: getattr(self, head.name) for head in CONTACT_COLUMNS if head.name != "part"}

    def status_words(self) -> list[str]:
        """Return ``"separated"``, ``"slip"`` or ``"stick"`` for each node."""
        return [STATUS_WORDS[NodeStatus(value)] for value in self.status.tolist()]


def bound_at(table: ContactTable, law: FrictionLaw) -> FloatArray | None:
    """Return the friction bound (n_contact,) [Pa] of a law at the tractions of a table; None without friction."""
    if law.is_frictionless:
        return None
    is_closed = table.status != NodeStatus.SEPARATED
    return np.where(is_closed | np.asarray(law.acts_across_gap), law.bound(np.minimum(table.sigma_n, 0.0)), 0.0)


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
    words = contact.status_words()
    slip = contact.u_t if slip is None else slip
    changes = [i for i in np.flatnonzero(contact.is_joined).tolist() if words[i] != words[i + 1]]
    places = np.array([_transition_place(contact, slip, words, i) for i in changes])
    arc_lengths, x, y = _kept_apart(contact, changes, places), np.zeros(len(changes)), np.zeros(len(changes))
    parts = [contact.part[i] for i in changes]
    for part in dict.fromkeys(parts):
        of_part, rows = np.equal(parts, part), contact.rows(part)
        for coordinate, column in ((x, contact.x), (y, contact.y)):
            coordinate[of_part] = np.interp(arc_lengths[of_part], contact.s[rows], column[rows])
    at = zip(changes, parts, x.tolist(), y.tolist(), arc_lengths.tolist(), strict=True)
    return tuple(Transition(part, x_at, y_at, s, words[i], words[i + 1]) for i, part, x_at, y_at, s in at)


def resolved_transitions(contact: ContactTable, transitions: Sequence[Transition]) -> tuple[Transition, ...]:
    """Return the transitions between zones of several nodes each.

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


def free_contacts(table: ContactTable) -> set[str]:
    """Return the names of the contacts without any force."""
    return {name for name in table.parts if not table.sigma_n[table.rows(name)].any()}


def narrow_contacts(table: ContactTable) -> set[str]:
    """Return the names of the contacts with a force at a few nodes at most."""
    return {name for name in table.parts if np.count_nonzero(table.sigma_n[table.rows(name)]) <= FEW_NODES}


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
