"""Betti's theorem: whether tractions and displacements belong to one elastic body.

Against any state (u*, t*) of the same body without body forces, ``int t . u* = int t* . u``. With Kelvin's point forces
outside of the body as states this is the Somigliana identity, whose left side vanishes there.

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
from bemkit.results.solution import Solution
from bemkit.studies.stability.independent_check.balance import strained_displacement
from bemkit.studies.stability.independent_check.nodes import Fields

_N_OUTSIDE = 6
_AWAY = 0.8
"""Distance of sources outside from the centre, in diameters: the body ends at half of one."""


def reciprocity_mismatch(fields: Fields) -> float:
    """Return the largest mismatch of ``int t . u*`` and ``int t* . u`` over the work of their sizes.

    The sizes are those of the vectors, as if each had the direction of the other. Contact tractions act as forces on
    the nodes, all others at the quadrature points.
    """
    solution, _, boundary, nodes, scales = fields
    displacement = boundary.interpolated(strained_displacement(solution))
    points, force_points = (_with_images(solution, each, is_point=True) for each in (boundary.points, nodes.points))
    normals, displacement = (_with_images(solution, each) for each in (boundary.normals, displacement))
    loads = _with_images(solution, boundary.traction * boundary.shares[:, :, None])
    forces = _with_images(solution, nodes.acting * solution.contact.weight[:, None])
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


def _with_images(solution: Solution, field: FloatArray, *, is_point: bool = False) -> FloatArray:
    """Return a field on the whole body, images included: points are reflected, vectors change signs."""
    symmetry = solution.mesh.symmetry
    if symmetry is None:
        return field
    twice = 2.0 * np.array([symmetry.x or 0.0, symmetry.y or 0.0]) if is_point else np.zeros(2)
    signs_x, signs_y = ((1.0,) if place is None else (1.0, -1.0) for place in (symmetry.x, symmetry.y))
    images = [np.array([x, y]) for x in signs_x for y in signs_y]
    return np.concatenate([np.where(signs < 0.0, twice - field, field) for signs in images])


def _states(solution: Solution) -> Iterator[State]:
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


def _inside_of_holes(solution: Solution) -> Iterator[FloatArray]:
    """Yield the centroid of the nodes of each loop that runs clockwise, which lies inside if the hole is convex."""
    whole = solution.mesh.whole
    for loop in whole.loops:
        x, y = (whole.start[loop] - whole.centre).T
        area = float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))
        if area < 0.0:
            yield whole.start[loop].mean(axis=0)


State: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A state of stress: points (..., 2) and unit normals to displacements [m] and tractions [Pa], both (..., 2)."""


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
