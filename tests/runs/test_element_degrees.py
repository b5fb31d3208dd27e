"""Degrees that differ from element to element."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

import bemkit as bk
from bemkit.errors import GeometryError, InputError
from bemkit.geometry.local_values import continued_to_ends, dof_weights, summed_at_dofs, values_on_elements
from bemkit.geometry.quadrature import gauss_lobatto
from bemkit.geometry.series import series
from bemkit.geometry.spaces import LagrangeSpace, dof_points, lagrange_polynomials
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.operators.boundary import hypersingular
from bemkit.runs.element_degrees import LEAST_DEGREE, below_layers, few_kinds, sufficient_degrees
from bemkit.scene.toml import scene_from_toml, scene_to_toml

DEGREES = (1, 4, 2, 6, 3, 3, 5, 2)


def square(symmetry: bk.Symmetry | None = None) -> bk.BoundaryMesh:
    outline = bk.Rectangle(1.0, 1.0).outline()
    return bk.discretise(outline, n_elements=len(DEGREES), symmetry=symmetry)


def mixed(mesh: bk.BoundaryMesh) -> LagrangeSpace:
    return LagrangeSpace(mesh, degree=max(DEGREES), element_degrees=np.array(DEGREES))


def test_a_list_of_equal_degrees_is_that_degree() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=16))
    one, many = (
        bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(degree)))
        for degree in (3, (3,) * len(scene.build_mesh().elements))
    )
    assert one.energy == many.energy


def test_every_element_holds_the_polynomials_of_its_degree() -> None:
    mesh = square()
    space = mixed(mesh)
    assert space.n_dofs == 2 * sum(DEGREES)
    xi = np.linspace(-1.0, 1.0, 9)
    rng = np.random.default_rng(3)
    values = values_on_elements(space, rng.standard_normal(space.n_dofs // 2)) @ space.basis(xi)
    np.testing.assert_array_equal(values[:, -1], np.roll(values[:, 0], -1))
    for own, degree in zip(values, DEGREES, strict=True):
        fitted = np.polynomial.Legendre.fit(xi, own, degree)
        np.testing.assert_allclose(fitted(xi), own, atol=1e-12)
    points = dof_points(space)
    np.testing.assert_allclose(
        values_on_elements(space, points[:, 0]) @ space.basis(xi), mesh.points(np.arange(8), xi)[:, :, 0], atol=1e-14
    )


def test_unknown_values_continue_the_polynomial_of_the_others() -> None:
    """On each element a polynomial of a degree less, unknown at the start; with nothing known zeros stay."""
    space, xi = mixed(square()), np.linspace(-1.0, 1.0, 9)
    elements = np.arange(len(DEGREES))
    for element, degree in enumerate(DEGREES):
        of_degree = lagrange_polynomials(gauss_lobatto(degree), xi)
        own = [*range(degree), space.degree]
        at_dofs, is_known = np.zeros((len(DEGREES), space.degree + 1)), np.zeros((len(DEGREES), space.degree + 1), bool)
        is_known[element, own[1:]] = True
        at_dofs[element, own] = gauss_lobatto(degree) ** (degree - 1) + 1.0
        at_dofs[element, 0] = 17.0
        row, local, factors = continued_to_ends(space, elements, is_known)
        continued = at_dofs.copy()
        continued[row, local] = np.sum(factors * at_dofs[row], axis=1)
        np.testing.assert_allclose(continued[element, own] @ of_degree, xi ** (degree - 1) + 1.0, atol=1e-12)
        assert not np.delete(continued, element, axis=0).any()


def test_integrals_are_summed_up_by_the_transpose() -> None:
    space, rng = mixed(square()), np.random.default_rng(4)
    everything = np.arange(len(DEGREES))
    dofs, integrals = rng.standard_normal(space.n_dofs // 2), rng.standard_normal((8, 7))
    summed = summed_at_dofs(space, integrals, everything) @ dofs
    assert summed == pytest.approx(np.sum(integrals * values_on_elements(space, dofs)), rel=1e-13)
    assert dof_weights(space, everything).sum() == pytest.approx(4.0, rel=1e-14)


def test_the_series_of_an_element_end_with_its_degree() -> None:
    space = mixed(square())
    coefficients = (series(space).T @ np.random.default_rng(5).standard_normal(space.n_dofs // 2)).reshape(8, 7)
    assert [int(np.flatnonzero(own).max()) for own in coefficients] == list(DEGREES)


@pytest.mark.parametrize("symmetry", [None, bk.Symmetry(x=0.5)])
def test_a_series_is_the_function_and_its_slope_on_all_images(symmetry: bk.Symmetry | None) -> None:
    mesh = square(symmetry)
    space = LagrangeSpace(mesh, degree=6, element_degrees=np.resize(DEGREES, mesh.n_elements))
    points, n = dof_points(space) - np.array([0.5, 0.0]), mesh.whole.n_elements
    xi = np.linspace(-1.0, 1.0, 5)
    polynomials = np.polynomial.legendre.legvander(xi, 6)
    along = mesh.whole.tangents
    for component in (0, 1):  # x is antisymmetric, as the component x of a displacement is
        values = (series(space, component=component).T @ points[:, component]).reshape(n, -1) @ polynomials.T
        expected = mesh.whole.points(np.arange(n), xi)[:, :, component] - (0.5, 0.0)[component]
        np.testing.assert_allclose(values, expected, atol=1e-14)
        slopes = series(space, derivative=True, component=component).T @ points[:, component]
        np.testing.assert_allclose(slopes.reshape(n, -1)[:, 0], along[:, component], atol=1e-13)


@pytest.mark.parametrize("symmetry", [None, bk.Symmetry(x=0.5)])
def test_the_operators_are_those_of_the_largest_degree_on_its_functions(symmetry: bk.Symmetry | None) -> None:
    mesh = square(symmetry)
    degrees = np.resize(DEGREES, mesh.n_elements)
    space = LagrangeSpace(mesh, degree=6, element_degrees=degrees)
    large = LagrangeSpace(mesh, degree=6)
    lifted = np.zeros((large.n_dofs // 2, space.n_dofs // 2))
    for dof, unit in enumerate(np.eye(space.n_dofs // 2)):
        lifted[large.element_dofs, dof] = values_on_elements(space, unit)
    lifting = np.kron(lifted, np.eye(2))
    own, whole = (hypersingular(each, each, bk.Material(1.0, 0.3)).matrix() for each in (space, large))
    expected = lifting.T @ whole @ lifting
    vanishes = antisymmetric_dofs(space)  # on the line; of the large space only the nodes there
    expected[vanishes] = expected[:, vanishes] = 0.0
    np.testing.assert_allclose(own, expected, atol=1e-12 * np.abs(whole).max())


@pytest.mark.parametrize("low", [2, 3])
def test_patch_of_a_polynomial_that_every_element_holds(low: int) -> None:
    """S of a linear field is its tractions; round-off of 1e-11 is that of the single layer, as for equal degrees."""
    mesh = square()
    degrees = tuple(max(degree, low) for degree in DEGREES)
    discretisation, material = bk.Galerkin(degrees), bk.Material(1.0, 0.3)
    elastic = discretisation.elastic_map(mesh, material, bk.DenseCholesky())
    stretch = dof_points(discretisation.displacement_space(mesh)) * [1.0, 0.0]
    traction = elastic.element_tractions(stretch, np.zeros_like(stretch))
    lame = material.plane_modulus  # plane strain: sigma_x = E' / (1 - nu'^2), nu' = nu / (1 - nu)
    ratio = 0.3 / 0.7
    stress = np.diag([lame / (1.0 - ratio**2), ratio * lame / (1.0 - ratio**2)])
    expected = np.einsum("ij,ej->ei", stress, mesh.normals)[:, None]
    np.testing.assert_allclose(traction, np.broadcast_to(expected, traction.shape), atol=1e-11)


def test_wholes_of_degree_four_beside_halves_of_degree_two() -> None:
    """Alternately degree 4 on wholes and 2 on halves: the energies of both orders agree to their estimates."""
    scene = dataclasses.replace(bk.load_scene("paper-1"), mesh=bk.MeshOptions(elements=40, grading=bk.Algebraic(2.0)))
    mesh = scene.build_mesh()
    solutions = []
    for first in (0, 1):
        halved = np.arange(first, mesh.n_elements, 2)
        fine = mesh.refined(halved)
        is_half = np.repeat(
            np.isin(np.arange(mesh.n_elements), halved), 1 + np.isin(np.arange(mesh.n_elements), halved)
        )
        degrees = tuple(np.where(is_half, 2, 4).tolist())
        solutions.append(bk.run(dataclasses.replace(scene, discretisation=bk.Galerkin(degrees)), mesh=fine))
    one, two = solutions
    assert one.is_converged
    assert two.is_converged
    assert one.estimated_error is not None
    assert two.estimated_error is not None
    assert abs(one.energy / two.energy - 1.0) <= one.estimated_error**2 + two.estimated_error**2


def test_degrees_survive_their_text() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), discretisation=bk.Galerkin((2, 3, 4)))
    text = scene_to_toml(scene)
    assert "degree = [" in text
    assert scene_from_toml(text) == scene


def test_wrong_lists_are_refused() -> None:
    scene = dataclasses.replace(bk.load_scene("paper-1"), discretisation=bk.Galerkin([2, 3, 4]))
    with pytest.raises(
        GeometryError, match=r"degree has 3 entries, but the mesh has \d+ elements[:;].* give one degree"
    ):
        bk.run(scene)
    for wrong in (0, 13, 2.5):
        with pytest.raises(GeometryError, match=r"degree is .*: give a whole number from 1 to 12"):
            bk.Galerkin([2, wrong])  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="degree has no entries: give one whole number, or one for each element"):
        bk.Galerkin([])  # type: ignore[arg-type]
    with pytest.raises(GeometryError, match="degree has 3 entries for 8 elements: give one for each element"):
        LagrangeSpace(square(), degree=4, element_degrees=np.array([4, 4, 2]))
    with pytest.raises(GeometryError, match="degree is 7, and that of elements up to 6: give the largest one"):
        LagrangeSpace(square(), degree=7, element_degrees=np.array(DEGREES))


def test_several_bodies_take_one_degree() -> None:
    assembly = bk.load_scene("two-cylinders")
    assert isinstance(assembly, bk.Scene)
    with pytest.raises(InputError, match=r"degree is a list, of body .*[:;].* give one degree"):
        dataclasses.replace(assembly, discretisation=bk.Galerkin((2, 3)))


def test_degrees_suffice_and_are_few() -> None:
    falling = sufficient_degrees(lambda degrees: 9e2 * np.array([0.1, 0.5]) ** degrees, 2, 9)
    np.testing.assert_array_equal(falling, [LEAST_DEGREE, 9])
    layers = below_layers(np.full(4, 8), np.array([0.0, 1.0, 2.0, 9.0]))
    np.testing.assert_array_equal(layers, [8, 7, 5, LEAST_DEGREE])
    asked = np.repeat([3, 4, 5, 6, 7, 9], 30)
    taken = few_kinds(asked)
    assert np.unique(taken).size <= 3
    assert (taken >= asked).all()
    assert taken.max() == 9
    np.testing.assert_array_equal(few_kinds(np.array([3, 4])), [4, 4])  # not worth a sweep
