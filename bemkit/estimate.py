"""How far a Galerkin solution is from the exact one, judged from the solution itself.

The strain along the boundary of the exact solution is continuous wherever tractions are; that of the computed one
jumps from element to element by as much as it is wrong. The jumps weighted by element lengths measure the error in
the energy norm, element by element.
"""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.space import BoundarySpace, break_nodes

CALIBRATION = 1.0 / 64.0
"""Factor between jumps and squared errors: on linear and quadratic elements, uniform and graded, the square root of
the sum then lies between 0.5 and 2 times the error."""


def element_errors(space: BoundarySpace, displacement: FloatArray, plane_modulus: float) -> FloatArray:
    """Estimate the squared error of each element in the energy norm.

    Parameters
    ----------
    space : BoundarySpace
        Continuous displacements of degree 1 or 2.
    displacement : (n_scalar, 2) array [m]
    plane_modulus : float [Pa]
        E'.

    Returns
    -------
    (n_elements,) array [J/m]
        They add up to the estimate of a(u - u_h, u - u_h).

    Notes
    -----
    At a node between elements of lengths a and b whose strains du/ds differ by j the estimate is E' h^2 |j|^2 / 64,
    h = 2 a b / (a + b), half of it for either element. Corners and ends of boundary parts are left out: there strains
    may jump.
    """
    mesh = space.mesh
    before, after = mesh.node_elements.T
    at_start, at_end = _end_slopes(space, displacement)
    jump = np.sum((at_start[after] - at_end[before]) ** 2, axis=1)
    jump[break_nodes(mesh)] = 0.0
    length = 2.0 / (1.0 / mesh.lengths[before] + 1.0 / mesh.lengths[after])
    at_nodes = 0.5 * CALIBRATION * plane_modulus * length**2 * jump
    errors: FloatArray = at_nodes[mesh.elements].sum(axis=1)
    return errors


def _end_slopes(space: BoundarySpace, displacement: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return du/ds (n_elements, 2) at the start and at the end of each element."""
    mesh = space.mesh
    ends = np.array([-1.0, 1.0])
    slopes = np.einsum("pq,epc->eqc", _derivative(space, ends), displacement[space.element_dofs])
    slopes /= mesh.jacobian(np.arange(mesh.n_elements), ends)[:, :, None]
    return slopes[:, 0], slopes[:, 1]


def _derivative(space: BoundarySpace, xi: FloatArray) -> FloatArray:
    """Differentiate the local basis: (n_local, n_points); central differences are exact up to degree 2."""
    return 0.5 * (space.basis(xi + 1.0) - space.basis(xi - 1.0))
