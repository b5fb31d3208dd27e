"""The table of the contact nodes of a result, and where the contact status changes between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import cached_property
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray, read_only
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import InputError, ResultWarning
from bemkit.solvers.active_sets import NodeStatus

STATUS_WORDS: Mapping[NodeStatus, str] = MappingProxyType(
    {
        NodeStatus.SEPARATED: "separated",
        NodeStatus.STICK: "stick",
        NodeStatus.SLIP_FORWARD: "slip",
        NodeStatus.SLIP_BACKWARD: "slip",
    }
)

_STRAIGHT = 1e-9
"""Distance of nodes from a horizontal line that is round-off, relative to the length of the contact."""
_CLOSED = (0.9, 2.0)
"""Length of boundary beyond the first and the last node, relative to their distance, if elements join them: from 1 to
pi / 2 along an arc. If both ends of a part are no contact nodes, it is at most two thirds."""
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
    def points(self) -> FloatArray:
        """(n_contact, 2) array [m]: places of the nodes on the undeformed body."""
        return np.stack([self.x, self.y], axis=1)

    @property
    def is_closed(self) -> BoolArray:
        """(n_contact,) bool array: whether a node touches."""
        return np.asarray(self.status != NodeStatus.SEPARATED)

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

    def runs(self, chosen: BoolArray) -> list[IntArray]:
        """Return the runs of chosen nodes (n_contact,) that follow each other on one piece of one part."""
        nodes = np.flatnonzero(chosen)
        is_end = (np.diff(nodes) != 1) | ~self.is_joined[nodes[:-1]]
        return [run for run in np.split(nodes, np.flatnonzero(is_end) + 1) if run.size]

    def renamed(self, names: Mapping[str, str]) -> ContactTable:
        """Return the rows of some parts, by their names, under other names."""
        rows = sorted(row for part in names for row in self._nodes.get(part, ()))
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
    def circumferences(self) -> Mapping[str, float]:
        """Lengths [m] of parts that are whole closed boundaries, whose last node is a neighbour of the first one."""
        closed = {}
        for part in self.parts:
            nodes = list(self._nodes[part])
            first, last, length = nodes[0], nodes[-1], float(self.weight[nodes].sum())
            beyond = length - float(self.s[last] - self.s[first])  # of the nodes: the element between both
            distance = float(np.hypot(self.x[last] - self.x[first], self.y[last] - self.y[first]))
            least, most = np.multiply(_CLOSED, distance) + np.multiply((-_STRAIGHT, _STRAIGHT), length)
            if len(nodes) > 2 and least <= beyond <= most:
                closed[part] = length
        return closed

    @cached_property
    def unrolled(self) -> tuple[ContactTable, IntArray]:
        """The table with closed parts from the middle of their longest zone on, and the numbers of its rows here.

        Zones of one status are then whole. Arc lengths go on beyond the end of the part; see `wrapped`.
        """
        if not self.circumferences:
            return self, np.arange(self.n_contact)
        rows, columns = [], self.columns()
        s, words = columns["s"].copy(), np.array(self.status_words())
        for part in self.parts:
            nodes = np.array(self._nodes[part])
            changes = np.flatnonzero(words[nodes[1:]] != words[nodes[:-1]]) + 1
            if part in self.circumferences and changes.size:
                zones = np.split(nodes, changes)
                longest = max(zones, key=len)
                begin = int(np.searchsorted(nodes, longest[longest.size // 2]))
                s[nodes[:begin]] += self.circumferences[part]
                nodes = np.roll(nodes, -begin)
            rows.append(nodes)
        order = np.concatenate(rows)
        taken: dict[str, Any] = {name: column[order] for name, column in {**columns, "s": s}.items()}
        return ContactTable(part=tuple(self.part[row] for row in order), **taken), order

    def wrapped(self, part: str, s: float, start: float = 0.0) -> float:
        """Return the arc length of the same point of a closed part within a circumference from `start` on."""
        length = self.circumferences.get(part)
        return s if length is None else start + (s - start) % length

    @cached_property
    def _nodes(self) -> Mapping[str, Sequence[int]]:
        """The nodes of each part."""
        nodes: dict[str, list[int]] = {}
        for node, part in enumerate(self.part):
            nodes.setdefault(part, []).append(node)
        return nodes

    def columns(self) -> dict[str, FloatArray | IntArray]:
        """Return the numerical columns by name."""
        return {entry.name: getattr(self, entry.name) for entry in fields(self) if entry.name != "part"}

    def status_words(self) -> list[str]:
        """Return ``"separated"``, ``"slip"`` or ``"stick"`` for each node."""
        return [STATUS_WORDS[NodeStatus(value)] for value in self.status.tolist()]


def bound_at(table: ContactTable, law: FrictionLaw) -> FloatArray | None:
    """Return the friction bound (n_contact,) [Pa] of a law at the tractions of a table; None without friction."""
    if law.is_frictionless:
        return None
    acts = table.is_closed | (np.asarray(law.acts_across_gap) & np.isfinite(table.gap))
    return np.where(acts, law.bound(np.minimum(table.sigma_n, 0.0)), 0.0)


def free_contacts(table: ContactTable) -> set[str]:
    """Return the names of the contacts without any force."""
    return {name for name in table.parts if not table.sigma_n[table.rows(name)].any()}


def facing_away(table: ContactTable) -> Iterator[ResultWarning]:
    """Warn of contacts that can touch nowhere, because their boundary faces away from the obstacle."""
    for name in table.parts:
        if np.isinf(table.gap[table.rows(name)]).all():
            text = (
                f"Contact {name!r} can touch nowhere: its boundary faces away from the obstacle. Choose a side that "
                "faces it, or turn the direction of the obstacle round."
            )
            yield ResultWarning("contact faces away", name, text)


def narrow_contacts(table: ContactTable) -> set[str]:
    """Return the names of the contacts with a force at a few nodes at most."""
    return {name for name in table.parts if np.count_nonzero(table.sigma_n[table.rows(name)]) <= FEW_NODES}
