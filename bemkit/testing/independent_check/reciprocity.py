"""Betti's theorem: tractions and displacements belong to one elastic body.

Against any state (u*, t*) of the same body without body forces, ``int t . u* = int t* . u``. With Kelvin's point forces
outside of the body as states this is the Somigliana identity, whose left side vanishes there; with a turn, which needs
no tractions, the balance of moments. All hold up to the discretisation error.

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
from bemkit.results.solved_body import SolvedBody
from bemkit.testing.independent_check.bodies import MeasuredBody
from bemkit.testing.independent_check.inside import without_particular
from bemkit.testing.independent_check.motions import motions_at, strained_displacement

_N_OUTSIDE = 6
_AWAY = 0.8
"""Distance of sources outside from the centre, in diameters: the body ends at half of one."""
State: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A state of stress: points (..., 2) and unit normals to displacements [m] and tractions [Pa], both (..., 2)."""


def reciprocity_mismatch(measured: MeasuredBody) -> float:
    """Return the largest mismatch of ``int t . u*`` and ``int t* . u`` over the work of their sizes.

    The sizes are those of the vectors, as if each had the direction of the other. Half-planes, whose displacements are
    exact, have none.
    """
    body, boundary, scales = measured.solved, measured.boundary, measured.scales
    if body.mesh.surface is not None:
        return 0.0
    left, traction = without_particular(body, boundary)
    displacement = boundary.interpolated(strained_displacement(body, left))
    points = _with_images(body, boundary.points, is_point=True)
    normals, displacement = (_with_images(body, each) for each in (boundary.normals, displacement))
    forces = _with_images(body, traction * boundary.shares[:, :, None])
    shares = np.concatenate([boundary.shares] * (len(points) // len(boundary.points)))
    # what is left of a rigid motion a million times longer is round-off
    moved = 1e-6 * float(np.abs(body.boundary.displacement).max())
    worst = [0.0]
    for state in _states(body):
        test_displacement, test_traction = state(points, normals)
        work = float(np.sum(forces * test_displacement))
        other_work = float(np.sum(np.sum(test_traction * displacement, axis=-1) * shares))
        size = max(
            float(np.sum(_length(forces) * _length(test_displacement))),
            float(np.sum((_length(displacement) + moved) * _length(test_traction) * shares)),
            1e-6 * scales.stress * float(np.sum(_length(test_displacement) * shares)),
        )
        worst.append(abs(work - other_work) / size if size > 0.0 else 0.0)
    return float(np.max(worst))


def _length(vectors: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(vectors[..., 0], vectors[..., 1]))


def _with_images(body: SolvedBody, field: FloatArray, *, is_point: bool = False) -> FloatArray:
    """Return a field on the whole body, images included: points are reflected, vectors change signs."""
    symmetry = body.mesh.symmetry
    if symmetry is None:
        return field
    twice = 2.0 * np.array([symmetry.x or 0.0, symmetry.y or 0.0]) if is_point else np.zeros(2)
    signs_x, signs_y = ((1.0,) if place is None else (1.0, -1.0) for place in (symmetry.x, symmetry.y))
    images = [np.array([x, y]) for x in signs_x for y in signs_y]
    return np.concatenate([np.where(signs < 0.0, twice - field, field) for signs in images])


def _states(body: SolvedBody) -> Iterator[State]:
    mesh, material = body.mesh, body.scene.material
    holes = list(_inside_of_holes(body))
    for hole in holes:
        yield centre_of_dilatation(hole, material)
    if mesh.is_exterior:  # uniform stresses and single forces do not vanish at infinity
        return
    yield lambda points, normals: (motions_at(body, points)[..., 2], np.zeros_like(points))  # a turn: of moments
    for stress in ([[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [0.0, 1.0]], [[0.0, 1.0], [1.0, 0.0]]):
        yield uniform_stress(material.shear_modulus * np.array(stress), mesh.centre, material)
    angles = 2.0 * np.pi * np.arange(_N_OUTSIDE) / _N_OUTSIDE
    around = mesh.centre + _AWAY * mesh.diameter * np.column_stack([np.cos(angles), np.sin(angles)])
    for source in [*around, *holes]:
        for direction in np.eye(2):
            yield point_force(source, direction, mesh.diameter, material)


def _inside_of_holes(body: SolvedBody) -> Iterator[FloatArray]:
    """Yield the centroid of the nodes of each loop that runs clockwise, which lies inside if the hole is convex."""
    whole = body.mesh.whole
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
