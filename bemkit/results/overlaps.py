"""Warnings of bodies that overlap in their displaced positions, beside the contacts between them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import BoolArray
from bemkit.geometry.overlap import ROUND_OFF, Polyline, deepest_overlap, near_pairs
from bemkit.result_warning import ResultWarning
from bemkit.results.between_nodes import Interpolation
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.unit_names import amount

if TYPE_CHECKING:
    from bemkit.results.solution import Solution

LEAST_OVERLAP = 0.1
"""Depth that may be the error of small displacements beside a contact zone, relative to the largest displacement of
both bodies."""


def overlap_warnings(solution: Solution) -> Iterator[ResultWarning]:
    """Warn of two bodies that overlap beside the contacts stated between them.

    Points of sides in contact are measured by `BetweenNodes`, others here: at the displaced points of both boundaries.
    """
    bodies = {name: body for name, body in solution.bodies.items() if body.mesh.surface is None}
    names, outlines = list(bodies), [_displaced(body) for body in bodies.values()]
    for k, m in near_pairs(outlines):
        one, two = names[k], names[m]
        beside = [
            _is_beside(solution, own, other)[outline.elements]
            for own, other, outline in ((one, two, outlines[k]), (two, one, outlines[m]))
        ]
        moved = max(float(np.abs(bodies[name].boundary.displacement).max()) for name in (one, two))
        size = min(bodies[name].mesh.diameter for name in (one, two))
        least = outlines[k].tolerance + outlines[m].tolerance + ROUND_OFF * size + LEAST_OVERLAP * moved
        depth, (x, y) = deepest_overlap(outlines[k], outlines[m], least, beside)
        if depth > 0.0:
            yield ResultWarning(
                "overlap beside contacts",
                f"{one} / {two}",
                f"Bodies {one!r} and {two!r} overlap by {amount(depth, 'length', solution.units, 2)} at "
                f"({x:.4g}, {y:.4g}), beside the contacts between them: state a contact there, or move them apart.",
                depth,
            )


def _displaced(body: SolvedBody) -> Polyline:
    """Return the polyline of a body in its displaced position."""
    mesh, xi = body.mesh, Polyline.places()
    elements = np.arange(mesh.n_elements)
    at = np.broadcast_to(xi, (elements.size, xi.size))
    return Polyline.of(mesh, Interpolation.at(body, elements, at).displacement(body))


def _is_beside(solution: Solution, name: str, other: str) -> BoolArray:
    """Return (n_elements,) bool: the elements of a body that are in no contact with another one."""
    mesh = solution.bodies[name].mesh
    is_beside = np.ones(mesh.n_elements, bool)
    for sides in solution.contact_sides.values():
        if {side.body for side in sides} == {name, other}:
            is_beside[np.concatenate([mesh.part(side.part) for side in sides if side.body == name])] = False
    return is_beside
