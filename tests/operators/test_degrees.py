"""Elements of every degree: polynomial fields are exact, smooth ones converge, bad degrees are named."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.arrays import ComplexArray, FloatArray
from bemkit.errors import GeometryError
from bemkit.geometry.neighbours import break_nodes
from bemkit.geometry.quadrature import gauss_lobatto
from bemkit.geometry.spaces import LagrangeSpace, dof_points
from bemkit.operators.boundary import SteklovPoincareOperator
from bemkit.operators.somigliana.fields import InteriorFields
from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity
from bemkit.operators.steklov_poincare.nodal_conditions import integrate_traction
from bemkit.scene.toml import SceneError, load_scene, scene_from_toml, scene_to_toml, with_overrides
from tests.slow import slow_except

MATERIAL = bk.Material(1.0, 0.3)
CENTRE = 0.3 + 0.2j


def polynomial_field(degree: int) -> tuple[Callable[..., FloatArray], Callable[..., FloatArray]]:
    """Return displacements of a degree and their tractions.

    With phi = psi = (z - c)^degree [Muskhelishvili1953]: 2 mu (u_x + i u_y) = kappa phi - z conj(phi') - conj(psi),
    s_yy - i s_xy = phi' + conj(phi') + conj(z) phi'' + psi', s_xx + s_yy = 4 Re phi'.
    """
    kappa, mu = MATERIAL.kappa, MATERIAL.shear_modulus

    def displacement(points: FloatArray) -> FloatArray:
        z = points[:, 0] + 1j * points[:, 1] - CENTRE
        value = kappa * z**degree - z * np.conj(degree * z ** (degree - 1)) - np.conj(z**degree)
        return np.stack([value.real, value.imag], axis=1) / (2.0 * mu)

    def traction(points: FloatArray, normals: FloatArray) -> FloatArray:
        z: ComplexArray = points[..., 0] + 1j * points[..., 1] - CENTRE
        first = degree * z ** (degree - 1)
        second = degree * (degree - 1) * z ** (degree - 2) if degree > 1 else 0.0 * z
        shear_part = first + np.conj(first) + np.conj(z) * second + first
        s_yy, s_xy = shear_part.real, shear_part.imag
        s_xx = 4.0 * first.real - s_yy
        x, y = normals[..., 0], normals[..., 1]
        return np.stack([s_xx * x + s_xy * y, s_xy * x + s_yy * y], axis=-1)

    return displacement, traction


def squares() -> dict[str, bk.BoundaryMesh]:
    square = bk.Rectangle(1.0, 1.0).outline()
    return {
        "square": bk.discretise(square, n_elements=8),
        "sliver": bk.discretise(bk.Rectangle(1.0, 0.01).outline(), n_elements=12),
        "geometric": bk.discretise(square, n_elements=40, grading=bk.Geometric(0.1, 8)),
    }


MESHES = squares()


@pytest.mark.parametrize("name", MESHES)
@pytest.mark.parametrize("degree", slow_except(range(1, 13), 1, 2, 3, 8, 12))
def test_polynomial_fields_are_exact(degree: int, name: str) -> None:
    mesh = MESHES[name]
    space, tractions = (
        make(mesh) for make in (bk.Galerkin(degree).displacement_space, bk.Galerkin(degree).traction_space)
    )
    displacement, traction = polynomial_field(degree)
    u = displacement(dof_points(space))
    force = SteklovPoincareOperator(GalerkinElasticity(mesh, MATERIAL, space, tractions)) @ u.ravel()
    expected = integrate_traction(space, np.arange(mesh.n_elements), traction)
    # round-off of matrices whose condition grows with the degree and with the ratio of the lengths
    assert np.abs(force.reshape(-1, 2) - expected).max() < 1e-11 * np.abs(expected).max()


def test_fields_inside_are_those_polynomials() -> None:
    mesh, degree = MESHES["square"], 9
    space = LagrangeSpace(mesh, degree=degree)
    tractions = LagrangeSpace(mesh, break_nodes(mesh), degree=degree - 1)
    displacement, traction = polynomial_field(degree)
    normals, local = (
        np.empty((tractions.n_dofs // 2, 2)),
        mesh.normals_at(np.arange(mesh.n_elements), tractions.local_nodes),
    )
    normals[tractions.element_dofs] = local
    inside = InteriorFields(
        mesh, MATERIAL, space, displacement(dof_points(space)), tractions, traction(dof_points(tractions), normals)
    )
    # near a corner, near a side, in the middle; powers about an end cost high degrees some digits
    x = np.array([[0.001, 0.002], [0.5, 1e-6], [0.4, 0.6], [0.9, 0.3]])
    assert (
        np.abs(inside.displacement(x) - displacement(x)).max() < 1e-11 * np.abs(displacement(dof_points(space))).max()
    )
    for n in np.eye(2):
        expected = traction(x, np.tile(n, (len(x), 1)))
        assert (
            np.abs(inside.stress(x) @ n - expected).max()
            < 1e-9 * np.abs(traction(dof_points(tractions), normals)).max()
        )


def ring_error(degree: int) -> float:
    """Return the relative error of the inner displacement of a ring under inner pressure, against Lame's solution."""
    scene = bk.Scene(
        title="ring",
        shape=bk.Ring(0.5, 1.0),
        material=MATERIAL,
        parts=(bk.Part("inside", bk.Pressure(1.0), sides=tuple(f"inner-{k}" for k in range(1, 5))),),
        mesh=bk.MeshOptions(elements=16),
        symmetry=bk.Symmetry(x=0.0, y=0.0),
        discretisation=bk.Galerkin(degree),
    )
    boundary = bk.run(scene).boundary
    radius = np.hypot(*boundary.points.T)
    nu = MATERIAL.poisson_ratio
    a, b = 0.5, 1.0
    factor = (1.0 + nu) * a**2 / (b**2 - a**2)
    exact = factor * ((1.0 - 2.0 * nu) * radius + b**2 / radius)
    along = np.sum(boundary.displacement * boundary.points, axis=1) / radius
    return float(np.abs(along - exact).max() / exact.max())


