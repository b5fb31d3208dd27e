"""Steklov-Poincare maps: patch tests, rigid motions, symmetry, symbols on the circle, scales, equilibrium."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.geometry import (
    Algebraic,
    BoundaryMesh,
    ExteriorOf,
    Geometric,
    Polygon,
    Rectangle,
    Shape,
    Uniform,
    discretise,
)
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.linear_solvers import Automatic
from bemkit.operators.material import Material, Plane
from bemkit.operators.rigid_modes import rigid_motions
from bemkit.operators.steklov_poincare import SteklovPoincare
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import integrate_traction
from bemkit.testing import check_operator
from tests.slow import slow_only

MATERIAL = Material(1.0, 0.3)
L_SHAPE = Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))
TRIANGLE = Polygon(((0.0, 0.0), (1.0, 0.0), (0.3, 0.8)))
GRADIENT = np.array([[0.3, 0.7], [-0.2, 0.5]])


def mesh_of(shape: Shape, n: int, exponent: float = 1.0) -> BoundaryMesh:
    grading = Uniform() if exponent == 1.0 else Algebraic(exponent)
    return discretise(shape.outline(), n_elements=n, grading=grading)


def patch_error(elastic: SteklovPoincare, material: Material) -> float:
    """Difference between S u of a linear field and the nodal forces of its tractions, relative."""
    mesh = elastic.displacement_space.mesh
    strain = 0.5 * (GRADIENT + GRADIENT.T)
    nu = material.effective_poisson_ratio
    stress = 2.0 * material.shear_modulus * (strain + nu / (1.0 - 2.0 * nu) * np.trace(strain) * np.eye(2))
    expected = np.zeros((elastic.displacement_space.n_dofs // 2, 2))
    for element in range(mesh.n_elements):
        traction = stress @ mesh.normals[element]
        expected += integrate_traction(
            elastic.displacement_space, np.array([element]), lambda x, _, t=traction: np.broadcast_to(t, x.shape)
        )
    displacement = (dof_points(elastic.displacement_space) - mesh.centre) @ GRADIENT.T
    computed = (SteklovPoincareOperator(elastic).matrix() @ displacement.ravel()).reshape(-1, 2)
    return float(np.abs(computed - expected).max() / np.abs(expected).max())


@pytest.mark.parametrize(
    ("shape", "n"),
    [(Rectangle(1.0, 1.0), 16), (Rectangle(1.0, 1.0), 80), (L_SHAPE, 64), (TRIANGLE, 48), (Rectangle(10.0, 1.0), 110)],
)
def test_linear_patch_is_exact_on_quasi_uniform_meshes(shape: Shape, n: int) -> None:
    # every integral is exact to round-off, and the solve multiplies it by the condition number of V, about n
    assert patch_error(GalerkinElasticity(mesh_of(shape, n), MATERIAL), MATERIAL) < 1e-12


@pytest.mark.parametrize(
    ("shape", "n", "exponent"), [(Rectangle(1.0, 1.0), 80, 6.0), (L_SHAPE, 96, 5.0), (Rectangle(100.0, 1.0), 202, 1.0)]
)
def test_linear_patch_holds_on_graded_meshes_and_thin_strips(shape: Shape, n: int, exponent: float) -> None:
    assert patch_error(GalerkinElasticity(mesh_of(shape, n, exponent), MATERIAL), MATERIAL) < 1e-9


@pytest.mark.parametrize("shape", [Rectangle(1.0, 1.0), L_SHAPE], ids=["square", "L"])
@pytest.mark.parametrize("smallest", [1e-4, 1e-8, 1e-12])
def test_linear_patch_holds_at_any_grading(shape: Shape, smallest: float) -> None:
    levels = round(np.log(smallest) / np.log(0.2))
    n_sides = len(shape.outline().side_names)
    grading = Geometric(0.2, levels)
    mesh = discretise(shape.outline(), n_elements=2 * n_sides * (levels + 2), grading=grading)
    assert mesh.lengths.max() / mesh.lengths.min() > 0.1 / smallest
    assert patch_error(GalerkinElasticity(mesh, MATERIAL), MATERIAL) < 1e-12


def test_linear_patch_is_exact_on_a_plate_with_a_hole() -> None:
    square = discretise(Rectangle(4.0, 4.0, (-2.0, -2.0)).outline(), n_elements=32).nodes
    angle = -2.0 * np.pi * np.arange(12) / 12  # clockwise: the body is on the left
    hole = np.column_stack([np.cos(angle), np.sin(angle)])
    first, second = np.arange(32), 32 + np.arange(12)
    elements = np.vstack([np.column_stack([loop, np.roll(loop, -1)]) for loop in (first, second)])
    mesh = BoundaryMesh(np.vstack([square, hole]), elements)
    assert len(mesh.loops) == 2
    assert patch_error(GalerkinElasticity(mesh, MATERIAL), MATERIAL) < 1e-12


@pytest.mark.parametrize("gap", [1e-2, 1e-4, 1e-6])
def test_linear_patch_holds_across_a_narrow_slit(gap: float) -> None:
    legs = (
        (0.0, 0.0),
        (2 + gap, 0.0),
        (2 + gap, 2.0),
        (1 + gap, 2.0),
        (1 + gap, 1.0),
        (1.0, 1.0),
        (1.0, 2.0),
        (0.0, 2.0),
    )
    assert patch_error(GalerkinElasticity(mesh_of(Polygon(legs), 80), MATERIAL), MATERIAL) < 1e-12


def test_position_costs_only_the_digits_of_the_coordinates() -> None:
    mesh = mesh_of(L_SHAPE, 48)
    reference = SteklovPoincareOperator(GalerkinElasticity(mesh, MATERIAL)).matrix()
    for distance in (1.0, 1e3, 1e6):
        moved = mesh.transformed(shift=(-distance * mesh.diameter, 0.0), factor=1.0)
        error = (
            np.abs(SteklovPoincareOperator(GalerkinElasticity(moved, MATERIAL)).matrix() - reference).max()
            / np.abs(reference).max()
        )
        assert error < 1e-13 + 10.0 * np.finfo(float).eps * distance * mesh.diameter / mesh.lengths.min()


@pytest.mark.parametrize("broken", [True, False])
def test_linear_patch_is_exact_with_quadratic_displacements(broken: bool) -> None:
    mesh = mesh_of(Rectangle(1.0, 1.0), 32)
    tractions = LinearSpace(mesh, corner_nodes(mesh))
    space = QuadraticSpace(mesh) if broken else LinearSpace(mesh)
    assert patch_error(GalerkinElasticity(mesh, MATERIAL, space, tractions), MATERIAL) < 1e-12


def test_plane_stress_is_exact_on_its_own_patch() -> None:
    material = Material(3.0, 0.3, Plane.STRESS)
    assert patch_error(GalerkinElasticity(mesh_of(TRIANGLE, 24), material), material) < 1e-12


@given(nu=st.floats(-0.9, 0.5), seed=st.integers(0, 10_000))
@settings(max_examples=15)
def test_map_is_symmetric_positive_and_kills_rigid_motions(nu: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = np.sort(rng.uniform(0, 2 * np.pi, 9)) + np.arange(9) * 1e-2
    radius = rng.uniform(0.5, 1.0, 9)
    vertices = tuple(zip(radius * np.cos(angle), radius * np.sin(angle), strict=True))
    # a star about the origin needs gaps below pi between its rays, and no two rays in one direction
    gaps = np.diff(np.append(angle, angle[0] + 2 * np.pi))
    assume(1e-3 < gaps.min() and gaps.max() < 3.0)
    elastic = GalerkinElasticity(mesh_of(Polygon(vertices), 36), Material(1.0, nu))
    matrix = SteklovPoincareOperator(elastic).matrix()
    points = dof_points(elastic.displacement_space)
    motions = rigid_motions(points, points.mean(axis=0), 1.0).reshape(-1, 3)
    size = np.abs(matrix).max()
    np.testing.assert_array_equal(matrix, matrix.T)
    # round-off of the integrals times the condition of V
    assert np.abs(matrix @ motions).max() < 1e-12 * size
    eigenvalues = np.linalg.eigvalsh(matrix)
    assert eigenvalues[0] > -1e-12 * size
    assert eigenvalues[3] > 1e-4 * size if nu < 0.49 else eigenvalues[3] > 0


def test_collocation_keeps_exact_equilibrium_and_kills_rigid_motions() -> None:
    elastic = CollocationElasticity(mesh_of(L_SHAPE, 64), MATERIAL)
    matrix = SteklovPoincareOperator(elastic).matrix()
    motions = rigid_motions(elastic.mesh.centres, elastic.mesh.centre, 1.0).reshape(-1, 3)
    # rotations by the slopes of the double layer, which constants on elements do not hold by themselves
    assert np.abs(matrix @ motions).max() < 1e-12 * np.abs(matrix).max()
    assert np.abs(motions.T @ matrix).max() < 1e-12 * np.abs(matrix).max()


@pytest.mark.parametrize("kind", [GalerkinElasticity, CollocationElasticity])
@pytest.mark.parametrize(
    ("shape", "nu"),
    [
        (Rectangle(3.0, 1.0), 0.2398328),
        (Rectangle(2.1116510, 2.1116510), 0.2),
        (Rectangle(1e3, 1e3), 0.3),
        (Rectangle(1e-9, 2e-9), 0.3),
        (Rectangle(1e9, 2e9), 0.3),
    ],
)
def test_no_size_of_the_body_is_degenerate(kind: type, shape: Rectangle, nu: float) -> None:
    material = Material(1.0, nu)
    small = Rectangle(shape.width / 7.3, shape.height / 7.3, (shape.width, -2.0 * shape.height))
    a = SteklovPoincareOperator(kind(mesh_of(shape, 48), material)).matrix()
    b = SteklovPoincareOperator(kind(mesh_of(small, 48), material)).matrix()
    # S does not depend on size or position in the plane; the coordinates of the moved body lose one digit
    assert np.abs(a - b).max() < 1e-11 * np.abs(a).max()


def test_single_layer_constant_does_not_matter() -> None:
    from bemkit.geometry.spaces import ConstantSpace
    from bemkit.operators.boundary import double_layer, hypersingular, mass, single_layer

    mesh = mesh_of(L_SHAPE, 48)
    t, u = ConstantSpace(mesh), LinearSpace(mesh)
    reference = SteklovPoincareOperator(GalerkinElasticity(mesh, MATERIAL)).matrix()
    ones = mass(t, t).matrix() @ rigid_motions(mesh.centres, mesh.centre, 1.0).reshape(-1, 3)[:, :2]
    for constant in (0.5, 30.0):  # log(r / r0) with another r0
        v = single_layer(t, t, MATERIAL).matrix() + constant * ones @ ones.T
        b = 0.5 * mass(u, t).matrix() + double_layer(u, t, MATERIAL).matrix()
        points = dof_points(u)
        resultants = mass(u, t).matrix() @ rigid_motions(points, mesh.centre, 1.0).reshape(-1, 3)
        bordered = np.block([[v, resultants], [resultants.T, np.zeros((3, 3))]])
        tractions = np.linalg.solve(bordered, np.vstack([b, np.zeros((3, b.shape[1]))]))[:-3]
        other = hypersingular(u, u, MATERIAL).matrix() + b.T @ tractions
        assert np.abs(other - reference).max() < 1e-10 * np.abs(reference).max()


def circle_symbol_errors(kind: type, n: int, nu: float) -> FloatArray:
    """Relative errors of <S u, u> on the inscribed polygon against the symbols of the circle, k = -3 ... 4."""
    angle = 2 * np.pi * np.arange(n) / n
    mesh = mesh_of(Polygon(tuple(zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True))), n)
    elastic = kind(mesh, Material(1.0, nu))
    material = elastic.material
    theta = np.arctan2(*dof_points(elastic.displacement_space).T[::-1])
    errors = []
    for k in (-3, -2, -1, 2, 3, 4):
        u = np.column_stack([np.cos(k * theta), np.sin(k * theta)])
        symbol = 2.0 * material.shear_modulus * (k / material.kappa if k > 0 else -k)
        energy = u.ravel() @ SteklovPoincareOperator(elastic).matrix() @ u.ravel()
        errors.append(abs(energy / (2 * np.pi * symbol) - 1.0))
    return np.array(errors)


@pytest.mark.parametrize(
    ("kind", "order", "ceiling"),
    slow_only(
        [(GalerkinElasticity, 2.0, 3e-3), (CollocationElasticity, 2.0, 2e-3)], (CollocationElasticity, 2.0, 2e-3)
    ),
)
def test_symbols_on_inscribed_polygons_converge(kind: type, order: float, ceiling: float) -> None:
    errors = np.array([circle_symbol_errors(kind, n, 0.3) for n in (24, 48, 96, 192)])
    observed = np.log2(errors[2] / errors[3])
    assert errors[-1].max() < ceiling
    assert observed.min() > order - 0.25
    assert observed.max() < order + 0.25


@pytest.mark.parametrize("exterior", [False, True], ids=["inside", "outside"])
@pytest.mark.parametrize("make", [GalerkinElasticity, CollocationElasticity])
def test_maps_are_linear_operators_with_the_tags_they_claim(make: type, exterior: bool) -> None:
    shape = Rectangle(2.0, 1.0)
    mesh = discretise((ExteriorOf(shape) if exterior else shape).outline(), n_elements=24)
    check_operator(SteklovPoincareOperator(make(mesh, MATERIAL)))


def test_a_map_does_not_choose_a_linear_solver() -> None:
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=8)
    with pytest.raises(
        InputError, match=r"linear_solver is Automatic\(\), by which scenes choose one: give DenseCholesky\(\)"
    ):
        GalerkinElasticity(mesh, MATERIAL, linear_solver=Automatic())
