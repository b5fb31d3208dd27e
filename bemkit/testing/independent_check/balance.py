"""Supports and loads as the scene gives them; balances of work: on rigid motions, of energy, and Betti's theorem.

By Betti's theorem tractions and displacements belong to one elastic body: against any state (u*, t*) of the same body
without body forces, ``int t . u* = int t* . u``. With Kelvin's point forces outside of the body as states this is the
Somigliana identity, whose left side vanishes there.

References
----------
S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, McGraw-Hill; C. A. Brebbia, J. C. F. Telles, L. C. Wrobel,
Boundary Element Techniques, Springer 1984, equations (2.18) and (2.20).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.material import Material
from bemkit.testing.independent_check.boundary import Boundary, beyond, largest, trusted_stress
from bemkit.testing.independent_check.inside import inner_work, particular_tractions, without_particular
from bemkit.testing.independent_check.nodes import Fields
from bemkit.testing.independent_check.views import BodyView

_N_OUTSIDE = 6
_AWAY = 0.8
"""Distance of sources outside from the centre, in diameters: the body ends at half of one."""
State: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A state of stress: points (..., 2) and unit normals to displacements [m] and tractions [Pa], both (..., 2)."""


def support_mismatch(fields: Fields) -> float:
    """Return the largest difference [-] of a held displacement from what is prescribed, symmetry lines included."""
    mesh, boundary, scales = fields.solution.mesh, fields.boundary, fields.scales
    displacement = fields.solution.boundary.displacement
    worst = [0.0]
    for elements, directions, values in boundary.held:
        motion = np.einsum("enc,enc->en", displacement[boundary.nodes[elements]], directions)
        worst.append(beyond(np.abs(motion - values), scales.turned, scales.length))
    if mesh.symmetry is not None and boundary.nodes.shape[1] > 1:
        across = displacement[: mesh.n_nodes][mesh.on_symmetry_lines]
        worst.append(largest(np.abs(across)) / scales.length)
    return float(np.max(worst))


def load_mismatch(fields: Fields) -> float:
    """Return the largest difference [-] of mean tractions from the loads, on loaded and on free elements."""
    solution, boundary = fields.solution, fields.boundary
    is_contact = np.zeros(solution.mesh.n_elements, bool)
    for part in solution.scene.contact_parts:
        is_contact[solution.mesh.part(part.name)] = True
    mean = np.einsum("eqc,eq->ec", boundary.traction, boundary.shares) / boundary.lengths[:, None]
    return largest(np.abs(mean - solution.boundary.traction)[~is_contact] / fields.scales.stress)


def motions_at(solution: BodyView, points: FloatArray) -> FloatArray:
    """Return the two translations and the rotation at points (..., 2), (..., 2, 3), lengths by the diameter."""
    mesh = solution.mesh
    x, y = np.moveaxis((points - mesh.centre) / mesh.diameter, -1, 0)
    zero, one = np.zeros_like(x), np.ones_like(x)
    return np.stack([np.stack([one, zero, -y], axis=-1), np.stack([zero, one, x], axis=-1)], axis=-2)


def admissible_modes_of(solution: BodyView) -> list[int]:
    """Return which of the two translations and the rotation the symmetry allows; an exterior is at rest far away."""
    mesh = solution.mesh
    if mesh.is_exterior:
        return []
    if mesh.symmetry is None:
        return [0, 1, 2]
    return [k for k, place in enumerate((mesh.symmetry.x, mesh.symmetry.y)) if place is None]


def imbalance(fields: Fields) -> float:
    """Return the work of loads and contact tractions on free rigid motions over that of all forces on the body.

    To these belong the reactions of supports, which squeeze a body by forces of any size without work on free motions.
    """
    solution, _, boundary, nodes, _ = fields
    mesh, table = solution.mesh, solution.contact
    contact = table.weight[:, None] * nodes.traction
    motions = motions_at(solution, solution.boundary.points)
    work = np.einsum("nc,ncm->m", contact, motions[nodes.nodes])
    # what the elements make of a rotation: on curved ones it is not one exactly
    interpolated = np.einsum("encm,enq->eqcm", motions[boundary.nodes], boundary.basis)
    loads = _loads(solution, boundary)
    inside = inner_work(solution, boundary)
    if solution.particular is not None:  # its tractions act on the elements as loads do, with the other sign
        missed = motions_at(solution, boundary.points) - interpolated
        acting = particular_tractions(solution, boundary) * boundary.shares[..., None]
        inside = inside + np.einsum("eqc,eqcm->m", acting, missed)
    work = work + np.einsum("eqc,eqcm->m", loads, interpolated) + inside
    size = float(np.abs(contact).sum()) + float(np.abs(loads).sum()) + trusted_stress(solution) * mesh.diameter
    size += float(np.abs(solution.boundary.traction * mesh.lengths[:, None]).sum()) + float(np.abs(inside).sum())
    free = _free_motions(solution, boundary)
    return float(np.abs(work @ free.T).max(initial=0.0)) / size if size > 0.0 else 0.0


