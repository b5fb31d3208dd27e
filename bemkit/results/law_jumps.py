"""Friction coefficients that jump between contact nodes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.contact.laws import FrictionLaw
from bemkit.errors import ResultWarning, format_point
from bemkit.geometry.vectors import norms
from bemkit.results.contact_table import ContactTable

_CHANGE = 0.1
"""Change of the bound from node to node, relative to the larger one, above which it may be a jump."""
_N_HALVINGS = 30
"""Number of times that the interval between two nodes is halved: half of the change then remains for a jump only."""
_AT_NODE = 1e-6
"""Distance from a node, relative to the node distance, within which a jump is at the node."""


def law_jumps(contact: ContactTable, laws: Mapping[str, FrictionLaw]) -> Iterator[ResultWarning]:
    """Warn of jumps of the friction bound between two nodes of which one is pressed.

    Nodes on either side have the bound of their own side, so that the jump is blurred over an element.

    Parameters
    ----------
    contact : ContactTable
    laws : mapping of str to FrictionLaw
        Of the contacts by name, of those that vary along the boundary.
    """
    for name, law in laws.items():
        rows = np.flatnonzero(contact.rows(name))
        pressure = float(np.abs(contact.sigma_n[rows]).max(initial=0.0))
        if rows.size < 2 or pressure == 0.0:
            continue
        points = np.stack([contact.x[rows], contact.y[rows]], axis=1)
        is_pressed, arc = contact.sigma_n[rows] != 0.0, np.diff(contact.s[rows])
        # between two pieces of a contact the arc length stays, and nothing is blurred
        is_on_piece = norms(np.diff(points, axis=0)) <= (1.0 + _AT_NODE) * arc
        for place in _jumps(law, pressure, points, is_on_piece & (is_pressed[:-1] | is_pressed[1:])):
            text = (
                f"Friction of contact {name!r} jumps at {format_point(place)}, inside an element: divide the contact "
                "there into parts, each with a law of its own."
            )
            yield ResultWarning("jump of friction", name, text)


def _jumps(law: FrictionLaw, pressure: float, points: FloatArray, is_asked: BoolArray) -> FloatArray:
    """Return the points (n_jumps, 2) between neighbours among points (n, 2) where the bound at a pressure jumps."""

    def bound(places: FloatArray) -> FloatArray:
        return law.at(places).bound(np.full(len(places), -pressure))

    at_points = bound(points)
    before, after = at_points[:-1], at_points[1:]
    whole = np.abs(after - before)
    asked = np.flatnonzero(is_asked & (whole > _CHANGE * np.maximum(before, after)))
    if not asked.size:
        return np.zeros((0, 2))
    first, way = points[asked], points[asked + 1] - points[asked]
    low, high, at_low, at_high = np.zeros(asked.size), np.ones(asked.size), before[asked], after[asked]
    for _ in range(_N_HALVINGS):
        middle = 0.5 * (low + high)
        at_middle = bound(first + middle[:, None] * way)
        is_in_first = np.abs(at_middle - at_low) >= np.abs(at_high - at_middle)
        low, at_low = np.where(is_in_first, low, middle), np.where(is_in_first, at_low, at_middle)
        high, at_high = np.where(is_in_first, middle, high), np.where(is_in_first, at_middle, at_high)
    is_jump = (np.abs(at_high - at_low) > 0.5 * whole[asked]) & (low > _AT_NODE) & (high < 1.0 - _AT_NODE)
    return np.asarray((first + low[:, None] * way)[is_jump])
