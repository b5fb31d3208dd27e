"""What the convergence tests share: Neumann solutions, and the distance of displacements up to rigid motions."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.material import Material
from bemkit.operators.rigid_modes import traction_free_modes
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity


def quadratic_map(mesh: BoundaryMesh, material: Material) -> GalerkinElasticity:
    """Return the map with quadratic displacements and linear tractions that jump at corners."""
    return GalerkinElasticity(mesh, material, QuadraticSpace(mesh), LinearSpace(mesh, corner_nodes(mesh)))


def forces(elastic: SteklovPoincare, traction: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
    """Return the nodal forces (n_nodes, 2) of a traction field (points, outward normals) -> tractions, all (n, 2)."""
    space = elastic.displacement_space
    elements = np.arange(space.mesh.n_elements)
    xi, weights = np.polynomial.legendre.leggauss(8)
    places, normals = space.mesh.points(elements, xi), space.mesh.normals_at(elements, xi)
    values = traction(places.reshape(-1, 2), normals.reshape(-1, 2)).reshape(places.shape)
    local = np.einsum("eq,pq,eqc->epc", space.mesh.jacobian(elements, xi) * weights, space.basis(xi), values)
    total = np.zeros((space.n_dofs // 2, 2))
    np.add.at(total, space.element_dofs, local)
    return total


def neumann(elastic: GalerkinElasticity | CollocationElasticity, force: FloatArray) -> FloatArray:
    """Return the (n_nodes, 2) displacements under nodal forces; the least of those that differ by rigid motions."""
    mesh = elastic.displacement_space.mesh
    held = traction_free_modes(mesh, dof_points(elastic.displacement_space))
    if elastic.material.effective_poisson_ratio == 0.5 and not mesh.is_exterior:
        # the map leaves out the pressure that keeps the volume
        held = np.column_stack([held, forces(elastic, lambda _, normal: normal).ravel()])
    n, m = held.shape
    bordered = np.block([[SteklovPoincareOperator(elastic).matrix(), held], [held.T, np.zeros((m, m))]])
    return np.linalg.solve(bordered, np.concatenate([force.ravel(), np.zeros(m)]))[:n].reshape(-1, 2)


def distance(elastic: SteklovPoincare, one: FloatArray, other: FloatArray) -> float:
    """Return the largest difference of two displacements, up to motions that cause no tractions, relative."""
    motions = traction_free_modes(elastic.displacement_space.mesh, dof_points(elastic.displacement_space))
    difference = (one - other).ravel()
    if motions.size:
        difference = difference - motions @ np.linalg.lstsq(motions, difference, rcond=None)[0]
    return float(np.abs(difference).max() / np.abs(other).max())


def observed_order(errors: Sequence[float]) -> float:
    """Return the order from the last of errors at halved element sizes."""
    return float(np.log2(errors[-2] / errors[-1]))