def _loads(solution: BodyView, boundary: Boundary) -> FloatArray:
    """Return (n_elements, n_places, 2) forces [N/m] of given loads."""
    is_load = np.ones(solution.mesh.n_elements, bool)
    for part in solution.scene.parts:
        if part in solution.scene.contact_parts:
            is_load[solution.mesh.part(part.name)] = False
    for elements, _, _ in boundary.held:
        is_load[elements] = False
    return np.where(is_load[:, None], boundary.shares, 0.0)[:, :, None] * boundary.traction


def _free_motions(solution: BodyView, boundary: Boundary) -> FloatArray:
    """Return (n_free, 3) coefficients of the rigid motions that no support resists."""
    admissible = admissible_modes_of(solution)
    rows = [np.eye(3)[[mode for mode in range(3) if mode not in admissible]], np.zeros((1, 3))]
    for elements, directions, _ in boundary.held:
        motions = motions_at(solution, boundary.node_points[elements])
        rows.append(np.einsum("enc,encm->enm", directions, motions).reshape(-1, 3))
    held = np.concatenate(rows)
    _, singular, directions = np.linalg.svd(held.T @ held)
    return np.asarray(directions[singular <= 1e-12 * max(singular.max(), 1e-30)])


def negative_energy(fields: Fields) -> float:
    """Return by how much the elastic energy is negative, over the work of the sizes of tractions and strains.

    They include tractions that may be round-off, on the displacement of the whole body.
    """
    solution, scales = fields.solution, fields.scales
    size = _work_of_sizes(fields, strained_displacement(solution)) + trusted_work(fields)
    size += 1e-6 * scales.stress * scales.length * solution.mesh.diameter
    return max(-solution.energy, 0.0) / size if np.isfinite(solution.energy) else float("nan")


def energy_mismatch(fields: Fields) -> float:
    """Return the difference of the elastic energy from half the work of all external forces, over that of their sizes.

    Held components without prescribed displacement do no work; where one is prescribed, the mean reactions of elements
    give the work up to the discretisation error only, and nothing is compared; nor is it with forces or heat inside.
    """
    solution, _, boundary, nodes, _ = fields
    if solution.scene.body_forces or any(np.any(held.values != 0.0) for held in boundary.held):
        return 0.0
    displacement = solution.boundary.displacement
    contact = solution.contact.weight[:, None] * nodes.traction
    loads = _loads(solution, boundary)
    work = 0.5 * float(np.sum(contact * nodes.displacement))
    work += 0.5 * float(np.sum(loads * boundary.interpolated(displacement)))
    size = _work_of_sizes(fields, displacement) + trusted_work(fields)
    return abs(solution.energy - work) / size if size > 0.0 else 0.0


def strained_displacement(solution: BodyView, displacement: FloatArray | None = None) -> FloatArray:
    """Return nodal displacements (n_nodes, 2) [m], those of the solution unless given, without their rigid part."""
    fields = solution.boundary
    displacement = fields.displacement if displacement is None else displacement
    motions = motions_at(solution, fields.points)[:, :, admissible_modes_of(solution)].reshape(
        2 * len(fields.points), -1
    )
    rigid = np.linalg.lstsq(motions, displacement.ravel(), rcond=None)[0]
    return np.asarray(displacement - (motions @ rigid).reshape(-1, 2))


def trusted_work(fields: Fields) -> float:
    """Return the work [J/m] of tractions that may be round-off, on the motion of the whole body."""
    motion = float(np.abs(fields.solution.boundary.displacement).max())
    return trusted_stress(fields.solution) * motion * float(fields.boundary.lengths.sum())


def _work_of_sizes(fields: Fields, displacement: FloatArray) -> float:
    """Return half the work [J/m] that tractions did if each had the direction of its displacement (n_nodes, 2)."""
    solution, _, boundary, nodes, _ = fields
    motion = boundary.interpolated(displacement)
    sizes = np.hypot(boundary.traction[..., 0], boundary.traction[..., 1]) * np.hypot(motion[..., 0], motion[..., 1])
    contact = np.hypot(*nodes.traction.T) * np.hypot(*displacement[nodes.nodes].T)
    return 0.5 * float(np.sum(sizes * boundary.shares) + contact @ solution.contact.weight)


