"""Fields below the surface of a half-plane: Hertz pressure, the surface itself, elasticity, and periodic images."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from mpmath import polylog
from scipy.optimize import minimize_scalar

import bemkit as bk
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.geometry.outline import Surface
from bemkit.geometry.proximity.location import PointNotInsideError
from bemkit.operators.half_plane.elasticity import half_plane_map
from bemkit.operators.half_plane.fields import HalfPlaneFields, dilogarithm
from bemkit.operators.material import Material, Plane

MATERIAL = Material(2.0, 0.3)


def strip(places: np.ndarray, angle: float = 0.0, *, is_periodic: bool = False) -> BoundaryMesh:
    n = len(places) - 1
    nodes = np.array([0.7, -0.2]) - places[:, None] * np.array([np.cos(angle), np.sin(angle)])
    elements = np.column_stack([np.arange(n), np.arange(1, n + 1)])
    return BoundaryMesh(nodes, elements, is_exterior=True, surface=Surface(is_periodic=is_periodic))


def fields_of(mesh: BoundaryMesh, traction: np.ndarray, material: Material = MATERIAL) -> HalfPlaneFields:
    unit = BoundaryMesh(mesh.nodes / mesh.diameter, mesh.elements, is_exterior=True, surface=mesh.surface)
    elastic = half_plane_map(unit, material)
    return HalfPlaneFields(
        mesh, material, traction, mesh.diameter * elastic.strain_displacement(traction * unit.lengths[:, None])
    )


def inward(mesh: BoundaryMesh, s: np.ndarray, depth: np.ndarray | float) -> np.ndarray:
    """Points at s along the tangent from the first node, and a depth."""
    return mesh.nodes[0] + np.outer(s, mesh.tangents[0]) - np.outer(depth * np.ones_like(s), mesh.normals[0])


def test_the_largest_shear_below_hertz_pressure() -> None:
    """Johnson (4.49): 0.300283 p0 at 0.786151 a on the axis."""
    places = 1.0 - np.cos(np.linspace(0.0, np.pi, 1601))
    ends = np.clip(places - 1.0, -1.0, 1.0)
    integral = 0.5 * (ends * np.sqrt(1.0 - ends**2) + np.arcsin(ends))
    mesh = strip(places)
    fields = fields_of(mesh, np.outer(np.diff(integral) / np.diff(ends), [0.0, -1.0]))

    def shear(depth: float) -> float:
        stress = fields.stress(inward(mesh, np.array([1.0]), depth))[0]
        return -float(np.hypot(0.5 * (stress[0, 0] - stress[1, 1]), stress[0, 1]))

    best = minimize_scalar(shear, bounds=(0.3, 1.5), method="bounded", options={"xatol": 1e-9})
    assert -best.fun == pytest.approx(0.300283, abs=1e-6)
    assert best.x == pytest.approx(0.786151, abs=1e-6)


@pytest.mark.parametrize("plane", Plane)
@pytest.mark.parametrize("is_periodic", [False, True])
def test_the_fields_meet_the_tractions_and_displacements_of_the_surface(plane: Plane, is_periodic: bool) -> None:
    n, angle = 40, 0.6
    mesh, material = strip(np.linspace(0.0, 3.0, n + 1), angle, is_periodic=is_periodic), Material(2.0, 0.3, plane)
    s = (np.arange(n) + 0.5) * 3.0 / n
    traction = np.stack([np.cos(2.0 * np.pi * s / 3.0) + 0.4, np.sin(4.0 * np.pi * s / 3.0) - 0.2], axis=1)
    traction[10:14] = 0.0
    fields = fields_of(mesh, traction, material)
    # the mean over an element by Gauss points just below it; single layers kink at its ends: 1e-4 of them
    xi, weights = np.polynomial.legendre.leggauss(40)
    unit = BoundaryMesh(mesh.nodes / mesh.diameter, mesh.elements, is_exterior=True, surface=mesh.surface)
    expected = mesh.diameter * half_plane_map(unit, material).strain_displacement(traction * unit.lengths[:, None])
    for element in (0, 7, 12, 25, 39):
        at = inward(mesh, s[element] + 1.5 / n * xi, 1e-9)
        np.testing.assert_allclose(0.5 * weights @ fields.displacement(at), expected[element], atol=2e-5)
        stress = fields.stress(inward(mesh, s[[element]], 1e-9))[0]
        np.testing.assert_allclose(stress @ mesh.normals[0], traction[element], atol=1e-7)


@pytest.mark.parametrize("is_periodic", [False, True])
def test_gradients_are_those_of_the_displacements_and_stresses_balance(is_periodic: bool) -> None:
    mesh = strip(np.linspace(0.0, 2.0, 9), 0.3, is_periodic=is_periodic)
    fields = fields_of(mesh, np.random.default_rng(0).normal(size=(8, 2)))
    x, h = inward(mesh, np.array([0.3, 1.1, 1.9]), np.array([0.2, 0.5, 1.0])), 1e-4
    steps = [h * np.eye(2)[k] for k in (0, 1)]
    slopes = np.stack([(fields.displacement(x + d) - fields.displacement(x - d)) / (2.0 * h) for d in steps], axis=2)
    np.testing.assert_allclose(fields.displacement_gradient(x), slopes, atol=1e-6)
    change = [(fields.stress(x + d) - fields.stress(x - d)) / (2.0 * h) for d in steps]
    np.testing.assert_allclose(change[0][:, :, 0] + change[1][:, :, 1], 0.0, atol=1e-5)
    strain, stress = fields.strain(x), fields.stress(x)
    mu, nu = MATERIAL.shear_modulus, MATERIAL.effective_poisson_ratio
    trace = np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    np.testing.assert_allclose(stress, 2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * trace), atol=1e-12)


def test_a_periodic_surface_is_a_row_of_strips() -> None:
    traction = np.array([[0.3, 1.0], [-0.3, -0.4], [0.1, -0.7], [-0.1, 0.1]])
    mesh = strip(np.linspace(0.0, 1.0, 5))
    periodic = fields_of(strip(np.linspace(0.0, 1.0, 5), is_periodic=True), traction)
    single, x = fields_of(mesh, traction), inward(mesh, np.array([0.2, 0.7]), np.array([0.1, 0.4]))
    shifts = np.arange(-2000.0, 2001.0)[:, None, None] * np.array([1.0, 0.0])
    images = single.stress((x + shifts).reshape(-1, 2)).reshape(len(shifts), len(x), 2, 2).sum(axis=0)
    # tractions without resultant: images decay like the square of the distance
    np.testing.assert_allclose(periodic.stress(x), images, atol=1e-4)
    np.testing.assert_allclose(periodic.displacement(x + np.array([3.0, 0.0])), periodic.displacement(x), atol=1e-12)


def test_the_dilogarithm_is_exact_up_to_the_unit_circle() -> None:
    """Both branches of its series, and its branch point; the tolerance is round-off of values up to pi^2 / 6."""
    radii = np.concatenate([np.linspace(0.0, 1.0, 12)[1:], 1.0 - np.logspace(-12, -3, 5)])
    z = np.concatenate([np.outer(radii, np.exp(1j * np.linspace(0.1, 6.2, 9))).ravel(), [1.0 - 1e-9 + 1e-9j, 0.5 + 0j]])
    exact = [complex(polylog(2, complex(each))) for each in z]
    assert dilogarithm(z, np.log1p(-z)) == pytest.approx(np.array(exact), abs=2e-15)


def test_the_fields_of_a_solved_scene_join_its_surface() -> None:
    far = bk.FarField(x=0.02, force_y=0.05, moment=0.002)
    scene = bk.Scene(
        title="strip",
        shape=bk.ElasticHalfPlane(-1.0, 1.0),
        material=MATERIAL,
        law=bk.Coulomb(0.3),
        parts=(bk.Part("zone", bk.Contact(bk.Gap(bk.Expression("0.1 * x**2")))),),
        far=far,
        mesh=bk.MeshOptions(elements=100),
    )
    for asked in (scene, replace(bk.load_scene("rough-surface"), mesh=bk.MeshOptions(elements=64))):
        solution = bk.run(asked)
        fields, mesh = bk.interior_fields(solution), solution.mesh
        xi, weights = np.polynomial.legendre.leggauss(40)
        points = mesh.centres[:, None] + 0.5 * xi[:, None] * (mesh.lengths[:, None] * mesh.tangents)[:, None]
        below = fields.displacement((points - 1e-9 * mesh.normals[:, None]).reshape(-1, 2)).reshape(-1, xi.size, 2)
        expected = solution.boundary.displacement
        means = 0.5 * np.einsum("g,egc->ec", weights, below)
        # kinks at the ends of elements leave 1e-4
        np.testing.assert_allclose(means, expected, atol=2e-4 * np.abs(expected).max())


def test_points_above_the_surface_and_meshes_with_another_boundary_are_refused() -> None:
    mesh = strip(np.linspace(0.0, 1.0, 5))
    fields = fields_of(mesh, np.ones((4, 2)))
    np.testing.assert_array_equal(fields.is_inside(inward(mesh, np.array([0.5, 0.5]), np.array([0.1, -0.1]))), [1, 0])
    with pytest.raises(PointNotInsideError, match=r"point 1 at \(0\.2, -0\.1\) lies on or above the surface"):
        fields.stress(inward(mesh, np.array([0.5, 0.5]), np.array([0.1, -0.1])))
    square = bk.Rectangle(1.0, 1.0)
    parts = (bk.Part("floor", bk.Clamped(), ("bottom",)),)
    closed = bk.Scene(
        title="s", shape=square, material=MATERIAL, parts=parts, mesh=bk.MeshOptions(elements=8)
    ).build_mesh()
    with pytest.raises(bk.InputError, match="mesh has closed boundaries"):
        HalfPlaneFields(closed, MATERIAL, np.zeros((8, 2)), np.zeros((8, 2)))
