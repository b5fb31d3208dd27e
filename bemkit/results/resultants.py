"""Numbers of contacts and parts for summaries, from the contact table and the resultants."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np

from bemkit.results.contact_table import ContactTable

if TYPE_CHECKING:
    from bemkit.results.part_forces import ContactForce, PartForce


class _Body(Protocol):
    @property
    def part_forces(self) -> tuple[PartForce, ...]:
        """Resultants on the parts."""


class _Result(Protocol):
    """Needs of a solution."""

    @property
    def contact(self) -> ContactTable:
        """The contact table."""

    @property
    def contacts(self) -> tuple[ContactForce, ...]:
        """Forces of each contact."""

    @property
    def solved_bodies(self) -> Sequence[_Body]:
        """The elastic bodies."""

    def part_length(self, part: str, /) -> float:
        """Return the length of a contact."""


def contact_facts(solution: _Result) -> list[dict[str, Any]]:
    """Return the numbers of each contact by name.

    Those of `ContactForce`, and ``contact_fraction`` [-], the share of the contact that touches, ``peak_x`` and
    ``peak_y`` [m], the node of the peak pressure.
    """
    return [
        contact.as_dict()
        | {"contact_fraction": contact.contact_length / solution.part_length(contact.name)}
        | _peak(solution.contact, contact.name)
        for contact in solution.contacts
    ]


def _peak(table: ContactTable, part: str) -> dict[str, float]:
    rows = np.flatnonzero(table.rows(part))
    node = rows[np.argmin(table.sigma_n[rows])]
    return {"peak_x": float(table.x[node]), "peak_y": float(table.y[node])}


def part_facts(solution: _Result) -> list[dict[str, Any]]:
    """Return the resultants on each part, of several bodies with the name of the ``body``."""
    names = list(getattr(solution, "bodies", {}))
    return [
        ({"body": names[number]} if names else {}) | force.as_dict()
        for number, body in enumerate(solution.solved_bodies)
        for force in body.part_forces
    ]
