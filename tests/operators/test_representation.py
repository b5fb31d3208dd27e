"""Fields inside a body: exact data give exact fields up to the boundary, inexact data converge."""

from __future__ import annotations

from collections.abc import Callable

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.errors import GeometryError
from bemkit.geometry import BoundaryMesh, Disk, ExteriorOf, ParametricCurve, Polygon, Rectangle, Ring, discretise
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.outline import Outline, Side
from bemkit.geometry.proximity.location import PointNotInsideError
from bemkit.geometry.spaces import BoundarySpace, ConstantSpace, LinearSpace, QuadraticSpace, dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.material import Material, Plane
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.operators.somigliana.straight_fields import AT_END, local_moments
from bemkit.operators.somigliana.stress import principal_stresses, von_mises
from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.results.solved_scene import interior_fields

Field = Callable[[FloatArray], FloatArray]
VERTICES = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
DISTANCES = [1.0, 0.1, 1e-2, 1e-4, 1e-8, 1e-12]


def straight_mesh() -> BoundaryMesh:
    return discretise(Polygon(VERTICES).outline(), n_elements=48)


def line(a: tuple[float, float], b: tuple[float, float]) -> ParametricCurve:
    """A straight side that calls itself curved."""
    start, step = np.array(a), np.array(b) - np.array(a)
    return ParametricCurve(lambda s: start + s[:, None] * step, lambda s: np.tile(step, (len(s), 1)))


def curved_mesh() -> BoundaryMesh:
    ends = (*VERTICES[1:], VERTICES[0])
    sides = tuple(Side(f"side-{i}", line(a, b)) for i, (a, b) in enumerate(zip(VERTICES, ends, strict=True)))
    mesh = discretise(Outline((sides,)), n_elements=32)
    assert not mesh.is_straight.any()
    return mesh


