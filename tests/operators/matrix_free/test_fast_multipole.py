"""Products by the fast multipole method: those of the dense operators."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.geometry import BoundaryMesh
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.collocation.equations import CollocationEquations, collocation_equations
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.fast_multipole import LEAF_SIZE, FastMultipole
from tests.operators.hierarchy.test_system import SHAPES, graded, mesh_of
from tests.slow import slow_except

TINY = 1e-12


def multipole_of(
    mesh: BoundaryMesh, *, tolerance: float = TINY, takes_slopes: bool = True, poisson_ratio: float = 0.3
) -> FastMultipole:
    tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
    material = Material(2.0, poisson_ratio)
    equations = collocation_equations(mesh, material, tree.order, takes_slopes=takes_slopes)
    assert isinstance(equations, CollocationEquations)
    return FastMultipole(equations, material, tree, tolerance)


def error_of(operator: FastMultipole) -> float:
    """Largest difference from products with all entries, of tractions alone and of displacements alone."""
    n = operator.equations.points.size
    matrix = operator.equations.block(np.arange(2 * n), np.arange(4 * n))
    densities = np.random.default_rng(0).standard_normal((n, 4))
    errors = []
    for kept in ([1.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 1.0]):
        state = densities * kept
        exact = matrix @ state.ravel()
        errors.append(np.abs(operator.product(state[:, :2], state[:, 2:]).ravel() - exact).max() / np.abs(exact).max())
    return float(max(errors))


@pytest.mark.parametrize("name", slow_except(SHAPES, "hole"))
def test_products_are_those_of_the_dense_operators(name: str) -> None:
    assert error_of(multipole_of(mesh_of(name, 600))) < TINY


@pytest.mark.parametrize("poisson_ratio", slow_except([-0.5, 0.0, 0.5], 0.5))
def test_material_and_slopes(poisson_ratio: float) -> None:
    assert error_of(multipole_of(mesh_of("hole", 400), takes_slopes=False, poisson_ratio=poisson_ratio)) < TINY


@pytest.mark.parametrize("power", [pytest.param(3.0, marks=pytest.mark.slow), 6.0])
def test_graded_meshes(power: float) -> None:
    # elements as long as their cluster beside others that are 1e10 times shorter
    assert error_of(multipole_of(graded(200, power))) < TINY


@pytest.mark.slow
def test_errors_follow_the_tolerance() -> None:
    errors = [error_of(multipole_of(mesh_of("rectangle", 400), tolerance=each)) for each in (1e-3, 1e-6, 1e-9)]
    # series of random densities err by less than their bound, and do err
    assert 1e-5 * 1e-3 < errors[0] < 1e-3
    assert errors[1] < 1e-6
    assert errors[2] < 1e-9
    assert errors[0] > 10.0 * errors[1] > 100.0 * errors[2]


@pytest.mark.usefixtures("compiled_at_once")
def test_numpy_and_numba_give_the_same_products() -> None:
    assert error_of(multipole_of(mesh_of("rectangle", 400))) < TINY


def test_units_of_length_and_material() -> None:
    mesh = mesh_of("rectangle", 300)
    small = BoundaryMesh(1e-3 * mesh.nodes, mesh.elements)
    assert error_of(multipole_of(small)) < TINY


def test_nothing_is_stored_that_grows_like_the_square_of_the_elements() -> None:
    # pairs of clusters that are far from each other, and near ones, by leaf
    counts = []
    for n in (1000, 4000):
        operator = multipole_of(mesh_of("rectangle", n))
        pairs = sum(level.target.size for level in operator._levels) + operator._near.source.size
        counts.append(pairs / operator.tree.n_leaves)
    assert counts[1] < 1.2 * counts[0]
