"""Violations of the contact conditions between the nodes, where no equation enforces them."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.condensation.nodes import contact_frame
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.geometry.local_values import from_own_nodes
from bemkit.geometry.neighbours import along_boundary
from bemkit.geometry.spaces import BoundarySpace
from bemkit.results.contact_table import ContactTable
from bemkit.results.solved_body import SolvedBody
from bemkit.scene.conditions import Contact

_SAME_POINT = 1e-9
"""Distance of neighbouring points, relative to the next one, below which they are one point: the end of an element."""
_POINTS_PER_NODE = 4
"""Points on an element for each of its nodes: a polynomial is larger between them by a few per cent at most."""
_ROUND_OFF = 64.0 * float(np.finfo(float).eps)
"""Round-off of clearances, which are differences of coordinates, relative to the largest coordinate."""


@dataclass(frozen=True)
class BetweenNodes:
    """Largest violation of each contact condition at points between the nodes; zero is perfect.

    Names and signs are those of `bemkit.contact.certificate.Certificate`, which is about the nodes. These violations
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
    """

    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    penetration_depth: float

    @property
    def violations(self) -> dict[str, float]:
        """The relative violations by name."""
        return {name: value for name, value in self.as_dict().items() if name != "penetration_depth"}

    @property
    def worst(self) -> float:
        """The largest relative violation; ``nan`` if any is."""
        return float(np.max(list(self.violations.values())))

    def as_dict(self) -> dict[str, float]:
        """Return all numbers by name."""
        return asdict(self)

    @classmethod
    def largest(cls, measured: Iterable[BetweenNodes]) -> BetweenNodes | None:
        """Return the largest of each violation; None if `measured` is empty."""
        rows = [list(violations.as_dict().values()) for violations in measured]
        return cls(*np.max(rows, axis=0).tolist()) if rows else None


def violations_between_nodes(
    body: SolvedBody, contact: ContactTable, motion: SlipHistory | None = None
) -> dict[str, BetweenNodes]:
    """Measure the displacements and tractions of one body along its contact parts, without running anything again.

    Parameters
    ----------
    body : SolvedBody
    contact : ContactTable
    motion : SlipHistory, optional
        Of the contact nodes, for laws that depend on slip or time; interpolated between them.

    Returns
    -------
    dict of str to BetweenNodes
        By contact part.

    Notes
    -----
    The gap is measured at each point, so that the shape of both bodies between nodes counts too. Fields of constant
    elements are steps. Without any contact force lengths are relative to the largest displacement.
    """
    if not contact.n_contact:
        return {}
    scene, mesh = body.scene, body.mesh
    stress = float(np.maximum(np.abs(contact.sigma_n), np.abs(contact.sigma_t)).max()) or 1.0
    force = float(np.sum(contact.weight * np.hypot(contact.sigma_n, contact.sigma_t)))
    length = force / scene.material.plane_modulus or float(np.abs(body.boundary.displacement).max()) or 1.0
    violations = {}
    for part in scene.parts:
        if isinstance(part.condition, Contact) and (elements := mesh.part(part.name)).size:  # none beyond a symmetry
            with np.errstate(all="ignore"):  # results that are not finite are measured by nan
                points = points_at_obstacle(body, part.condition.obstacle, elements)
                law = law_between(scene.laws[part.name], points, contact, part.name, motion)
                violations[part.name] = violations_at(points, law, stress, length)
    return violations


class PointsBetween(NamedTuple):
    """Clearance and tractions at points of a contact, in (n, t) components.

    Parameters
    ----------
    points : (n, 2) array [m]
    s : (n,) array [m]
        Arc length from the start of the side.
    directions : (n, 2) array
        Of contact, out of the body.
    clearance : (n,) array [m]
    sigma_n, sigma_t : (n,) arrays [Pa]
    """

    points: FloatArray
    s: FloatArray
    directions: FloatArray
    clearance: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray

    def take(self, rows: BoolArray) -> PointsBetween:
        """Return some of the points."""
        return PointsBetween(*(column[rows] for column in self))


def points_at_obstacle(body: SolvedBody, obstacle: Obstacle, elements: IntArray) -> PointsBetween:
    """Return clearance and tractions at points of elements (m,) that face a rigid obstacle, before it moves."""
    mesh = body.mesh
    elements = along_boundary(mesh, elements)
    xi = points_between(body.scene.discretisation.displacement_space(mesh).degree)
    points = mesh.points(elements, xi).reshape(-1, 2)
    gap, directions = measure_contact(obstacle, points, mesh.normals_at(elements, xi).reshape(-1, 2))
    at = np.broadcast_to(xi, (elements.size, xi.size))
    lengths = mesh.lengths[elements]
    s = (np.cumsum(lengths) - lengths)[:, None] + 0.5 * lengths[:, None] * (xi + 1.0)
    fields, frame = Interpolation.at(body, elements, at), contact_frame(directions)
    u_n, _ = np.einsum("nkc,nc->kn", frame, fields.displacement(body).reshape(-1, 2))
    sigma_n, sigma_t = np.einsum("nkc,nc->kn", frame, fields.traction(body).reshape(-1, 2))
    return PointsBetween(points, s.ravel(), directions, gap - u_n, sigma_n, sigma_t)


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
    # friction given across the gap is no sign of contact
    shear = 0.0 if law.acts_across_gap else np.abs(values.sigma_t)
    traction = np.maximum(np.abs(values.sigma_n), shear) / stress
    depth = _deepest(values)
    depth = 0.0 if depth <= _ROUND_OFF * _largest(np.abs(values.points)) else depth
    return BetweenNodes(
        penetration=depth / length,
        tension=_largest(values.sigma_n) / stress,
        complementarity=_largest(np.minimum(traction, np.abs(values.clearance) / length)),
        cone_excess=_largest(np.abs(values.sigma_t) - bound) / stress,
        penetration_depth=depth,
    )


def _deepest(values: PointsBetween) -> float:
    """Return the largest penetration [m]: where the parabola through the deepest point and those beside it has its end.

    The points know a polynomial to some per cent of its range on an element. That may be all of a penetration where it
    crosses zero there.
    """
    deepest = _largest(-values.clearance)
    k = int(np.argmin(values.clearance)) if values.clearance.size else 0
    if not deepest > 0.0 or not 0 < k < values.clearance.size - 1:
        return deepest
    (before, after), clearance = np.diff(values.s[k - 1 : k + 2]), values.clearance[k - 1 : k + 2]
    if not min(before, after) > _SAME_POINT * max(before, after):  # the end of an element
        return deepest
    fall, rise = -np.diff(clearance) / (before, after)
    curvature, slope = (rise - fall) / (before + after), (fall * after + rise * before) / (before + after)
    is_between = curvature < 0.0 and -before <= -0.5 * slope / curvature <= after  # its end, off the deepest point
    return deepest - float(0.25 * slope**2 / curvature) if is_between else deepest


def points_between(degree: int) -> FloatArray:
    """Return Chebyshev points of [-1, 1], dense at the ends like the nodes; ends and middle are among them."""
    n = _POINTS_PER_NODE * (degree + 1) + 1
    return -np.cos(np.pi * np.arange(n) / (n - 1))


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max(initial=0.0))
