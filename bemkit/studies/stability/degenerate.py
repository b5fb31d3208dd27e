"""Sizes of a body at which the single layer operator, in the body's own unit of length, is singular."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.spaces import ConstantSpace
from bemkit.operators.boundary import single_layer
from bemkit.operators.material import Material


def degenerate_diameters(mesh: BoundaryMesh, material: Material) -> FloatArray:
    """Return the diameters at which the kernel with log|r|, lengths as plain numbers, has no inverse.

    Parameters
    ----------
    mesh : BoundaryMesh
        Of a body of any size.
    material : Material

    Returns
    -------
    (2,) array [m]
        In ascending order.

    Notes
    -----
    With lengths measured by the diameter d the operator V is positive definite. A body of the same shape and the
    diameter d has ``V - c log(d) m m^T``, c = (3 - 4 nu) / (8 pi mu (1 - nu)), where the two columns of m integrate
    tractions to forces; by the matrix determinant lemma that is singular if ``1 / (c log d)`` is an eigenvalue of
    ``m^T V^-1 m``. bemkit itself never meets these sizes, because it measures lengths by the diameter.
    """
    diameter = mesh.diameter
    unit = mesh.transformed(shift=(float(mesh.centre[0]), float(mesh.centre[1])), factor=1.0 / diameter)
    space = ConstantSpace(unit)
    # the operator measures lengths by the diameter of its mesh, which is one here
    v = single_layer(space, space, material).matrix()
    to_force = np.kron(unit.lengths[:, None], np.eye(2))
    nu = material.effective_poisson_ratio
    factor = (3.0 - 4.0 * nu) / (8.0 * np.pi * material.shear_modulus * (1.0 - nu))
    eigenvalues = np.linalg.eigvalsh(to_force.T @ np.linalg.solve(v, to_force))
    return np.sort(np.exp(1.0 / (factor * eigenvalues)))