@pytest.mark.slow
def test_smooth_fields_converge_with_the_degree() -> None:
    errors = [ring_error(degree) for degree in (1, 2, 3, 4, 6)]
    assert all(finer < 0.5 * coarser for coarser, finer in itertools.pairwise(errors)), errors
    assert errors[-1] < 1e-6


def geometric(singular: list[float], degree: int, ratio: float = 0.2) -> list[float]:
    """Divide [0, 1] at given places, with as many layers towards each as the degree has."""
    layers = [0.5 * ratio**k for k in range(degree, 0, -1)]
    unit = np.array([0.0, *layers, 0.5, *(1.0 - layer for layer in reversed(layers))])
    edges = [0.0, *singular, 1.0]
    return [a + (b - a) * s for a, b in itertools.pairwise(edges) for s in unit]


def example_mesh(degree: int) -> bk.BoundaryMesh:
    """Return the square of Example 1 with elements that shorten towards corners, load ends and places of transition."""
    middle, whole = geometric([0.5], degree), geometric([], degree)
    bottom = [(s, 0.0) for s in geometric([0.2575701, 0.4676382], degree)]
    right, top = [(1.0, s) for s in whole], [(1.0 - s, 1.0) for s in middle]
    points = np.array([*bottom, *right, *top, *((0.0, 1.0 - s) for s in middle)])
    number = np.arange(len(points))
    elements = np.stack([number, np.roll(number, -1)], axis=1)
    x, y = points[elements].mean(axis=1).T
    parts = {
        "foundation": number[: len(bottom)],
        "wall": number[len(bottom) : len(bottom) + len(right)],
        "top-load": number[(y == 1.0) & (x > 0.5)],
        "left-load": number[(x == 0.0) & (y > 0.5)],
    }
    return bk.BoundaryMesh(points, elements, parts)


@pytest.mark.slow
def test_friction_converges_exponentially_where_the_mesh_knows_the_singular_places() -> None:
    # the reference of the friction force is that of paper-1: 0.0821429, to its last digit
    scene = load_scene("paper-1")
    forces = []
    for degree in (2, 3, 4, 5):
        solution = bk.run(replace(scene, discretisation=bk.Galerkin(degree)), mesh=example_mesh(degree))
        forces.append(float(np.sum(solution.contact.weight * solution.contact.sigma_t)))
        assert solution.is_converged
    steps = np.abs(np.diff(forces))
    assert np.all(steps[1:] < 0.5 * steps[:-1])
    assert abs(abs(forces[-1]) - 0.0821429) < 1e-6


def test_gauss_lobatto_points_integrate_as_they_should() -> None:
    for degree in range(1, 13):
        points = gauss_lobatto(degree)
        polynomials = np.polynomial.legendre.legvander(points, degree)
        weights = 2.0 / (degree * (degree + 1) * polynomials[:, degree] ** 2)
        powers = np.arange(2 * degree)
        exact = np.where(powers % 2 == 0, 2.0 / (powers + 1), 0.0)
        assert np.abs(weights @ points[:, None] ** powers - exact).max() < 1e-14
        assert np.array_equal(points, -points[::-1])


@pytest.mark.parametrize("degree", [0, 13, 2.5, -1, True, "3"])
def test_bad_degrees_are_named(degree: object) -> None:
    with pytest.raises(GeometryError, match=rf"^degree is {degree!r}: give a whole number from 1 to 12$"):
        bk.Galerkin(degree)  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="give a whole number from 1 to 12"):
        LagrangeSpace(MESHES["square"], degree=degree)  # type: ignore[arg-type]


def test_scenes_name_a_degree() -> None:
    scene = with_overrides(load_scene("paper-1"), degree=4)
    assert scene.discretisation == bk.Galerkin(4)
    text = scene_to_toml(scene)
    assert scene_from_toml(text) == scene
    assert "degree = 4" in text
    with pytest.raises(SceneError, match="degree is 13: give a whole number from 1 to 12"):
        scene_from_toml(text.replace("degree = 4", "degree = 13"))
    with pytest.raises(SceneError, match="degree is 4 and discretisation is linear: give one of them"):
        with_overrides(scene, degree=4, discretisation="linear")
    with pytest.raises(SceneError, match="degree is 0: give a whole number from 1 to 12"):
        with_overrides(scene, degree=0)


def test_linear_and_quadratic_are_the_first_degrees() -> None:
    scene = with_overrides(load_scene("paper-1"), elements=40)
    for word, degree in (("linear", 1), ("quadratic", 2)):
        named, numbered = (with_overrides(scene, **change) for change in ({"discretisation": word}, {"degree": degree}))
        assert np.array_equal(bk.run(named).contact.sigma_n, bk.run(numbered).contact.sigma_n)
