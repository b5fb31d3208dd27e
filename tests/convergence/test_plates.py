"""Plane fields on plates: a linear field around a round hole, and pure bending of a long strip."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import PlateWithHole, Rectangle, discretise
from bemkit.geometry.spaces import dof_points
from bemkit.operators.material import Material, Plane
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from tests.convergence.fields import distance, forces, neumann, observed_order, quadratic_map
from tests.slow import slow_only

GRADIENT = np.array([[0.3, 0.7], [-0.2, 0.5]])


def stress_of(gradient: FloatArray, material: Material) -> FloatArray:
    strain = 0.5 * (gradient + gradient.T)
    nu = material.effective_poisson_ratio
    return 2.0 * material.shear_modulus * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(2))


@pytest.mark.parametrize(
    ("make", "order", "ceiling"),
    slow_only(
        [(GalerkinElasticity, 2.0, 2e-3), (quadratic_map, 3.0, 1e-4), (CollocationElasticity, 2.0, 4e-3)],
        (GalerkinElasticity, 2.0, 2e-3),
        (CollocationElasticity, 2.0, 4e-3),
    ),
)
def test_linear_field_on_a_plate_with_a_hole(make: type, order: float, ceiling: float) -> None:
    # exact on the straight sides; on arcs x and y are not polynomials of the arc length, and the order shows
    material = Material(2.0, 0.3)
    stress = stress_of(GRADIENT, material)
    errors = []
    for n in (32, 64, 128):
        elastic = make(discretise(PlateWithHole(2.0, 1.5, 0.4, (-1.0, 0.3)).outline(), n_elements=n), material)
        force = forces(elastic, lambda _, normal: normal @ stress)
        exact = dof_points(elastic.displacement_space) @ GRADIENT.T
        errors.append(distance(elastic, neumann(elastic, force), exact))
    assert errors[-1] < ceiling
    assert abs(observed_order(errors) - order) < 0.35  # the elements are not all halved alike


@pytest.mark.parametrize("plane", [Plane.STRAIN, Plane.STRESS])
def test_pure_bending_is_exact_for_quadratic_displacements(plane: Plane) -> None:
    material = Material(2.0, 0.3, plane)
    nu, modulus = material.effective_poisson_ratio, material.plane_modulus
    mesh = discretise(Rectangle(10.0, 1.0, (-5.0, -0.5)).outline(), n_elements=44)
    elastic = quadratic_map(mesh, material)
    x, y = dof_points(elastic.displacement_space).T
    exact = np.column_stack([x * y, -0.5 * (x**2 + nu / (1 - nu) * y**2)]) / modulus
    force = forces(elastic, lambda points, normal: np.column_stack([points[:, 1] * normal[:, 0], 0.0 * normal[:, 0]]))
    # the strip is a hundred times softer in bending than in tension: that multiplies the round-off
    assert distance(elastic, neumann(elastic, force), exact) < 1e-10
    tractions = elastic.tractions(exact)
    loaded = elastic.traction_space.element_dofs[np.abs(mesh.normals[:, 0]) > 0.5]
    places = dof_points(elastic.traction_space)
    signs = np.sign(places[loaded][..., 0])
    np.testing.assert_allclose(tractions[loaded][..., 0], signs * places[loaded][..., 1], atol=1e-10)
