"""Balance of forces and moments, and of energy and work."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.results.solution import Solution
from bemkit.studies.stability.independent_check.boundary import Boundary
from bemkit.studies.stability.independent_check.nodes import Nodes
from bemkit.studies.stability.independent_check.scales import Scales, trusted_stress
from bemkit.studies.stability.independent_check.supports import held_directions


def motions_at(solution: Solution, points: FloatArray) -> FloatArray:
    """Return the two translations and the rotation at points (..., 2), (..., 2, 3), lengths by the diameter."""
    mesh = solution.mesh
    x, y = np.moveaxis((points - mesh.centre) / mesh.diameter, -1, 0)
    zero, one = np.zeros_like(x), np.ones_like(x)
    return np.stack([np.stack([one, zero, -y], axis=-1), np.stack([zero, one, x], axis=-1)], axis=-2)


def admissible_modes_of(solution: Solution) -> list[int]:
    """Return which of the two translations and the rotation the symmetry allows; an exterior is at rest far away."""
    mesh = solution.mesh
    if mesh.is_exterior:
        return []
    if mesh.symmetry is None:
        return [0, 1, 2]
    return [k for k, place in enumerate((mesh.symmetry.x, mesh.symmetry.y)) if place is None]


def imbalance(solution: Solution, boundary: Boundary, nodes: Nodes, traction: FloatArray) -> float:
    """Return the work of loads and contact tractions on free rigid motions over that of all forces on the body.

    To these belong the reactions of supports, which squeeze a body by forces of any size without work on free motions.

    Parameters
    ----------
    traction : (n_elements, n_places, 2) array [Pa]
        At the quadrature points; contact and supports are left to nodal forces.
    """
    mesh, table = solution.mesh, solution.contact
    contact = table.weight[:, None] * nodes.acting
    motions = motions_at(solution, solution.boundary.points)
    work = np.einsum("nc,ncm->m", contact, motions[nodes.nodes])
    # what the elements make of a rotation: on curved ones it is not one exactly
    interpolated = np.einsum("encm,nq->eqcm", motions[boundary.nodes], boundary.basis)
    loads = _loads(solution, boundary, traction)
    work = work + np.einsum("eqc,eqcm->m", loads, interpolated)
    size = float(np.abs(contact).sum()) + float(np.abs(loads).sum()) + trusted_stress(solution) * mesh.diameter
    size += float(np.abs(solution.boundary.traction * mesh.lengths[:, None]).sum())
    free = _free_motions(solution, boundary)
    return float(np.abs(work @ free.T).max(initial=0.0)) / size if size > 0.0 else 0.0


def _loads(solution: Solution, boundary: Boundary, traction: FloatArray) -> FloatArray:
    """Return (n_elements, n_places, 2) forces [N/m] of given loads."""
    is_load = np.ones(solution.mesh.n_elements, bool)
    for part in solution.scene.parts:
        if part in solution.scene.contact_parts:
            is_load[solution.mesh.part(part.name)] = False
    for elements, _, _ in held_directions(solution, boundary):
        is_load[elements] = False
    return np.where(is_load[:, None], boundary.shares, 0.0)[:, :, None] * traction


def _free_motions(solution: Solution, boundary: Boundary) -> FloatArray:
    """Return (n_free, 3) coefficients of the rigid motions that no support resists."""
    admissible = admissible_modes_of(solution)
    rows = [np.eye(3)[[mode for mode in range(3) if mode not in admissible]], np.zeros((1, 3))]
    for elements, directions, _ in held_directions(solution, boundary):
        motions = motions_at(solution, boundary.node_points[elements])
        rows.append(np.einsum("enc,encm->enm", directions, motions).reshape(-1, 3))
    held = np.concatenate(rows)
    _, singular, directions = np.linalg.svd(held.T @ held)
    return np.asarray(directions[singular <= 1e-12 * max(singular.max(), 1e-30)])


def negative_energy(
    solution: Solution, boundary: Boundary, nodes: Nodes, traction: FloatArray, scales: Scales
) -> float:
    """Return by how much the elastic energy is negative, over the work of the sizes of tractions and strains.

    To these belong the tractions of which nothing but round-off is known, on the displacement of the whole body.
    """
    size = _work_of_sizes(solution, boundary, nodes, traction, strained_displacement(solution))
    size += _trusted_work(solution, boundary)
    size += 1e-6 * scales.stress * scales.length * solution.mesh.diameter
    return max(-solution.energy, 0.0) / size if np.isfinite(solution.energy) else float("nan")


def energy_mismatch(solution: Solution, boundary: Boundary, nodes: Nodes, traction: FloatArray) -> float:
    """Return the difference of the elastic energy from half the work of all external forces, over that of their sizes.

    Held components without prescribed displacement do no work; where one is prescribed, the mean reactions of elements
    tell the work up to the discretisation error only, and nothing is compared.
    """
    if any(np.any(values != 0.0) for _, _, values in held_directions(solution, boundary)):
        return 0.0
    displacement = solution.boundary.displacement
    contact = solution.contact.weight[:, None] * nodes.acting
    loads = _loads(solution, boundary, traction)
    work = 0.5 * float(np.sum(contact * nodes.displacement))
    work += 0.5 * float(np.sum(loads * boundary.interpolated(displacement)))
    size = _work_of_sizes(solution, boundary, nodes, traction, displacement) + _trusted_work(solution, boundary)
    return abs(solution.energy - work) / size if size > 0.0 else 0.0


def strained_displacement(solution: Solution) -> FloatArray:
    """Return the nodal displacements (n_nodes, 2) [m] without their rigid part."""
    fields = solution.boundary
    motions = motions_at(solution, fields.points)[:, :, admissible_modes_of(solution)].reshape(
        2 * len(fields.points), -1
    )
    rigid = np.linalg.lstsq(motions, fields.displacement.ravel(), rcond=None)[0]
    return np.asarray(fields.displacement - (motions @ rigid).reshape(-1, 2))


def _trusted_work(solution: Solution, boundary: Boundary) -> float:
    """Return the work [J/m] of tractions of which nothing but round-off is known, on the motion of the whole body."""
    motion = float(np.abs(solution.boundary.displacement).max())
    return trusted_stress(solution) * motion * float(boundary.lengths.sum())


def _work_of_sizes(
    solution: Solution, boundary: Boundary, nodes: Nodes, traction: FloatArray, displacement: FloatArray
) -> float:
    """Return half the work [J/m] that tractions did if each had the direction of its displacement (n_nodes, 2)."""
    motion = boundary.interpolated(displacement)
    sizes = np.hypot(traction[..., 0], traction[..., 1]) * np.hypot(motion[..., 0], motion[..., 1])
    contact = np.hypot(*nodes.acting.T) * np.hypot(*displacement[nodes.nodes].T)
    return 0.5 * float(np.sum(sizes * boundary.shares) + contact @ solution.contact.weight)
