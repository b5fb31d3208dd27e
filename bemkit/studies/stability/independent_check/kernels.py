"""States of stress that satisfy elasticity exactly: Kelvin's point force, the centre of dilatation, uniform stress.

Each function returns displacement [m] and traction [Pa], both (..., 2), at points (..., 2) with unit normals.

References
----------
S. P. Timoshenko, J. N. Goodier, Theory of Elasticity, McGraw-Hill; C. A. Brebbia, J. C. F. Telles, L. C. Wrobel,
Boundary Element Techniques, Springer 1984, equations (2.18) and (2.20).
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.operators.material import Material

State: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]
"""A state of stress: points and normals to displacements and tractions."""


def point_force(source: FloatArray, direction: FloatArray, length: float, material: Material) -> State:
    """Return Kelvin's solution for a unit force [N/m] at a source point, with log(r / length)."""
    return partial(_point_force, source, direction, length, material)


def centre_of_dilatation(source: FloatArray, material: Material) -> State:
    """Return the state with the displacement r / |r|^2 [m], which changes no volume and so knows no bulk modulus."""
    return partial(_centre_of_dilatation, source, material)


def uniform_stress(stress: FloatArray, centre: FloatArray, material: Material) -> State:
    """Return the state of a uniform stress (2, 2) [Pa] that has no displacement at the centre."""
    return partial(_uniform_stress, stress, centre, material)


def _point_force(
    source: FloatArray, e: FloatArray, length: float, material: Material, points: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    mu, nu = material.shear_modulus, material.effective_poisson_ratio
    offset = points - source
    r = np.hypot(offset[..., 0], offset[..., 1])[..., None]
    unit = offset / r
    along, slope = (unit @ e)[..., None], np.sum(unit * normals, axis=-1, keepdims=True)
    displacement = ((4.0 * nu - 3.0) * np.log(r / length) * e + unit * along) / (8.0 * np.pi * mu * (1.0 - nu))
    turned = (1.0 - 2.0 * nu) * (normals * along - unit * (normals @ e)[..., None])
    traction = slope * ((1.0 - 2.0 * nu) * e + 2.0 * unit * along) - turned
    return displacement, -traction / (4.0 * np.pi * (1.0 - nu) * r)


def _centre_of_dilatation(
    source: FloatArray, material: Material, points: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    offset = points - source
    square = np.sum(offset**2, axis=-1, keepdims=True)
    slope = np.sum(offset * normals, axis=-1, keepdims=True)
    return offset / square, 2.0 * material.shear_modulus * (normals / square - 2.0 * offset * slope / square**2)


def _uniform_stress(
    stress: FloatArray, centre: FloatArray, material: Material, points: FloatArray, normals: FloatArray
) -> tuple[FloatArray, FloatArray]:
    strain = (stress - material.effective_poisson_ratio * np.trace(stress) * np.eye(2)) / (2.0 * material.shear_modulus)
    return (points - centre) @ strain, normals @ stress
