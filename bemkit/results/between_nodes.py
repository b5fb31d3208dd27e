"""How far displacements and tractions violate the contact conditions between the nodes, where nobody asks for them."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import NamedTuple

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.contact.condensation.nodes import contact_frame
from bemkit.contact.laws import FrictionLaw
from bemkit.contact.obstacle import Obstacle, measure_contact
from bemkit.contact.slip_history import SlipHistory
from bemkit.geometry.local_values import values_on_elements
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.meshing.order import along_boundary
from bemkit.results.contact_table import ContactTable
from bemkit.scene.conditions import Contact
from bemkit.scene.scene import Scene

_POINTS_PER_NODE = 4
"""Points of an element for each of its nodes: between them a polynomial grows by a few per cent more at most."""


@dataclass(frozen=True)
class BetweenNodes:
    """Largest violation of each contact condition at points between the nodes; zero is perfect.

    Names and signs are those of `bemkit.contact.certificate.Certificate`, which speaks of the nodes. These violations
    are errors of the discretisation: they are not round-off, and fall when elements become smaller or their degree
    higher. The opposition of slip is left to the nodes.

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
        ``u_n - g`` where positive.
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


def violations_between_nodes(
    scene: Scene,
    mesh: BoundaryMesh,
    contact: ContactTable,
    displacement: FloatArray,
    traction_dofs: FloatArray,
    motion: SlipHistory | None = None,
) -> BetweenNodes | None:
    """Measure the displacements and tractions of a result along its contact boundary, without running anything again.

    Parameters
    ----------
    scene : Scene
        With a single load.
    mesh : BoundaryMesh
    contact : ContactTable
    displacement, traction_dofs : arrays [m], [Pa]
        As in `bemkit.results.solution.BoundaryFields`.
    motion : SlipHistory, optional
        Of the contact nodes, for laws that depend on slip or time; interpolated between them.

    Returns
    -------
    BetweenNodes or None
        None without contact nodes.

    Notes
    -----
    The gap is that of the obstacle at each point, so that the shape of both bodies between nodes counts too. Constant
    elements are measured as the steps they are. Without any contact force displacements are measured by the largest.
    """
    if not contact.n_contact:
        return None
    stress = float(np.maximum(np.abs(contact.sigma_n), np.abs(contact.sigma_t)).max()) or 1.0
    force = float(np.sum(contact.weight * np.hypot(contact.sigma_n, contact.sigma_t)))
    length = force / scene.material.plane_modulus or float(np.abs(displacement).max()) or 1.0
    with np.errstate(all="ignore"):  # results that are not finite are measured by nan
        measured = [
            _violations(
                _values(scene, part.condition.obstacle, mesh, mesh.part(part.name), displacement, traction_dofs),
                _law_between(scene, mesh, part.name, contact, motion),
                stress,
                length,
            )
            for part in scene.parts
            if isinstance(part.condition, Contact) and mesh.part(part.name).size  # none beyond a symmetry line
        ]
    return BetweenNodes(*np.max([list(each.as_dict().values()) for each in measured], axis=0).tolist())


def _law_between(
    scene: Scene, mesh: BoundaryMesh, part: str, contact: ContactTable, motion: SlipHistory | None
) -> FrictionLaw:
    """Return the law of a contact part at the points of `_values`."""
    elements, xi = mesh.part(part), _points_between(scene.discretisation.displacement_space(mesh).degree)
    law = scene.laws[part].at(mesh.points(elements, xi).reshape(-1, 2))
    if motion is None or not law.needs_history:
        return law
    ordered, begin = along_boundary(mesh, elements), np.zeros(mesh.n_elements)
    begin[ordered] = np.cumsum(mesh.lengths[ordered]) - mesh.lengths[ordered]
    s = (begin[elements, None] + 0.5 * mesh.lengths[elements, None] * (xi + 1.0)).ravel()
    rows = np.flatnonzero(contact.rows(part))
    rows = rows[np.argsort(contact.s[rows])]
    slip, last = (np.interp(s, contact.s[rows], each[rows]) for each in (motion.slip, motion.last_slip))
    return law.at_slip(SlipHistory(motion.time, motion.time_step, slip, last))


class _Values(NamedTuple):
    """What is known at (n, 2) points of a contact part; displacements and tractions in (n, t) components."""

    points: FloatArray
    clearance: FloatArray
    sigma_n: FloatArray
    sigma_t: FloatArray


def _values(
    scene: Scene,
    obstacle: Obstacle,
    mesh: BoundaryMesh,
    elements: IntArray,
    displacement: FloatArray,
    traction_dofs: FloatArray,
) -> _Values:
    discretisation = scene.discretisation
    displacements, tractions = discretisation.displacement_space(mesh), discretisation.traction_space(mesh)
    xi = _points_between(displacements.degree)
    points = mesh.points(elements, xi).reshape(-1, 2)
    gap, directions = measure_contact(obstacle, points, mesh.normals_at(elements, xi).reshape(-1, 2))
    at_nodes = values_on_elements(displacements, displacement, elements)
    motion = np.einsum("pq,epc->eqc", displacements.basis(xi), at_nodes).reshape(-1, 2)
    at_dofs = traction_dofs.reshape(mesh.n_elements, -1, 2)[elements]
    traction = np.einsum("lq,elc->eqc", tractions.basis(xi), at_dofs).reshape(-1, 2)
    sigma_n, sigma_t = np.einsum("nkc,nc->kn", contact_frame(directions), traction)
    return _Values(points, gap - np.sum(motion * directions, axis=1), sigma_n, sigma_t)


def _violations(values: _Values, law: FrictionLaw, stress: float, length: float) -> BetweenNodes:
    bound = law.bound(np.minimum(values.sigma_n, 0.0))
    # friction given across the gap is no sign of contact
    shear = 0.0 if law.acts_across_gap else np.abs(values.sigma_t)
    traction = np.maximum(np.abs(values.sigma_n), shear) / stress
    depth = _largest(-values.clearance)
    return BetweenNodes(
        penetration=depth / length,
        tension=_largest(values.sigma_n) / stress,
        complementarity=_largest(np.minimum(traction, np.abs(values.clearance) / length)),
        cone_excess=_largest(np.abs(values.sigma_t) - bound) / stress,
        penetration_depth=depth,
    )


def _points_between(degree: int) -> FloatArray:
    """Return Chebyshev points in (-1, 1), which crowd at the ends as the nodes do, the middle among them."""
    n = _POINTS_PER_NODE * (degree + 1) + 1
    return -np.cos(np.pi * (np.arange(n) + 0.5) / n)


def _largest(values: FloatArray) -> float:
    return float(np.maximum(values, 0.0).max())
