"""Friction coefficients, loads, given displacements and gaps that jump between contact nodes or inside elements."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from functools import partial

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Gap
from bemkit.errors import ResultWarning, format_point
from bemkit.formulas import ScalarField, evaluate_field, has_fields
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.neighbours import lone_elements
from bemkit.geometry.vectors import norms
from bemkit.operators.steklov_poincare.nodal_conditions import TractionField
from bemkit.results.contact_table import ContactTable
from bemkit.results.solved_body import SolvedBody
from bemkit.results.solved_scene import SolvedScene
from bemkit.scene.conditions import Contact, PrescribedDisplacement, Pressure, Traction

_CHANGE = 0.1
"""Change from place to place, relative to the larger value, above which it may be a jump."""
_N_HALVINGS = 30
"""Number of times that the interval between two places is halved: half of the change then remains for a jump only."""
_AT_NODE = 1e-6
"""Distance from a node, relative to the node distance, within which a jump is at the node."""
_PLACES = (1.0 - 2.0 * _AT_NODE) * np.cos(np.linspace(np.pi, 0.0, 18))
"""Local coordinates at which the loads of an element are compared; its middle, a likely place of a jump, is none."""
_LEAST_SHARE = 1e-3
"""Jump of a load times the length of its element, relative to the whole load on the part, that is not negligible."""

_Values = Callable[[IntArray, FloatArray], FloatArray]
"""Values (m, 2) in intervals (m,) at shares (m,) of their lengths."""


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
        points = contact.points[rows]
        is_pressed, arc = contact.sigma_n[rows] != 0.0, np.diff(contact.s[rows])
        # between two pieces of a contact the arc length stays, and nothing is blurred
        is_on_piece = norms(np.diff(points, axis=0)) <= (1.0 + _AT_NODE) * arc
        size = float(np.ptp(points, axis=0).max())
        for place in _law_jumps(law, pressure, points, is_on_piece & (is_pressed[:-1] | is_pressed[1:])):
            remedy = "the contact there into parts, each with a law of its own"
            yield _named("friction", name, f"Friction of contact {name!r}", place, size, remedy)


def _named(kind: str, name: str, subject: str, place: FloatArray, size: float, remedy: str) -> ResultWarning:
    text = f"{subject} jumps at {format_point(place, size)}, inside an element: divide {remedy}."
    return ResultWarning(f"jump of {kind}", name, text)


def _law_jumps(law: FrictionLaw, pressure: float, points: FloatArray, is_asked: BoolArray) -> FloatArray:
    """Return the points (n_jumps, 2) between neighbours among points (n, 2) where the bound at a pressure jumps."""
    way = np.diff(points, axis=0)

    def bound(intervals: IntArray, share: FloatArray) -> FloatArray:
        places = points[intervals] + share[:, None] * way[intervals]
        bounds = law.at(places).bound(np.full(len(places), -pressure))
        return np.stack([bounds, np.zeros_like(bounds)], axis=1)

    intervals, share, _ = _jumps(bound, np.flatnonzero(is_asked))
    is_inside = (share > _AT_NODE) & (share < 1.0 - _AT_NODE)
    return np.asarray((points[intervals] + share[:, None] * way[intervals])[is_inside])


def load_jumps(body: SolvedBody) -> Iterator[ResultWarning]:
    """Warn of loads, given displacements and given gaps of a body that jump inside an element.

    Quadrature and interpolation take the jump to another place of the element. Of a load that varies on a single
    element of a half-plane only the mean acts.
    """
    for part, elements in body.scene.parts_on(body.mesh):
        match part.condition:
            case (Traction() | Pressure()) as load if has_fields(load):
                kind, at = "load", load.at
                if body.mesh.surface is not None and lone_elements(body.mesh)[elements].any():
                    text = (
                        f"Only the mean of the load acts on the element of part {part.name!r}: use more elements there."
                    )
                    yield ResultWarning("load on a single element", part.name, text)
            case PrescribedDisplacement() as given if has_fields(given):
                kind, at = "displacement", partial(_given_at, given)
            case Contact(obstacle=Gap(value=value)) if callable(value):
                kind, at = "gap", partial(_gap_at, value)
            case _:
                continue
        for place in _jumps_on(body.mesh, elements, at):
            remedy = f"the part there into parts, each with a {kind} of its own"
            yield _named(kind, part.name, f"Part {part.name!r}: the {kind}", place, body.mesh.diameter, remedy)


def _given_at(given: PrescribedDisplacement, points: FloatArray, normals: FloatArray) -> FloatArray:
    return given.at(points)


def gap_jumps(solution: SolvedScene) -> Iterator[ResultWarning]:
    """Warn of gaps that listed contacts add and that jump inside an element of the side with the nodes."""
    for pair in solution.scene.contacts:
        if callable(pair.gap) and pair.name in solution.contact_sides:
            side = solution.contact_sides[pair.name][0]
            mesh = solution.bodies[side.body].mesh
            for place in _jumps_on(mesh, mesh.part(side.part), partial(_gap_at, pair.gap)):
                remedy = "the sides there into parts, each with a contact and a gap of its own"
                yield _named("gap", pair.name, f"Contact {pair.name!r}: the gap", place, mesh.diameter, remedy)


def _gap_at(gap: ScalarField, points: FloatArray, normals: FloatArray) -> FloatArray:
    values = evaluate_field(gap, points)
    return np.stack([values, np.zeros_like(values)], axis=1)


def _jumps_on(mesh: BoundaryMesh, elements: IntArray, at: TractionField) -> FloatArray:
    """Return the points (n_jumps, 2) inside elements where a field of points and normals has large jumps."""
    lengths, n_intervals = np.diff(_PLACES), _PLACES.size - 1

    def located(intervals: IntArray, share: FloatArray) -> tuple[IntArray, FloatArray]:
        number, interval = np.divmod(intervals, n_intervals)
        return elements[number], (_PLACES[interval] + share * lengths[interval])[:, None]

    def values(intervals: IntArray, share: FloatArray) -> FloatArray:
        place = located(intervals, share)
        return at(mesh.points(*place)[:, 0], mesh.normals_at(*place)[:, 0])

    everywhere = np.arange(elements.size * n_intervals)
    intervals, share, height = _jumps(values, everywhere)
    if not intervals.size:
        return np.zeros((0, 2))
    sizes = norms(values(everywhere, np.full(everywhere.size, 0.5))).reshape(-1, n_intervals)
    whole = 0.5 * float(mesh.lengths[elements] @ sizes @ lengths)
    jumping, xi = located(intervals, share)
    is_large = height * mesh.lengths[jumping] > _LEAST_SHARE * whole
    return np.asarray(mesh.points(jumping, xi)[is_large, 0])


def _jumps(values: _Values, intervals: IntArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Return which intervals have a jump, the share (n_jumps,) of their lengths where it is, and its height."""
    ends = np.zeros(intervals.size), np.ones(intervals.size)
    before, after = (values(intervals, end) for end in ends)
    whole = norms(after - before)
    asked = np.flatnonzero(whole > _CHANGE * np.maximum(norms(before), norms(after)))
    intervals, (low, high) = intervals[asked], (end[asked] for end in ends)
    at_low, at_high = before[asked], after[asked]
    for _ in range(_N_HALVINGS if asked.size else 0):
        middle = 0.5 * (low + high)
        at_middle = values(intervals, middle)
        is_in_first = norms(at_middle - at_low) >= norms(at_high - at_middle)
        low, high = np.where(is_in_first, low, middle), np.where(is_in_first, middle, high)
        at_low = np.where(is_in_first[:, None], at_low, at_middle)
        at_high = np.where(is_in_first[:, None], at_middle, at_high)
    height = norms(at_high - at_low)
    is_jump = height > 0.5 * whole[asked]
    return intervals[is_jump], low[is_jump], height[is_jump]
