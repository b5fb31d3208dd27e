"""Numbers of contacts and parts for summaries, from the contact table and the resultants."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from bemkit.results.contact_table import ContactTable

if TYPE_CHECKING:
    from bemkit.results.solved_scene import SolvedScene


def contact_facts(solution: SolvedScene) -> list[dict[str, Any]]:
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


def part_facts(solution: SolvedScene) -> list[dict[str, Any]]:
    """Return the resultants on each part, with the name of the ``body`` if it has one.

    Those on parts at fixed obstacles are those of the contacts: of the nodal forces, with which the body is in
    equilibrium to round-off.
    """
    contacts = {contact.name: contact for contact in solution.contacts}
    facts = []
    for name, body in solution.bodies.items():
        for force in body.part_forces:
            found = contacts.get(body.contact_name(force.name), force)
            sums = {"force_x": found.force_x, "force_y": found.force_y, "moment": found.moment}
            facts.append(({"body": name} if name else {}) | {"name": force.name} | sums)
    return facts
