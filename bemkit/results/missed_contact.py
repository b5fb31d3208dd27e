"""Contact that no node detects, because it lies between them."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from bemkit.results.contact_table import free_contacts
from bemkit.scene.unit_names import amount
from bemkit.solvers.base import Status

if TYPE_CHECKING:
    from bemkit.results.solution import Solution

LARGEST_APART = 1.0
"""Largest distance of sides that touch, relative to the displacement by contact forces. Mortar conditions hold in the
mean: curved sides of long elements fulfil them at a distance."""


def with_missed_contact_named(solution: Solution) -> Solution:
    """Return the same solution, with the status MISSED_CONTACT if the mesh does not find the contact.

    A contact without any force overlaps between its nodes, one with a force at a few nodes is much deeper between them
    than forces move the bodies, or sides that touch nowhere have a force.
    """
    if not solution.is_converged:
        return solution
    if solution.unfound_contacts:
        name, (x, y) = next(iter(solution.unfound_contacts.items()))
        between = solution.narrow_contacts_between_nodes[name]
        depth = amount(between.penetration_depth, "length", solution.units, 2)
        words = f"Contact {name!r} overlaps by {depth} at ({x:.4g}, {y:.4g})."
    elif apart := _pressed_apart(solution):
        words = f"Contact {apart[0]!r} has a force, but its sides touch nowhere."
    else:
        return solution
    message = f"{Status.MISSED_CONTACT.value} {words}"
    return replace(solution, status=Status.MISSED_CONTACT, message=message, warnings=solution.unasked_warnings)


def _pressed_apart(solution: Solution) -> list[str]:
    """Return the contacts between elastic bodies with a force whose sides touch nowhere."""
    free = free_contacts(solution.contact)
    return [
        name
        for name, each in solution.narrow_contacts_between_nodes.items()
        if name not in free and solution.n_sides(name) > 1 and each.apart > LARGEST_APART
    ]
