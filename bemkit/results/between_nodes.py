"""Violations of the contact conditions between the nodes, where no equation enforces them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.contact_nodes import contact_frame
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.geometry.local_values import from_own_nodes
from bemkit.geometry.neighbours import along_boundary
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.vectors import norms
from bemkit.results.contact_table import ContactTable, free_contacts
from bemkit.results.least_clearance import PointsBetween, Sample, deepest
from bemkit.results.solved_body import SolvedBody

AddedGap: TypeAlias = Callable[[FloatArray], FloatArray]
"""Points (n, 2) [m] -> what is added to the distance there (n,) [m]."""
_POINTS_PER_NODE = 4
"""Sample points for each node of an element. Between them a polynomial exceeds its largest sample by a few per cent at
most."""
_NOWHERE = (float("nan"), float("nan"))
_NUMBERS = ("penetration", "tension", "complementarity", "cone_excess", "penetration_depth")
_ROUND_OFF = 64.0 * float(np.finfo(float).eps)
"""Round-off of clearances, which are differences of coordinates, relative to the largest coordinate."""
LARGEST_MISSED = 0.05
"""Largest overlap at the end of a contact zone inside an element, at points without traction, relative to the
displacement by contact forces."""
LARGEST_OVERLAP = 3.0
"""A larger overlap anywhere, relative to the same displacement, shows that the nodes do not find the contact. Two
constant elements beside the lowest point of a coarse ring overlap by 1.2 times that displacement, and their force is
right to 4 %."""
_FREE_ROUND_OFF = 1e-12
"""Overlap that may be round-off, for bodies without any contact force, relative to their displacement."""


@dataclass(frozen=True)
class BetweenNodes:
    """Largest violation of each contact condition at points between the nodes; zero without violation.

    Names and signs are those of `bemkit.contact.certificate.Certificate`, which measures the nodes. These violations
    are errors of the discretisation: they fall as elements become smaller or their degree higher. The opposition of
    slip is measured at nodes only.

    Parameters
    ----------
    penetration : float
        ``u_n - g`` where positive, relative to the displacement that the contact force causes, ``force / E'``.
    tension : float
        ``sigma_n`` where positive, relative to the largest contact traction.
    complementarity : float
        The smaller of traction and distance, both relative, where both exist.
    cone_excess : float
        ``|sigma_t| - bound(sigma_n)`` where positive, relative to the largest contact traction.
    penetration_depth : float [m]
        ``u_n - g`` where positive, and more than round-off of coordinates.
    place : tuple of float, optional
        The point of the boundary where that is.
    missed : float
        The penetration apart from contact zones, where contact is missed, beyond the steps of constant elements.
    missed_place : tuple of float, optional
        The point of the boundary where that is.
    apart : float
        The least distance of the sides, relative to the same displacement, where they touch nowhere.
    has_forces : bool
        Whether contact forces act on the bodies, here or elsewhere; without any the relative displacement is the
        largest one.
    """

    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    penetration_depth: float
    place: tuple[float, float] = _NOWHERE
    missed: float = 0.0
    missed_place: tuple[float, float] = _NOWHERE
    apart: float = 0.0
    has_forces: bool = True

    @property
    def violations(self) -> dict[str, float]:
        """The relative violations by name."""
        return {name: value for name, value in self.as_dict().items() if name != "penetration_depth"}

    @property
    def worst(self) -> float:
        """The largest relative violation; ``nan`` if any is."""
        return float(np.max(list(self.violations.values())))

    def as_dict(self) -> dict[str, float]:
        """Return the violations and the depth by name."""
        return {name: getattr(self, name) for name in _NUMBERS}

    @classmethod
    def largest(cls, measured: Iterable[BetweenNodes]) -> BetweenNodes | None:
        """Return the largest of each violation, without places; None if `measured` is empty."""
        rows = [list(violations.as_dict().values()) for violations in measured]
        return cls(*np.max(rows, axis=0).tolist()) if rows else None


class MeasuredContact(NamedTuple):
    """A contact, the elastic bodies that it joins, its law, and what measures points of it."""

    name: str
    bodies: tuple[str, ...]
    law: FrictionLaw
    measure: Callable[[], PointsBetween]


def sample_at_obstacle(
    body: SolvedBody,
    obstacle: Obstacle,
    elements: IntArray,
    gap: AddedGap | None = None,
    shift: Callable[[FloatArray], FloatArray] | None = None,
) -> Sample:
    """Return the function that measures clearance and tractions on elements (m,) that face a rigid obstacle.

    Parameters
    ----------
    body : SolvedBody
    obstacle : Obstacle
    elements : (m,) int array
    gap : callable, optional
        Points (n, 2) -> what is added to the distance (n,) [m]; nothing by default.
    shift : callable, optional
        Points (n, 2) -> displacements (n, 2) [m] of the obstacle there; none by default.
    """
    mesh = body.mesh
    elements = along_boundary(mesh, elements)
    xi, lengths = points_between(_degree(body)), mesh.lengths[elements]
    starts = np.cumsum(lengths) - lengths

    def sample(pieces: IntArray, low: FloatArray, high: FloatArray) -> PointsBetween:
        chosen, at = elements[pieces], 0.5 * (low + high)[:, None] + 0.5 * (high - low)[:, None] * xi
        points = mesh.points(chosen, at).reshape(-1, 2)
        distance, directions = measure_contact(obstacle, points, mesh.normals_at(chosen, at).reshape(-1, 2))
        fields, frame = Interpolation.at(body, chosen, at), contact_frame(directions)
        moved = fields.displacement(body).reshape(-1, 2) - (0.0 if shift is None else shift(points))
        u_n, _ = np.einsum("nkc,nc->kn", frame, moved)
        sigma_n, sigma_t = np.einsum("nkc,nc->kn", frame, fields.traction(body).reshape(-1, 2))
        s = starts[pieces, None] + 0.5 * lengths[pieces, None] * (at + 1.0)
        added = 0.0 if gap is None else gap(points)
        clearance, step = added + distance - u_n, fields.step(body).ravel()
        return PointsBetween(points, s.ravel(), directions, clearance, sigma_n, sigma_t, step)

    return sample


def _degree(body: SolvedBody) -> int:
    return body.scene.discretisation.displacement_space(body.mesh).degree


@dataclass(frozen=True, eq=False)
class Interpolation:
    """Interpolation of the fields of a body, and of its copies, at points (m, q) of elements (m,).

    Parameters
    ----------
    elements : (m,) int array
    dofs : (m, n_local) int array
        Of the displacements.
    of_displacement, of_traction : (m, q, n_local) arrays
    """

    elements: IntArray
    dofs: IntArray
    of_displacement: FloatArray
    of_traction: FloatArray

    @classmethod
    def at(cls, body: SolvedBody, elements: IntArray, xi: FloatArray) -> Interpolation:
        """Return the interpolation at local coordinates xi (m, q) of elements (m,) of a body."""
        discretisation, mesh = body.scene.discretisation, body.mesh
        displacements, tractions = discretisation.displacement_space(mesh), discretisation.traction_space(mesh)
        dofs = displacements.element_dofs[elements]
        unit = np.broadcast_to(np.eye(dofs.shape[1]), (*dofs.shape, dofs.shape[1]))
        of_displacement = _basis(displacements, xi) @ from_own_nodes(displacements, unit, elements)
        return cls(elements, dofs, of_displacement, _basis(tractions, xi))

    def displacement(self, body: SolvedBody) -> FloatArray:
        """Return displacements (m, q, 2) [m]."""
        return np.asarray(self.of_displacement @ body.boundary.displacement[self.dofs])

    def step(self, body: SolvedBody) -> FloatArray:
        """Return half of the largest jump (m, q) [m] of constant elements to a neighbour; zero of other elements."""
        mesh, steps = body.mesh, np.zeros(body.mesh.n_elements)
        if self.dofs.shape[1] == 1:
            before, after = mesh.node_elements[(mesh.node_elements >= 0).all(axis=1)].T
            jumps = 0.5 * norms(body.boundary.displacement[after] - body.boundary.displacement[before])
            for elements in (before, after):
                np.maximum.at(steps, elements, jumps)
        return np.broadcast_to(steps[self.elements, None], self.of_traction.shape[:2])

    def traction(self, body: SolvedBody) -> FloatArray:
        """Return tractions (m, q, 2) [Pa]."""
        at_nodes = body.boundary.traction_dofs.reshape(body.mesh.n_elements, -1, 2)
        return np.asarray(self.of_traction @ at_nodes[self.elements])


def _basis(space: BoundarySpace, xi: FloatArray) -> FloatArray:
    """Return the local basis (m, q, n_local) at xi (m, q)."""
    return space.basis(xi.ravel()).reshape(-1, *xi.shape).transpose(1, 2, 0)


def law_between(
    law: FrictionLaw, values: PointsBetween, contact: ContactTable, name: str, motion: SlipHistory | None
) -> FrictionLaw:
    """Return the law of a contact of the table at points between its nodes."""
    law = law.at(values.points)
    if motion is None or not law.needs_history:
        return law
    rows = np.flatnonzero(contact.rows(name))
    rows = rows[np.argsort(contact.s[rows])]
    slip, last = (np.interp(values.s, contact.s[rows], nodal[rows]) for nodal in (motion.slip, motion.last_slip))
    return law.at_slip(SlipHistory(motion.time, motion.time_step, slip, last))


def violations_at(values: PointsBetween, law: FrictionLaw, stress: float, length: float) -> BetweenNodes:
    """Measure violations relative to a stress [Pa] and a length [m]."""
    bound = law.bound(np.minimum(values.sigma_n, 0.0))
    # friction given across the gap is not a sign of contact
    shear = 0.0 if law.acts_across_gap else np.abs(values.sigma_t)
    traction = np.maximum(np.abs(values.sigma_n), shear) / stress
    round_off = _ROUND_OFF * _largest(np.abs(values.points))
    (depth, place), (missed_depth, missed_place) = (
        (0.0 if depth <= round_off else depth, (float(point[0]), float(point[1])))
        for depth, point in (deepest(values), deepest(values.beyond_zones()))
    )
    return BetweenNodes(
        penetration=depth / length,
        tension=_largest(values.sigma_n) / stress,
        complementarity=_largest(np.minimum(traction, np.abs(values.clearance) / length)),
        cone_excess=_largest(np.abs(values.sigma_t) - bound) / stress,
        penetration_depth=depth,
        place=place,
        missed=missed_depth / length,
        missed_place=missed_place,
        apart=max(float(values.clearance.min()), 0.0) / length if values.clearance.size else 0.0,
    )


def missed_contacts(table: ContactTable, measured: Mapping[str, BetweenNodes]) -> dict[str, tuple[float, float]]:
    """Return the points where the nodes do not find the contact, by contact.

    For bodies without contact force every overlap above round-off counts. For others an overlap counts above a share of
    the displacement by contact forces where there is no traction, and above a multiple of it where there is.
    """
    free, missed = free_contacts(table), {}
    for name, each in measured.items():
        if name in free and each.penetration > (LARGEST_MISSED if each.has_forces else _FREE_ROUND_OFF):
            missed[name] = each.place
        elif name not in free and each.missed > LARGEST_MISSED:
            missed[name] = each.missed_place
        elif name not in free and each.penetration > LARGEST_OVERLAP:
            missed[name] = each.place
    return missed


def unfound_contacts(table: ContactTable, measured: Mapping[str, BetweenNodes]) -> dict[str, tuple[float, float]]:
    """Return the missed contacts without force, and those that overlap by far more than their displacement."""
    free = free_contacts(table)
    return {
        name: place
        for name, place in missed_contacts(table, measured).items()
        if name in free or measured[name].penetration > LARGEST_OVERLAP
    }


def points_between(degree: int) -> FloatArray:
    """Return Chebyshev points of [-1, 1], dense at the ends like the nodes; ends and middle are among them."""
    n = _POINTS_PER_NODE * (degree + 1) + 1
    return -np.cos(np.pi * np.arange(n) / (n - 1))


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max(initial=0.0))