def on_boundary(
    mesh: BoundaryMesh,
    material: Material,
    displacement: Field,
    stress: Field,
    displacement_space: BoundarySpace | None = None,
    traction_space: BoundarySpace | None = None,
) -> InteriorFields:
    """Interpolate a known field on the boundary: exact for quadratic fields on straight elements."""
    u = QuadraticSpace(mesh) if displacement_space is None else displacement_space
    t = LinearSpace(mesh, corner_nodes(mesh)) if traction_space is None else traction_space
    tractions = np.zeros((t.n_dofs // 2, 2))
    for element in range(mesh.n_elements):
        own = np.array([element])
        x, n = mesh.points(own, t.local_nodes)[0], mesh.normals_at(own, t.local_nodes)[0]
        tractions[t.element_dofs[element]] = np.einsum("qij,qj->qi", stress(x), n)
    return InteriorFields(mesh, material, u, displacement(dof_points(u)), t, tractions)


def bending(material: Material) -> tuple[Field, Field]:
    """Pure bending sigma_xx = y and a rigid motion."""
    modulus, nu = material.plane_modulus, material.effective_poisson_ratio

    def displacement(x: FloatArray) -> FloatArray:
        u = np.column_stack([x[:, 0] * x[:, 1], -0.5 * (x[:, 0] ** 2 + nu / (1.0 - nu) * x[:, 1] ** 2)]) / modulus
        return u + (3.0, -1.0) + 0.1 * np.column_stack([-x[:, 1], x[:, 0]])

    def stress(x: FloatArray) -> FloatArray:
        result = np.zeros((len(x), 2, 2))
        result[:, 0, 0] = x[:, 1]
        return result

    return displacement, stress


def near_boundary(mesh: BoundaryMesh, distance: float) -> FloatArray:
    """Points opposite every element, `distance` element lengths inside, also close to nodes."""
    fraction = np.random.default_rng(3).uniform(0.0, 1.0, (mesh.n_elements, 1))
    fraction[::5] = 1e-3  # close to a node
    fraction[1::5] = 0.0  # opposite a node
    x = mesh.start + fraction * (mesh.end - mesh.start)
    return x - distance * mesh.lengths[:, None] * mesh.normals


@pytest.mark.parametrize("distance", DISTANCES)
@pytest.mark.parametrize(
    "material", [Material(2.0, 0.3), Material(2.0, 0.5), Material(2.0, -0.5), Material(2.0, 0.3, Plane.STRESS)]
)
def test_exact_data_give_exact_fields_at_any_distance_from_straight_sides(material: Material, distance: float) -> None:
    displacement, stress = bending(material)
    fields = on_boundary(straight_mesh(), material, displacement, stress)
    x = near_boundary(fields.mesh, distance)
    x = x[fields.is_inside(x)]
    assert len(x) > 35
    size = np.abs(displacement(x)).max()
    # round-off of some 50 elements; that of the given displacements, 3 in size, enters stresses over the element length
    assert np.abs(fields.displacement(x) - displacement(x)).max() < 1e-14 * size
    assert np.abs(fields.stress(x) - stress(x)).max() < 1e-12 * size * material.plane_modulus


@pytest.mark.slow
@pytest.mark.parametrize("distance", DISTANCES)
def test_curved_elements_lose_only_the_round_off_of_coordinates(distance: float) -> None:
    material = Material(2.0, 0.3)
    displacement, stress = bending(material)
    fields = on_boundary(curved_mesh(), material, displacement, stress)
    x = near_boundary(fields.mesh, distance)
    x = x[fields.is_inside(x)]
    size = np.abs(displacement(x)).max()
    assert np.abs(fields.displacement(x) - displacement(x)).max() < 1e-14 * size
    # coordinates of size 2 are round to 2e-16, which is a relative error of 1e-15 / distance
    assert np.abs(fields.stress(x) - stress(x)).max() < (1e-12 + 1e-15 / distance) * size * material.plane_modulus


def test_gradient_is_the_derivative_and_strain_fits_the_stress() -> None:
    material = Material(2.0, 0.3)
    displacement, stress = bending(material)
    fields = on_boundary(straight_mesh(), material, displacement, stress)
    x = np.array([[0.3, 0.4], [1.7, 0.2], [0.5, 1.9]])
    gradient = fields.displacement_gradient(x)
    step = 1e-5
    for axis in range(2):
        moved = np.eye(2)[axis] * step
        difference = (fields.displacement(x + moved) - fields.displacement(x - moved)) / (2.0 * step)
        assert np.abs(gradient[:, :, axis] - difference).max() < 1e-9  # round-off 1e-15 over the step
    nu = 0.3
    expected = 2.0 * material.shear_modulus * fields.strain(x)
    expected += (
        2.0
        * material.shear_modulus
        * nu
        / (1 - 2 * nu)
        * np.trace(gradient, axis1=1, axis2=2)[:, None, None]
        * np.eye(2)
    )
    assert np.abs(expected - fields.stress(x)).max() < 1e-12


def lame(shape: Disk | Ring | ExteriorOf, material: Material) -> tuple[Field, Field]:
    """sigma_r = a - b / r^2, sigma_theta = a + b / r^2 about the centre (3, 1)."""
    a, b = {Disk: (1.0, 0.0), Ring: (1.0, 0.3), ExteriorOf: (0.0, 1.0)}[type(shape)]
    nu, modulus = material.poisson_ratio, material.youngs_modulus

    def displacement(x: FloatArray) -> FloatArray:
        r = x - (3.0, 1.0)
        return (1.0 + nu) / modulus * ((1.0 - 2.0 * nu) * a + b / np.sum(r**2, axis=1))[:, None] * r

    def stress(x: FloatArray) -> FloatArray:
        r = x - (3.0, 1.0)
        r2 = np.sum(r**2, axis=1)[:, None, None]
        radial = np.einsum("ni,nj->nij", r, r) / r2
        return a * np.eye(2) - b / r2 * radial + b / r2 * (np.eye(2) - radial)

    return displacement, stress


@pytest.mark.slow
@pytest.mark.parametrize(
    "shape",
    [Disk(1.0, (3.0, 1.0)), Ring(0.4, 1.0, (3.0, 1.0)), ExteriorOf(Disk(1.0, (3.0, 1.0)))],
    ids=repr,
)
def test_fields_of_interpolated_data_converge_on_arcs(shape: Disk | Ring | ExteriorOf) -> None:
    material = Material(2.0, 0.3)
    displacement, stress = lame(shape, material)
    errors = []
    for n in (32, 64, 128):
        mesh = discretise(shape.outline(), n_elements=n)
        fields = on_boundary(mesh, material, displacement, stress, traction_space=QuadraticSpace(mesh))
        xi = np.array([0.1])
        elements = np.arange(n)
        x = mesh.points(elements, xi)[:, 0] - 0.01 * mesh.lengths[:, None] * mesh.normals_at(elements, xi)[:, 0]
        errors.append(
            [np.abs(fields.displacement(x) - displacement(x)).max(), np.abs(fields.stress(x) - stress(x)).max()]
        )
    order = np.log2(np.array(errors)[1:-1] / np.array(errors)[2:])[0]
    # quadratic data: h^3 in displacements, h^2 in stresses this close to the boundary; the ring starts coarse
    assert 2.4 < order[0] < 3.4
    assert 1.6 < order[1] < 2.4
    assert errors[-1][0] < 1e-5
    assert errors[-1][1] < 3e-3


@pytest.mark.parametrize(("kind", "ceiling"), [(GalerkinElasticity, 2e-4), (CollocationElasticity, 1.5e-2)])
def test_fields_of_a_discrete_solution_converge_in_the_interior(kind: type, ceiling: float) -> None:
    # a block under its own solution: tension with clamped displacements known everywhere
    material = Material(2.0, 0.3)
    displacement, stress = bending(material)
    mesh = discretise(Rectangle(2.0, 1.0).outline(), n_elements=96)
    elastic = kind(mesh, material)
    space = elastic.displacement_space
    u = displacement(dof_points(space)) - (3.0, -1.0)
    tractions = elastic.element_tractions(u, (SteklovPoincareOperator(elastic).matrix() @ u.ravel()).reshape(-1, 2))[
        :, 0
    ]
    fields = InteriorFields(mesh, material, space, u, ConstantSpace(mesh), tractions)
    x = np.array([[0.5, 0.5], [1.2, 0.3], [1.6, 0.7]])
    assert np.abs(fields.stress(x) - stress(x)).max() < ceiling


def test_rough_data_are_integrated_against_the_textbook_kernels() -> None:
    # constant densities that jump at every node and have a resultant, seen from a point well inside
    mesh = straight_mesh()
    material, nu = Material(2.0, 0.3), 0.3
    rng = np.random.default_rng(5)
    space = ConstantSpace(mesh)
    u, t = rng.normal(size=(2, mesh.n_elements, 2))
    x = np.array([0.4, 0.7])
    xi, weights = np.polynomial.legendre.leggauss(40)
    r = mesh.points(np.arange(mesh.n_elements), xi) - x
    distance = np.hypot(r[..., 0], r[..., 1])[..., None, None]
    e, n = r / distance[..., 0], np.broadcast_to(mesh.normals[:, None, :], r.shape)
    outer = e[..., :, None] * e[..., None, :]
    kelvin = (-(3 - 4 * nu) * np.log(distance / mesh.diameter) * np.eye(2) + outer) / (
        8 * np.pi * material.shear_modulus * (1 - nu)
    )
    along = np.sum(e * n, axis=-1)[..., None, None]
    skew = n[..., :, None] * e[..., None, :] - e[..., :, None] * n[..., None, :]
    double = along * ((1 - 2 * nu) * np.eye(2) + 2 * outer) + (1 - 2 * nu) * skew
    double = -double / (4 * np.pi * (1 - nu) * distance)
    measure = weights * 0.5 * mesh.lengths[:, None]
    expected = np.einsum("eqij,ej,eq->i", kelvin, t, measure) - np.einsum("eqij,ej,eq->i", double, u, measure)
    fields = InteriorFields(mesh, material, space, u, space, t)
    assert np.abs(fields.displacement(x[None]) - expected).max() < 1e-13


@given(distance=st.floats(1e-10, 1e6), angle=st.floats(-3.1, 3.1), highest=st.integers(1, 12), order=st.integers(0, 2))
def test_derived_moments_hold_at_every_distance(distance: float, angle: float, highest: int, order: int) -> None:
    plus = -distance * np.exp(1j * angle)
    computed = local_moments(np.array([plus]), np.array([plus - 2.0]), highest, order + 1)[order]
    with mpmath.workdps(400):  # the recurrences upward lose hundreds of digits far away
        zeta = mpmath.mpc(plus) - 1
        product = zeta**2 - 1
        c, g, h = [mpmath.log((zeta + 1) / (zeta - 1))], [2 / product], [2 * zeta / product**2]
        c.append(zeta * c[0] - 2)
        g.append(zeta * g[0] - c[0])
        h.append(zeta * h[0] - g[0])
        for k in range(1, highest):
            c.append(((2 * k + 1) * zeta * c[k] - k * c[k - 1]) / (k + 1))
            g.append(g[k - 1] - (2 * k + 1) * c[k])
            h.append(h[k - 1] - mpmath.mpf(2 * k + 1) / 2 * g[k])
        expected = [complex(value) for value in (c, g, h)[order]]
    for k in range(highest + 1):
        # zeta itself is known to eps only, which a function of degree k next to an end of the element magnifies
        assert abs(computed[k][0] - expected[k]) <= 1e-11 * abs(expected[k])


def test_powers_about_an_end_are_those_about_the_centre_shifted() -> None:
    mesh, material = straight_mesh(), Material(1.0, 0.3)
    fields = on_boundary(mesh, material, *bending(material))._straight
    element, reference = np.array([3, 3, 3]), np.array([0.2 - 0.1j, 0.3j, 1.0])
    zeta = np.array([-0.9 + 0.2j, 1.1 + 0.3j, 0.2 + 0.3j])
    x = fields.geometry.centre[element] + zeta * (fields.geometry.half * fields.geometry.tangent)[element]
    about_ends, about_centre = (fields.gradients(x, element, reference, at_end) for at_end in (AT_END, 0.0))
    assert np.all((about_ends != about_centre)[:, :2].any(axis=0))
    np.testing.assert_array_equal(about_ends[:, 2], about_centre[:, 2])
    np.testing.assert_allclose(about_ends, about_centre, rtol=1e-12)


def test_points_that_are_not_inside_are_named() -> None:
    fields = on_boundary(straight_mesh(), Material(1.0, 0.3), *bending(Material(1.0, 0.3)))
    points = np.array([[0.5, 0.5], [1.5, 1.5], [1.0, 1.5]])
    np.testing.assert_array_equal(fields.is_inside(points), [True, False, False])
    with pytest.raises(PointNotInsideError, match=r"point 1 at \(1.5, 1.5\) lies outside of the body \(2 of 3 points"):
        fields.displacement(points)
    with pytest.raises(PointNotInsideError, match=r"point 0 at \(1, 1.5\) lies on the boundary"):
        fields.stress(points[2:])
    for wrong in (np.zeros(2), np.array([[np.nan, 0.0]])):
        with pytest.raises(ValueError, match="give an \\(n, 2\\) array of finite coordinates"):
            fields.stress(wrong)
    assert fields.stress(np.zeros((0, 2))).shape == (0, 2, 2)


def test_points_on_and_beside_arcs_are_told_apart() -> None:
    mesh = discretise(Disk(1.0).outline(), n_elements=4)
    space = ConstantSpace(mesh)
    fields = InteriorFields(mesh, Material(1.0, 0.3), space, np.zeros((4, 2)), space, np.zeros((4, 2)))
    angle = np.linspace(0.05, 6.0, 50)
    circle = np.column_stack([np.cos(angle), np.sin(angle)])
    assert fields.is_inside((1.0 - 1e-9) * circle).all()
    assert not fields.is_inside(circle).any()
    assert not fields.is_inside((1.0 + 1e-9) * circle).any()


def test_data_that_do_not_fit_are_refused() -> None:
    mesh, other = straight_mesh(), straight_mesh()
    material, zeros = Material(1.0, 0.3), np.zeros((48, 2))
    with pytest.raises(GeometryError, match="traction_space is defined on another mesh"):
        InteriorFields(mesh, material, LinearSpace(mesh), zeros, ConstantSpace(other), zeros)
    with pytest.raises(ValueError, match=r"displacement_dofs has the shape \(47, 2\): give \(48, 2\)"):
        InteriorFields(mesh, material, LinearSpace(mesh), zeros[1:], ConstantSpace(mesh), zeros)
    with pytest.raises(ValueError, match=r"traction_dofs has the shape .* and is not finite"):
        InteriorFields(mesh, material, LinearSpace(mesh), zeros, ConstantSpace(mesh), zeros + np.inf)


@given(a=st.floats(-1e3, 1e3), b=st.floats(-1e3, 1e3), c=st.floats(-1e3, 1e3), nu=st.floats(-0.9, 0.5))
def test_stress_measures_agree_with_eigenvalues(a: float, b: float, c: float, nu: float) -> None:
    stress = np.array([[a, c], [c, b]])
    size = np.abs(stress).max() + 1e-100  # the squares of the reference underflow
    np.testing.assert_allclose(principal_stresses(stress), np.linalg.eigvalsh(stress)[::-1], atol=1e-13 * size)
    for plane, across in ((Plane.STRAIN, nu * (a + b)), (Plane.STRESS, 0.0)):
        full = np.zeros((3, 3))
        full[:2, :2], full[2, 2] = stress, across
        deviator = full - np.trace(full) / 3.0 * np.eye(3)
        expected = np.sqrt(1.5 * np.sum(deviator**2))
        assert von_mises(stress, nu, plane) == pytest.approx(expected, abs=1e-12 * size)


@pytest.mark.parametrize("discretisation", [bk.Galerkin(1), bk.Galerkin(2), bk.ConstantCollocation()])
def test_fields_inside_a_solved_scene(discretisation: bk.scene.Discretisation) -> None:
    # a block with nu = 0 pressed onto its foundation: uniform compression, exact for continuous displacements
    scene = bk.Scene(
        title="block",
        shape=Rectangle(2.0, 1.0),
        material=Material(100.0, 0.0),
        law=bk.Frictionless(),
        parts=(
            bk.Part("foundation", bk.Contact(bk.RigidHalfPlane()), sides=("bottom",)),
            bk.Part("wall", bk.Roller(), sides=("left",)),
            bk.Part("load", bk.Pressure(3.0), sides=("top",)),
        ),
        mesh=bk.MeshOptions(elements=60),
        discretisation=discretisation,
    )
    fields = interior_fields(bk.run(scene))
    x = np.array([[0.5, 0.5], [1.5, 0.3]])
    ceiling = 0.1 if isinstance(discretisation, bk.ConstantCollocation) else 1e-8
    assert np.abs(fields.stress(x) - [[0.0, 0.0], [0.0, -3.0]]).max() < ceiling
    assert np.abs(fields.displacement(x)[:, 1] + 0.03 * x[:, 1]).max() < 0.03 * ceiling
