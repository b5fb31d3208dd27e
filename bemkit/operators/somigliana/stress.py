"""Gradients and stresses in the plane from complex numbers, and invariants of stress."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import ComplexArray, FloatArray
from bemkit.operators.material import Plane


def gradient_of(along: ComplexArray, across: ComplexArray) -> FloatArray:
    """Return displacement gradients (n, 2, 2), [:, i, j] = du_i / dx_j, from du/dz and du/dzbar (n,).

    du/dz = (u_x,x + u_y,y + i (u_y,x - u_x,y)) / 2, du/dzbar = (u_x,x - u_y,y + i (u_y,x + u_x,y)) / 2.
    """
    first = np.column_stack([along.real + across.real, across.imag - along.imag])
    return np.stack([first, np.column_stack([across.imag + along.imag, along.real - across.real])], axis=1)


def stress_of(mean: FloatArray, deviator: ComplexArray) -> FloatArray:
    """Return stresses (n, 2, 2) from (sigma_xx + sigma_yy) / 2 and (sigma_xx - sigma_yy) / 2 + i sigma_xy (n,)."""
    first = np.column_stack([mean + deviator.real, deviator.imag])
    return np.stack([first, np.column_stack([deviator.imag, mean - deviator.real])], axis=1)


def von_mises(stress: FloatArray, poisson_ratio: float, plane: Plane) -> FloatArray:
    """Return the equivalent stress of von Mises.

    Parameters
    ----------
    stress : (..., 2, 2) array [Pa]
        Symmetric stresses in the plane.
    poisson_ratio : float [-]
        Poisson's ratio of the material, not the effective one.
    plane : Plane
        In plane strain sigma_zz is poisson_ratio (sigma_xx + sigma_yy), in plane stress zero.

    Returns
    -------
    (...) array [Pa]
        sqrt(3 J_2).
    """
    trace = stress[..., 0, 0] + stress[..., 1, 1]
    across = poisson_ratio * trace if plane is Plane.STRAIN else np.zeros_like(trace)
    radius = _shear_radius(stress)
    # 3 J_2 = 3 radius^2 + (trace / 2 - sigma_zz)^2 is a sum of squares, without cancellation
    result: FloatArray = np.hypot(np.sqrt(3.0) * radius, 0.5 * trace - across)
    return result


def principal_stresses(stress: FloatArray) -> FloatArray:
    """Return the two principal stresses in the plane, the larger one (more tensile) first.

    Parameters
    ----------
    stress : (..., 2, 2) array [Pa]
        Symmetric stresses.

    Returns
    -------
    (..., 2) array [Pa]
    """
    middle = 0.5 * (stress[..., 0, 0] + stress[..., 1, 1])
    radius = _shear_radius(stress)
    return np.stack([middle + radius, middle - radius], axis=-1)


def _shear_radius(stress: FloatArray) -> FloatArray:
    """Return the radius of Mohr's circle: the largest shear stress in the plane."""
    radius: FloatArray = np.hypot(0.5 * (stress[..., 0, 0] - stress[..., 1, 1]), stress[..., 0, 1])
    return radius
