"""An independent check of a solution, from its own tables: no stiffness matrix, no active sets, no driver.

Only the physical fields of a `Solution` and the statement of its scene are read. Whatever the drivers believe, these
numbers say whether the fields obey contact and friction, whether all forces balance, and whether tractions and
displacements belong to one elastic body.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.contact.laws import FrictionLaw
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.quadrature import gauss_legendre
from bemkit.scene import Clamped, ConstantCollocation, Contact, PrescribedDisplacement, Pressure, Roller, Traction
from bemkit.solution import Solution

CONTACT_LIMIT = 1e-6
"""Largest violation of contact, friction and equilibrium in a right answer. Drivers stop at 1e-9 of a traction that may
be hundreds of times that of the answer (that of the body held everywhere)."""

RECIPROCITY_LIMIT = 0.1
"""Largest share of work out of balance in the reciprocal theorem: the discretisation error of a coarse mesh, far below
that of fields which do not belong to the body at all."""


@dataclass(frozen=True)
class Evidence:
    """Violations found in the fields of a solution, dimensionless; zero is perfect.

    Parameters
    ----------
    obstacle : float
        Gap of the table against the gap measured again, beyond the round-off of the coordinates.
    penetration, tension, complementarity : float
        Of normal contact: the smaller of pressure and clearance where both exist.
    cone_excess, slip_opposition : float
        Of friction: traction beyond the bound; the smaller of slip and missing opposition.
    equilibrium : float
        Work of loads and contact tractions on the rigid motions that no support holds.
    reciprocity : float
        Betti's theorem against the three states of uniform strain; holds up to the discretisation error.
    """

    obstacle: float
    penetration: float
    tension: float
    complementarity: float
    cone_excess: float
    slip_opposition: float
    equilibrium: float
    reciprocity: float

    @property
    def worst(self) -> float:
        """The largest entry that must vanish to round-off; nan if any entry is."""
        return float(np.max([value for name, value in asdict(self).items() if name != "reciprocity"]))

    @property
    def is_good(self) -> bool:
        """Whether the fields obey contact, friction and equilibrium."""
        return self.worst <= CONTACT_LIMIT

    @property
    def is_coarse(self) -> bool:
        """Whether tractions and displacements belong to one elastic body only roughly."""
        return not self.reciprocity <= RECIPROCITY_LIMIT


def examine(solution: Solution) -> Evidence:
    """Check the fields of a solution; see `Evidence`.

    Parameters
    ----------
    solution : Solution

    Returns
    -------
    Evidence

    Notes
    -----
    Tractions are measured by the largest traction on the boundary, lengths by the displacement that this traction
    causes across the body, ``stress * diameter / E'``; what is left of rigid motions a million times longer is
    round-off.
    """
    table = solution.contact
    stress, length = _scales(solution)
    normals = _contact_normals(solution)
    pressure, clearance = -table.sigma_n / stress, table.clearance / length
    # friction given across the gap is no sign of contact
    held = np.maximum(np.abs(pressure), np.where(_acts_across_gap(solution), 0.0, np.abs(table.sigma_t) / stress))
    bound = _friction_bound(solution, held * stress) / stress
    shear, slip = table.sigma_t / stress, table.u_t / length
    if len(solution.scene.load_factors) > 1:
        slip = np.zeros_like(slip)  # an increment, of which the last state alone cannot tell
    opposition = np.abs(shear + np.sign(slip) * bound)
    return Evidence(
        obstacle=_gap_mismatch(solution, normals) / length,
        penetration=_largest(-clearance),
        tension=_largest(-pressure),
        complementarity=_largest(np.minimum(held, np.abs(clearance))),
        cone_excess=_largest(np.abs(shear) - bound),
        slip_opposition=_largest(np.minimum(np.abs(slip), opposition)),
        equilibrium=_imbalance(solution, normals),
        reciprocity=_reciprocity(solution, stress),
    )


def _scales(solution: Solution) -> tuple[float, float]:
    """Return the traction [Pa] and the displacement [m] to measure by."""
    modulus, diameter = solution.scene.material.plane_modulus, solution.mesh.diameter
    displacement = float(np.abs(solution.boundary.displacement).max())
    at_contact = [np.abs(solution.contact.sigma_n).max(), np.abs(solution.contact.sigma_t).max()]
    stress = max(float(np.abs(solution.boundary.traction).max()), *at_contact, _avoided_stress(solution))
    length = max(stress / modulus * diameter, 1e-6 * displacement)
    return stress or 1.0, length or 1.0


def _avoided_stress(solution: Solution) -> float:
    """Return the stress [Pa] below which a body that gives way to an overlap, or only moves, has round-off alone."""
    overlap = float(np.maximum(-solution.contact.gap, 0.0).max())
    displacement = float(np.abs(solution.boundary.displacement).max())
    strain = max(1e-2 * overlap, 1e-4 * displacement) / solution.mesh.diameter
    return strain * solution.scene.material.plane_modulus


def _contact_elements(solution: Solution) -> dict[str, IntArray]:
    return {part.name: solution.mesh.part(part.name) for part in solution.scene.contact_parts}


def _contact_normals(solution: Solution) -> FloatArray:
    """Return (n_contact, 2) outward normals: of the element, or the mean by length of the elements that meet."""
    mesh, table = solution.mesh, solution.contact
    elements = np.concatenate(list(_contact_elements(solution).values()))
    points = np.column_stack([table.x, table.y])
    xi = np.zeros(1) if isinstance(solution.scene.discretisation, ConstantCollocation) else np.array([-1.0, 0.0, 1.0])
    places = mesh.points(elements, xi).reshape(-1, 2)
    normals = mesh.normals_at(elements, xi).reshape(-1, 2)
    lengths = np.repeat(mesh.lengths[elements], xi.size)
    from scipy.spatial import cKDTree

    nearest = np.asarray(cKDTree(points).query(places)[1])
    round_off = 8.0 * np.finfo(float).eps * np.abs(places).max()
    is_own = np.hypot(*(points[nearest] - places).T) <= 1e-6 * lengths + round_off
    total = np.zeros_like(points)
    np.add.at(total, nearest[is_own], (normals * lengths[:, None])[is_own])
    return np.asarray(total / np.hypot(total[:, 0], total[:, 1])[:, None])


def _gap_mismatch(solution: Solution, normals: FloatArray) -> float:
    """Return the largest difference of gaps [m] beyond the round-off of the coordinates."""
    table = solution.contact
    points = np.column_stack([table.x, table.y])
    measured = np.full(table.n_contact, np.inf)
    for part in solution.scene.contact_parts:
        # a node where two contact parts meet sees the nearer obstacle
        own = np.array([name == part.name for name in table.part])
        if isinstance(part.condition, Contact) and own.any():
            measured[own] = np.minimum(measured[own], part.condition.obstacle.gap(points[own], normals[own]))
    is_known = np.isfinite(measured) & np.isfinite(table.gap)
    nearer = np.maximum(table.gap[is_known] - measured[is_known], 0.0)
    if len(solution.scene.contact_parts) == 1:
        nearer = np.abs(table.gap[is_known] - measured[is_known])
    round_off = 64.0 * np.finfo(float).eps * (np.abs(points).max() + np.abs(measured[is_known]).max(initial=0.0))
    return max(_largest(nearer) - float(round_off), 0.0)


def _acts_across_gap(solution: Solution) -> BoolArray:
    return np.asarray(_law(solution).acts_across_gap)


def _law(solution: Solution) -> FrictionLaw:
    table = solution.contact
    return solution.scene.law_at(table.part, np.column_stack([table.x, table.y]))


def _friction_bound(solution: Solution, held: FloatArray) -> FloatArray:
    """Return the bound [Pa] at the present pressures; zero where nothing is held, unless the law acts there too."""
    law = _law(solution)
    bound = law.bound(np.minimum(solution.contact.sigma_n, 0.0))
    return np.where((held > 0.0) | np.asarray(law.acts_across_gap), bound, 0.0)


def _imbalance(solution: Solution, normals: FloatArray) -> float:
    """Return the work of loads and contact tractions on free rigid motions over the work of their sizes."""
    mesh, table = solution.mesh, solution.contact
    free = _free_motions(solution)
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    contact = table.weight[:, None] * (table.sigma_n[:, None] * normals + table.sigma_t[:, None] * tangents)
    work = contact.ravel() @ _motions(mesh, np.column_stack([table.x, table.y])).reshape(-1, 3)
    size = float(np.abs(contact).sum()) + _avoided_stress(solution) * mesh.diameter
    xi, weights = gauss_legendre(8)
    factor = solution.scene.load_factors[-1]
    space = solution.scene.discretisation.displacement_space(mesh)
    at_nodes = _motions(mesh, solution.boundary.points)
    for part in solution.scene.parts:
        if isinstance(part.condition, Traction | Pressure):
            elements = mesh.part(part.name)
            points, shares = mesh.points(elements, xi), mesh.jacobian(elements, xi) * weights
            normals_at = mesh.normals_at(elements, xi)
            # what the elements make of a rotation: on curved ones it is not one exactly
            motions = np.einsum("encm,nq->eqcm", at_nodes[space.element_dofs[elements]], space.basis(xi))
            for k in range(xi.size):
                load = factor * shares[:, k, None] * part.condition.at(points[:, k], normals_at[:, k])
                work = work + np.einsum("ec,ecm->m", load, motions[:, k])
                size += float(np.abs(load).sum())
    return float(np.abs(work @ free.T).max(initial=0.0)) / size if size > 0.0 else 0.0


def _motions(mesh: BoundaryMesh, points: FloatArray) -> FloatArray:
    """Return the two translations and the rotation at points, (n, 2, 3), lengths by the diameter."""
    x, y = ((points - mesh.centre) / mesh.diameter).T
    zero, one = np.zeros_like(x), np.ones_like(x)
    return np.stack([np.column_stack([one, zero, -y]), np.column_stack([zero, one, x])], axis=1)


def _free_motions(solution: Solution) -> FloatArray:
    """Return (n_free, 3) coefficients of the rigid motions that no support resists."""
    mesh = solution.mesh
    if mesh.is_exterior:  # at rest at infinity
        return np.zeros((0, 3))
    rows = [np.zeros((1, 3))]
    for part in solution.scene.parts:
        elements = mesh.part(part.name)
        for xi in (-0.7, 0.3):
            place = np.array([xi])
            motions = _motions(mesh, mesh.points(elements, place)[:, 0])
            match part.condition:
                case Clamped():
                    rows.append(motions.reshape(-1, 3))
                case Roller():
                    rows.append(np.einsum("nc,ncm->nm", mesh.normals_at(elements, place)[:, 0], motions))
                case PrescribedDisplacement(is_prescribed=given):
                    rows.append(motions[:, list(given)].reshape(-1, 3))
    held = np.concatenate(rows)
    _, singular, directions = np.linalg.svd(held.T @ held)
    return np.asarray(directions[singular <= 1e-12 * max(singular.max(), 1e-30)])


def _reciprocity(solution: Solution, stress: float) -> float:
    """Return the largest mismatch of ``int t . u*`` and ``int t* . u`` over the work of their sizes.

    u* runs over the displacements of the three states of uniform stress, t* over their tractions.
    """
    mesh, boundary, material = solution.mesh, solution.boundary, solution.scene.material
    if mesh.is_exterior:  # uniform strain does not vanish at infinity
        return 0.0
    elements = np.arange(mesh.n_elements)
    xi, weights = gauss_legendre(4)
    shares = mesh.jacobian(elements, xi) * weights
    displacement = _displacement_at(solution, xi) / mesh.diameter
    places = (mesh.points(elements, xi) - mesh.centre) / mesh.diameter
    normals = mesh.normals_at(elements, xi)
    nu = material.effective_poisson_ratio
    states = (([[1 - nu, 0], [0, -nu]], [[1, 0], [0, 0]]), ([[-nu, 0], [0, 1 - nu]], [[0, 0], [0, 1]]))
    worst = 0.0
    for strain, unit in (*states, ([[0, 1], [1, 0]], [[0, 1], [1, 0]])):
        given = np.einsum("nc,nqc,nq->nq", boundary.traction, places @ np.array(strain), shares)
        traction = 2.0 * material.shear_modulus * normals @ np.array(unit)
        answer = np.einsum("nqc,nqc,nq->nq", traction, displacement, shares)
        size = max(np.abs(given).sum(), np.abs(answer).sum(), 1e-6 * stress * mesh.lengths.sum())
        worst = max(worst, abs(float((given - answer).sum())) / float(size))
    return worst


def _displacement_at(solution: Solution, xi: FloatArray) -> FloatArray:
    """Return (n_elements, n_xi, 2) displacements [m] without their rigid part, which uniform stresses do not see."""
    mesh, boundary = solution.mesh, solution.boundary
    motions = _motions(mesh, boundary.points).reshape(-1, 3)
    rigid = np.linalg.lstsq(motions, boundary.displacement.ravel(), rcond=None)[0]
    displacement = boundary.displacement - (motions @ rigid).reshape(-1, 2)
    space = solution.scene.discretisation.displacement_space(mesh)
    return np.asarray(np.einsum("enc,nq->eqc", displacement[space.element_dofs], space.basis(xi)))


def _largest(values: FloatArray) -> float:
    return float(np.max(np.maximum(values, 0.0), initial=0.0))
