"""How far elements of degree 3 and more are from the exact solution, judged by how their Legendre coefficients decay.

On an element of degree p the slopes of the displacements and the tractions are polynomials of degree p - 1. Where the
exact fields are analytic their Legendre coefficients fall geometrically, near a singular point algebraically; either
way the coefficients that are there tell the size of those that are missing [Mavriplis1994]. No neighbour is needed, so
that elements at corners, where fields are singular and one-sided, are judged like all others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import BoundarySpace, dof_points, local_coefficients
from bemkit.operators.rigid_modes import without_motion

ENERGY_CALIBRATION = 0.08
"""Factor between h^2 a^2 / (E' (p + 1) (2 p + 1)), a the first missing coefficient, and the squared error: on the
shipped scenes with a reference the square root of the sum then lies between 0.5 and 2 times the error."""
SLOWEST = 0.95
"""Ratio of successive coefficients beyond which the sum of all that are missing is not told by the first of them."""
_MORE_POINTS = 2


@dataclass(frozen=True, eq=False)
class CoefficientErrors:
    """Estimated errors of the elements of a solution.

    Parameters
    ----------
    energy : (n_elements,) array [J/m]
        Squared errors in the energy norm.
    traction : (n_elements,) array [Pa^2 m]
        Squared errors of the tractions in L2.
    decay : (n_elements,) array
        By how much a degree more would divide the slower of the two errors; 1 where the field is singular.
    """

    energy: FloatArray
    traction: FloatArray
    decay: FloatArray


def coefficient_errors(
    displacement_space: BoundarySpace,
    traction_space: BoundarySpace,
    displacement: FloatArray,
    traction: FloatArray,
    plane_modulus: float,
) -> CoefficientErrors:
    """Estimate the errors of each element from the Legendre coefficients of its slopes and tractions.

    Parameters
    ----------
    displacement_space, traction_space : BoundarySpace
        Continuous of degree p, and of degree p - 1, p at least 3.
    displacement : (n_scalar, 2) array [m]
    traction : (n_elements, p, 2) array [Pa]
        At the local nodes of the traction space, element by element.
    plane_modulus : float [Pa]
        E'.
    """
    mesh, degree = displacement_space.mesh, displacement_space.degree
    strained = without_motion(mesh, dof_points(displacement_space), displacement)
    slopes = plane_modulus * _slope_coefficients(displacement_space, strained[displacement_space.element_dofs])
    tractions = np.einsum("lk,elc->ekc", local_coefficients(traction_space), traction)
    of_slopes, slope_decay = _missing(np.linalg.norm(slopes, axis=2))
    of_tractions, traction_decay = _missing(np.linalg.norm(tractions, axis=2))
    scale = ENERGY_CALIBRATION / (plane_modulus * (degree + 1) * (2 * degree + 1))
    return CoefficientErrors(
        energy=scale * mesh.lengths**2 * (of_slopes + of_tractions),
        traction=mesh.lengths / (2 * degree + 1) * of_tractions,
        decay=np.maximum(slope_decay, traction_decay),
    )


def _slope_coefficients(space: BoundarySpace, displacement: FloatArray) -> FloatArray:
    """Return the Legendre coefficients (n_elements, p, 2) of du/ds."""
    mesh: BoundaryMesh = space.mesh
    xi, weights = legendre.leggauss(space.degree + _MORE_POINTS)
    polynomials = legendre.legvander(xi, space.degree - 1)
    derivatives = polynomials @ legendre.legder(local_coefficients(space).T)  # (n_points, n_local)
    slopes = np.einsum("ql,elc->eqc", derivatives, displacement)
    slopes /= mesh.jacobian(np.arange(mesh.n_elements), xi)[:, :, None]
    projection = (polynomials * weights[:, None]) * (np.arange(space.degree) + 0.5)
    return np.asarray(np.einsum("qk,eqc->ekc", projection, slopes))


def _missing(sizes: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sum of the squares (n,) of the coefficients that follow, and the ratio (n,) at which they fall.

    The second half of the coefficients is fitted by a geometric sequence, each one taken as large as any after it, as a
    field that is odd or even has every other one zero.
    """
    n_known = sizes.shape[1]
    bounds = np.maximum.accumulate(sizes[:, ::-1], axis=1)[:, ::-1]
    n_fitted = min(n_known - 1, max(2, n_known // 2 + 1))
    k = np.arange(n_fitted) - 0.5 * (n_fitted - 1)
    logarithms = np.log(np.maximum(bounds[:, n_known - n_fitted :], np.finfo(float).tiny))
    ratio = np.exp(np.minimum(logarithms @ k / (k @ k), 0.0))
    first = bounds[:, -1] * ratio
    return first**2 / np.maximum(1.0 - ratio**2, 1.0 - SLOWEST**2), ratio
