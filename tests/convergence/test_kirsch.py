"""A round hole in an infinite plate under tension (Kirsch): an exterior domain, superposed on the far field."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, Disk, ExteriorOf, discretise
from bemkit.geometry.spaces import dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.material import Material, Plane
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from tests.convergence.fields import distance, forces, neumann, observed_order, quadratic_map
from tests.slow import slow_only

RADIUS = 0.7
TENSION = 1.5

Make = Callable[[BoundaryMesh, Material], GalerkinElasticity | CollocationElasticity]


def hole(n: int) -> BoundaryMesh:
    return discretise(ExteriorOf(Disk(RADIUS, (0.4, -0.1))).outline(), n_elements=n)


def exact(points: FloatArray, material: Material) -> FloatArray:
    """Return the displacement of the rim, far field included (benchmark 1.3 of the problems with known answers)."""
    angle = np.arctan2(points[:, 1], points[:, 0])
    radial = TENSION * RADIUS / material.plane_modulus * (1 + 2 * np.cos(2 * angle))
    around = -2 * TENSION * RADIUS / material.plane_modulus * np.sin(2 * angle)
    return np.column_stack(
        [radial * np.cos(angle) - around * np.sin(angle), radial * np.sin(angle) + around * np.cos(angle)]
    )


def far_field(points: FloatArray, material: Material) -> FloatArray:
    nu = material.effective_poisson_ratio
    strain = TENSION / material.plane_modulus
    return np.column_stack([strain * points[:, 0], -strain * nu / (1 - nu) * points[:, 1]])


def rim_error(make: Make, n: int, material: Material) -> float:
    elastic = make(hole(n), material)
    # the hole is free: what the uniform tension leaves on its rim is taken away
    force = forces(elastic, lambda _, normal: np.column_stack([-TENSION * normal[:, 0], 0.0 * normal[:, 0]]))
    points = dof_points(elastic.displacement_space) - (0.4, -0.1)
    return distance(elastic, neumann(elastic, force) + far_field(points, material), exact(points, material))


@pytest.mark.parametrize(
    ("make", "order", "ceiling"),
    slow_only(
        [(GalerkinElasticity, 2.0, 6e-4), (quadratic_map, 3.0, 6e-6), (CollocationElasticity, 2.0, 4e-4)],
        (quadratic_map, 3.0, 6e-6),
    ),
)
def test_displacement_of_the_rim(make: Make, order: float, ceiling: float) -> None:
    errors = [rim_error(make, n, Material(2.0, 0.3)) for n in (24, 48, 96)]
    assert errors[-1] < ceiling
    assert abs(observed_order(errors) - order) < 0.25


def test_plane_stress() -> None:
    assert rim_error(quadratic_map, 48, Material(2.0, 0.3, Plane.STRESS)) < 1e-4  # as in plane strain


def test_stress_concentration() -> None:
    # the hoop stress S (1 - 2 cos 2 theta) = E' du_s/ds on a free rim peaks at three times the tension
    material = Material(2.0, 0.3)
    mesh = hole(96)
    elastic = quadratic_map(mesh, material)
    force = forces(elastic, lambda _, normal: np.column_stack([-TENSION * normal[:, 0], 0.0 * normal[:, 0]]))
    points = dof_points(elastic.displacement_space) - (0.4, -0.1)
    u = neumann(elastic, force) + far_field(points, material)
    start, _, end = u[elastic.displacement_space.element_dofs].transpose(1, 0, 2)
    slope = (end - start) / mesh.lengths[:, None]  # second order at the middle of the element
    tangent = mesh.tangents
    hoop = material.plane_modulus * np.sum(slope * tangent, axis=1)
    angle = np.arctan2(*(mesh.centres - (0.4, -0.1)).T[::-1])
    np.testing.assert_allclose(hoop, TENSION * (1 - 2 * np.cos(2 * angle)), atol=2e-2 * TENSION)
    assert hoop.max() == pytest.approx(3 * TENSION, rel=1e-2)


@pytest.mark.parametrize("make", [GalerkinElasticity, CollocationElasticity])
def test_tractions_of_an_exterior_need_no_equilibrium(make: Make) -> None:
    # a rim that moves rigidly along x: uniform tractions, by the single layer of the constant with log(r / r0)
    material = Material(2.0, 0.3)
    mesh = hole(64)
    elastic = make(mesh, material)
    push = np.tile([1.0, 0.0], (elastic.displacement_space.n_dofs // 2, 1))
    force = (SteklovPoincareOperator(elastic).matrix() @ push.ravel()).reshape(-1, 2)
    kappa, mu = material.kappa, material.shear_modulus
    per_unit = RADIUS * (1 - 2 * kappa * np.log(RADIUS / mesh.diameter)) / (2 * mu * (kappa + 1))
    np.testing.assert_allclose(force.sum(axis=0), [2 * np.pi * RADIUS / per_unit, 0.0], atol=1e-10)