def reciprocity_mismatch(fields: Fields) -> float:
    """Return the largest mismatch of ``int t . u*`` and ``int t* . u`` over the work of their sizes.

    The sizes are those of the vectors, as if each had the direction of the other. Contact tractions act as forces on
    the nodes, all others at the quadrature points.
    """
    solution, _, boundary, nodes, scales = fields
    left, traction = without_particular(solution, boundary)
    displacement = boundary.interpolated(strained_displacement(solution, left))
    points, force_points = (_with_images(solution, each, is_point=True) for each in (boundary.points, nodes.points))
    normals, displacement = (_with_images(solution, each) for each in (boundary.normals, displacement))
    loads = _with_images(solution, traction * boundary.shares[:, :, None])
    forces = _with_images(solution, nodes.traction * solution.contact.weight[:, None])
    shares = np.concatenate([boundary.shares] * (len(points) // len(boundary.points)))
    # what is left of a rigid motion a million times longer is round-off
    moved = 1e-6 * float(np.abs(solution.boundary.displacement).max())
    worst = 0.0
    for state in _states(solution):
        test_displacement, test_traction = state(points, normals)
        at_forces, _ = state(force_points, force_points)
        work = float(np.sum(loads * test_displacement) + np.sum(forces * at_forces))
        other_work = float(np.sum(np.sum(test_traction * displacement, axis=-1) * shares))
        size = max(
            float(np.sum(_length(loads) * _length(test_displacement)) + _length(forces) @ _length(at_forces)),
            float(np.sum((_length(displacement) + moved) * _length(test_traction) * shares)),
            1e-6 * scales.stress * float(np.sum(_length(test_displacement) * shares)),
        )
        worst = max(worst, abs(work - other_work) / size) if size > 0.0 else worst
    return worst


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def _with_images(solution: BodyView, field: FloatArray, *, is_point: bool = False) -> FloatArray:
    """Return a field on the whole body, images included: points are reflected, vectors change signs."""
    symmetry = solution.mesh.symmetry
    if symmetry is None:
        return field
    twice = 2.0 * np.array([symmetry.x or 0.0, symmetry.y or 0.0]) if is_point else np.zeros(2)
    signs_x, signs_y = ((1.0,) if place is None else (1.0, -1.0) for place in (symmetry.x, symmetry.y))
    images = [np.array([x, y]) for x in signs_x for y in signs_y]
    return np.concatenate([np.where(signs < 0.0, twice - field, field) for signs in images])


def _states(solution: BodyView) -> Iterator[State]:
    mesh, material = solution.mesh, solution.scene.material
    holes = list(_inside_of_holes(solution))
    for hole in holes:
        yield centre_of_dilatation(hole, material)
    if mesh.is_exterior:  # uniform stresses and single forces do not vanish at infinity
        return
    for stress in ([[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]):
        yield uniform_stress(material.shear_modulus * np.array(stress), mesh.centre, material)
    angles = 2.0 * np.pi * np.arange(_N_OUTSIDE) / _N_OUTSIDE
    around = mesh.centre + _AWAY * mesh.diameter * np.column_stack([np.cos(angles), np.sin(angles)])
    for source in [*around, *holes]:
        for direction in np.eye(2):
            yield point_force(source, direction, mesh.diameter, material)


def _inside_of_holes(solution: BodyView) -> Iterator[FloatArray]:
    """Yield the centroid of the nodes of each loop that runs clockwise, which lies inside if the hole is convex."""
    whole = solution.mesh.whole
    for loop in whole.loops:
        x, y = (whole.start[loop] - whole.centre).T
        area = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        if area < 0.0:
            yield whole.start[loop].mean(axis=0)


def point_force(source: FloatArray, direction: FloatArray, length: float, material: Material) -> State:
    """Return Kelvin's solution for a unit force [N/m] at a source point, with log(r / length)."""
    mu, nu, e = material.shear_modulus, material.effective_poisson_ratio, direction

    def state(points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        offset = points - source
        r = np.hypot(offset[..., 0], offset[..., 1])[..., None]
        unit = offset / r
        along, slope = (unit @ e)[..., None], np.sum(unit * normals, axis=-1, keepdims=True)
        displacement = ((4.0 * nu - 3.0) * np.log(r / length) * e + unit * along) / (8.0 * np.pi * mu * (1.0 - nu))
        turned = (1.0 - 2.0 * nu) * (normals * along - unit * (normals @ e)[..., None])
        traction = slope * ((1.0 - 2.0 * nu) * e + 2.0 * unit * along) - turned
        return displacement, -traction / (4.0 * np.pi * (1.0 - nu) * r)

    return state


def centre_of_dilatation(source: FloatArray, material: Material) -> State:
    """Return the state with the displacement r / |r|^2 [m], which changes no volume and so knows no bulk modulus."""

    def state(points: FloatArray, normals: FloatArray) -> tuple[FloatArray, FloatArray]:
        offset = points - source
        square = np.sum(offset**2, axis=-1, keepdims=True)
        slope = np.sum(offset * normals, axis=-1, keepdims=True)
        return offset / square, 2.0 * material.shear_modulus * (normals / square - 2.0 * offset * slope / square**2)

    return state


def uniform_stress(stress: FloatArray, centre: FloatArray, material: Material) -> State:
    """Return the state of a uniform stress (2, 2) [Pa] that has no displacement at the centre."""
    strain = (stress - material.effective_poisson_ratio * np.trace(stress) * np.eye(2)) / (2.0 * material.shear_modulus)
    return lambda points, normals: ((points - centre) @ strain, normals @ stress)
