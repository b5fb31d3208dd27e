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
from bemkit.operators.rigid import possible_motions
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
    Tractions are measured by the largest traction on the boundary, but by no less than their round-off is worth, see
    `_trusted_stress`. Lengths are measured by the displacement that this traction causes across the body, ``stress *
    diameter / E'``; what is left of rigid motions a million times longer is round-off. If there are no tractions at
    all, as in a body that has given way to an overlap, its displacement is the only length there is.
    """
    table = solution.contact
    stress, length = _scales(solution)
    normals = _contact_normals(solution)
    pressure, clearance = -table.sigma_n / stress, table.clearance / length
    # Friction given across the gap is no sign of contact. A node that is held by less than it is away counts as open
    # (its complementarity says by how much): whether cohesion acts shall not depend on a traction of 1e-16.
    held = np.maximum(np.abs(pressure), np.where(_acts_across_gap(solution), 0.0, np.abs(table.sigma_t) / stress))
    bound = _friction_bound(solution, held > np.abs(clearance)) / stress
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
    table = solution.contact
    tractions = [float(np.abs(each).max()) for each in (solution.boundary.traction, table.sigma_n, table.sigma_t)]
    trusted = _trusted_stress(solution)
    stress = max(*tractions, trusted)
    length = max(stress / modulus * diameter, 1e-6 * displacement)
    if max(tractions) <= CONTACT_LIMIT * trusted:  # the body has only moved: a hundredth of that, to be strict
        length = max(length, 1e-2 * displacement)
    return stress or 1.0, length or 1.0


def _trusted_stress(solution: Solution) -> float:
    """Return the stress [Pa] whose `CONTACT_LIMIT`-th part is the round-off of tractions: the least to measure by.

    Numbers hold a displacement to some eps of its size. Across a contact node of length h that is the strain
    ``eps |u| / h``, times E' a stress, which a bulk modulus beyond E' multiplies. A body that only moves, say because
    an overlap has pushed it aside, has no tractions but these. Tiny elements and nearly incompressible bodies are no
    excuse for tractions beyond 1e-10 of those by which the displacement would strain the whole body.
    """
    material, diameter = solution.scene.material, solution.mesh.diameter
    freedom = 1.0 if material.is_incompressible else 1.0 - 2.0 * material.effective_poisson_ratio
    digits = 64.0 * np.finfo(float).eps * diameter / (float(solution.contact.weight.min()) * freedom)
    strain = float(np.abs(solution.boundary.displacement).max()) / diameter
    return min(digits / CONTACT_LIMIT, 1e-4) * strain * material.plane_modulus


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


def _friction_bound(solution: Solution, is_closed: BoolArray) -> FloatArray:
    """Return the bound [Pa] at the present pressures; zero at open nodes, unless the law acts there too."""
    law = _law(solution)
    bound = law.bound(np.minimum(solution.contact.sigma_n, 0.0))
    return np.where(is_closed | np.asarray(law.acts_across_gap), bound, 0.0)


def _imbalance(solution: Solution, normals: FloatArray) -> float:
    """Return the work of loads and contact tractions on free rigid motions over that of all forces on the body.

    To these belong the reactions of supports, which squeeze a body by forces of any size without work on free motions.
    """
    mesh, table = solution.mesh, solution.contact
    free = _free_motions(solution)
    tangents = np.column_stack([-normals[:, 1], normals[:, 0]])
    contact = table.weight[:, None] * (table.sigma_n[:, None] * normals + table.sigma_t[:, None] * tangents)
    work = contact.ravel() @ _motions(mesh, np.column_stack([table.x, table.y])).reshape(-1, 3)
    size = float(np.abs(contact).sum()) + _trusted_stress(solution) * mesh.diameter
    size += float(np.abs(solution.boundary.traction * mesh.lengths[:, None]).sum())
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
    rows = [np.eye(3)[[motion for motion in range(3) if motion not in possible_motions(mesh)]], np.zeros((1, 3))]
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
    # shear is not symmetric: about a symmetry line the images answer it with the opposite sign
    shear = ([[0, 1], [1, 0]], [[0, 1], [1, 0]])
    for strain, unit in states if mesh.symmetry else (*states, shear):
        given = np.einsum("nc,nqc,nq->nq", boundary.traction, places @ np.array(strain), shares)
        traction = 2.0 * material.shear_modulus * normals @ np.array(unit)
        answer = np.einsum("nqc,nqc,nq->nq", traction, displacement, shares)
        size = max(np.abs(given).sum(), np.abs(answer).sum(), 1e-6 * stress * mesh.lengths.sum())
        worst = max(worst, abs(float((given - answer).sum())) / float(size))
    return worst


def _displacement_at(solution: Solution, xi: FloatArray) -> FloatArray:
    """Return (n_elements, n_xi, 2) displacements [m] without their rigid part, which uniform stresses do not see."""
    mesh, boundary = solution.mesh, solution.boundary
    possible = list(possible_motions(mesh))
    motions = _motions(mesh, boundary.points)[:, :, possible].reshape(2 * len(boundary.points), len(possible))
    rigid = np.linalg.lstsq(motions, boundary.displacement.ravel(), rcond=None)[0]
    displacement = boundary.displacement - (motions @ rigid).reshape(-1, 2)
    space = solution.scene.discretisation.displacement_space(mesh)
    return np.asarray(np.einsum("enc,nq->eqc", displacement[space.element_dofs], space.basis(xi)))


def _largest(values: FloatArray) -> float:
    return float(np.max(np.maximum(values, 0.0), initial=0.0))
