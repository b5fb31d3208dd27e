"""The operators themselves: laziness, sharing, adjointness, numbering, refusals."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.sparse.linalg import gmres

import bemkit as bk
from bemkit.arrays import FloatArray
from bemkit.geometry import BoundaryMesh, GeometryError
from bemkit.geometry.neighbours import corner_nodes
from bemkit.geometry.spaces import ConstantSpace, LinearSpace, QuadraticSpace
from bemkit.operators.boundary import (
    PairOperator,
    adjoint_double_layer,
    assemble,
    double_layer,
    hypersingular,
    mass,
    single_layer,
)
from bemkit.operators.integrals.sweep import PairSweep
from bemkit.operators.linear_solvers import Cholesky, DenseLU, SingularMatrixError, multiply

MATERIAL = bk.Material(2.0, 0.25)


def l_shape(n_elements: int = 36) -> BoundaryMesh:
    vertices = ((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0))
    return bk.discretise(bk.Polygon(vertices).outline(), n_elements=n_elements)


def operators(mesh: BoundaryMesh) -> tuple[PairOperator, PairOperator, PairOperator]:
    tractions, displacements = ConstantSpace(mesh), LinearSpace(mesh)
    return (
        single_layer(tractions, tractions, MATERIAL),
        double_layer(displacements, tractions, MATERIAL),
        hypersingular(displacements, displacements, MATERIAL),
    )


def test_nothing_is_computed_before_it_is_asked_for_and_then_only_once() -> None:
    v, _, _ = operators(l_shape())
    assert not v.is_assembled
    first = v.matrix()
    assert v.is_assembled
    assert v.matrix() is first
    assert not first.flags.writeable


def test_one_sweep_gives_the_same_matrices_as_three() -> None:
    mesh = l_shape()
    together, alone = operators(mesh), operators(mesh)
    assemble(*together)
    assemble(*together)  # assembled operators are left alone
    for one, other in zip(together, alone, strict=True):
        # products of matrices of other sizes add up in another order
        np.testing.assert_allclose(one.matrix(), other.matrix(), rtol=0.0, atol=1e-15 * np.abs(one.matrix()).max())


def test_adjoint_is_exactly_the_transpose() -> None:
    mesh = l_shape()
    tractions, displacements = ConstantSpace(mesh), LinearSpace(mesh)
    adjoint = adjoint_double_layer(tractions, displacements, MATERIAL)
    double = double_layer(displacements, tractions, MATERIAL)
    np.testing.assert_array_equal(adjoint.matrix(), double.matrix().T)


def renumbered(mesh: BoundaryMesh, nodes: np.ndarray, elements: np.ndarray) -> BoundaryMesh:  # type: ignore[type-arg]
    """The same mesh with node k of the new one being node nodes[k] of the old one, likewise for elements."""
    position = np.empty(mesh.n_nodes, dtype=np.intp)
    position[nodes] = np.arange(mesh.n_nodes)
    return BoundaryMesh(mesh.nodes[nodes], position[mesh.elements[elements]])


def expanded(scalar: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
    return (2 * scalar[:, None] + np.arange(2)).ravel()


@given(seed=st.integers(0, 1000))
@settings(max_examples=settings.default.max_examples // 4)
def test_results_do_not_depend_on_numbering(seed: int) -> None:
    rng = np.random.default_rng(seed)
    mesh = l_shape(24)
    nodes, elements = rng.permutation(mesh.n_nodes), rng.permutation(mesh.n_elements)
    v, k, w = operators(mesh)
    v2, k2, w2 = operators(renumbered(mesh, nodes, elements))
    rows, columns = expanded(elements), expanded(nodes)
    for one, two, r, c in ((v, v2, rows, rows), (k, k2, rows, columns), (w, w2, columns, columns)):
        matrix = one.matrix()
        np.testing.assert_allclose(two.matrix(), matrix[np.ix_(r, c)], rtol=0.0, atol=1e-14 * np.abs(matrix).max())


def test_operators_are_combined_and_solved_with_as_linear_operators_of_scipy() -> None:
    mesh = l_shape()
    v, k, _ = operators(mesh)
    m = mass(k.trial, k.test)
    u = np.random.default_rng(3).normal(size=k.trial.n_dofs)
    right = (0.5 * m + k) @ u
    np.testing.assert_allclose(right, 0.5 * (m.matrix() @ u) + k.matrix() @ u, rtol=1e-14, atol=1e-14)
    tractions, flag = gmres(v, right, rtol=1e-12)
    assert flag == 0
    np.testing.assert_allclose(v.matrix() @ tractions, right, rtol=0.0, atol=1e-11 * np.abs(right).max())


@pytest.mark.parametrize(
    ("make", "symmetry"),
    [
        (LinearSpace, bk.Symmetry(x=0.0)),
        pytest.param(QuadraticSpace, None, marks=pytest.mark.slow),
        pytest.param(LinearSpace, None, marks=pytest.mark.slow),
        pytest.param(QuadraticSpace, bk.Symmetry(x=0.0), marks=pytest.mark.slow),
    ],
)
def test_blocks_are_computed_alone_and_equal_those_of_the_matrix(make: type, symmetry: bk.Symmetry | None) -> None:
    outline = bk.PlateWithHole(4.0, 2.0, 0.5, (-2.0, -1.0)).outline()
    mesh = bk.discretise(outline, n_elements=48, symmetry=symmetry)
    u, t = make(mesh), LinearSpace(mesh, corner_nodes(mesh))
    rng = np.random.default_rng(1)
    for operator in (
        single_layer(t, t, MATERIAL),
        double_layer(u, t, MATERIAL),
        double_layer(u, t, MATERIAL).T,
        hypersingular(u, u, MATERIAL),
        mass(u, t),
    ):
        rows, columns = (rng.choice(n, 7, replace=False) for n in operator.shape)
        block = operator.block(rows, columns)
        matrix = operator.block(*(np.arange(n) for n in operator.shape))
        # sums of the same few terms, with another number of Gauss points for far pairs
        np.testing.assert_allclose(block, matrix[np.ix_(rows, columns)], rtol=0.0, atol=2e-15 * np.abs(matrix).max())
        assert operator.block(rows, columns[:0]).shape == (7, 0)


def test_a_block_of_a_large_operator_computes_few_pairs(monkeypatch: pytest.MonkeyPatch) -> None:
    v, _, _ = operators(l_shape(600))
    sizes = []
    sweep = PairSweep.__init__
    monkeypatch.setattr(
        PairSweep, "__init__", lambda self, *a: (sweep(self, *a), sizes.append(self.test.size * self.trial.size))[0]
    )
    block = v.block(np.arange(10), np.arange(600, 640))
    assert sizes == [5 * 20]
    assert not v.is_assembled
    # the same far pairs with two Gauss points or three
    np.testing.assert_allclose(block, v.matrix()[:10, 600:640], rtol=1e-14)


@pytest.mark.parametrize("rows", [[-1], [72], [0.5], [[0]], [True]])
def test_blocks_that_do_not_exist_are_refused(rows: list[object]) -> None:
    v, _, _ = operators(l_shape())
    with pytest.raises(bk.InputError, match=r"block: rows is .*: give a list of whole numbers from 0 to 71"):
        v.block(np.array(rows), np.arange(2))


def test_mass_integrates_products() -> None:
    mesh = l_shape()
    space = QuadraticSpace(mesh)
    total = np.ones(space.n_dofs // 2)
    matrix = mass(space, space).matrix()
    assert matrix.nnz == 2 * 9 * 36 - 2 * 36  # each element couples its three nodes, neighbours share one
    matrix = matrix.toarray()[::2, ::2]
    assert total @ matrix @ total == pytest.approx(8.0, rel=1e-14)  # the length of the boundary
    # a product of matrices may sum the two halves in different orders
    np.testing.assert_allclose(matrix, matrix.T, rtol=1e-14, atol=1e-16)


def test_spaces_that_do_not_fit_are_refused() -> None:
    mesh, other = l_shape(), l_shape()
    tractions, displacements = ConstantSpace(mesh), LinearSpace(mesh)
    with pytest.raises(GeometryError, match="are defined on different meshes: build both on the same BoundaryMesh"):
        single_layer(tractions, ConstantSpace(other), MATERIAL)
    with pytest.raises(GeometryError, match="hypersingular needs a continuous trial space, but ConstantSpace may jump"):
        hypersingular(tractions, displacements, MATERIAL)
    with pytest.raises(GeometryError, match="hypersingular needs a continuous test space"):
        hypersingular(displacements, LinearSpace(mesh, corner_nodes(mesh)), MATERIAL)
    with pytest.raises(GeometryError, match="double_layer needs a continuous trial space"):
        double_layer(tractions, tractions, MATERIAL)
    here = single_layer(tractions, tractions, MATERIAL)
    there = single_layer(ConstantSpace(other), ConstantSpace(other), MATERIAL)
    with pytest.raises(GeometryError, match="assemble those of one mesh at a time"):
        assemble(here, there)


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"youngs_modulus": -1.0}, "youngs_modulus is -1.0: give a positive"),
        ({"poisson_ratio": 0.6}, r"poisson_ratio is 0.6: .*\(-1, 0.5\]"),
    ],
)
def test_impossible_materials_are_refused(values: dict[str, float], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        bk.Material(**({"youngs_modulus": 1.0, "poisson_ratio": 0.3} | values))


def test_plane_stress_and_plane_strain_moduli() -> None:
    stress, strain = bk.Material(3.0, 0.3, bk.Plane.STRESS), bk.Material(3.0, 0.3)
    assert stress.plane_modulus == pytest.approx(3.0)
    assert strain.plane_modulus == pytest.approx(3.0 / (1 - 0.09))
    assert stress.kappa == pytest.approx((3 - 0.3) / 1.3)
    assert strain.kappa == pytest.approx(3 - 1.2)
    assert stress.shear_modulus == strain.shear_modulus == pytest.approx(3.0 / 2.6)


def test_matrices_that_cannot_be_factored_are_named() -> None:
    singular: FloatArray = np.ones((3, 3))
    with pytest.raises(SingularMatrixError, match="the thing is not positive definite: check for coincident"):
        Cholesky(singular, "the thing")
    with pytest.raises(SingularMatrixError, match=r"the thing is singular \(reciprocal condition"):
        DenseLU(np.asfortranarray(singular), "the thing")


@given(st.integers(1, 6), st.integers(1, 6), st.integers(1, 6), st.booleans(), st.booleans())
def test_multiply_is_the_matrix_product(m: int, k: int, n: int, left: bool, right: bool) -> None:
    rng = np.random.default_rng(m + 10 * k + 100 * n)
    a, b = rng.normal(size=(m, k)), rng.normal(size=(k, n))
    product = multiply(a if left else np.asfortranarray(a), b if right else np.asfortranarray(b))
    np.testing.assert_allclose(product, a @ b, rtol=1e-13, atol=1e-13)
