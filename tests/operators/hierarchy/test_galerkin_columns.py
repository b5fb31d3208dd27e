"""Entries of Galerkin's equations: those of the operators, for any rows and columns, compiled or not."""

from __future__ import annotations

from functools import cache
from itertools import product

import numpy as np
import pytest

import bemkit as bk
from bemkit.geometry import BoundaryMesh, Disk, PlateWithHole, Rectangle, Symmetry, discretise
from bemkit.geometry.spaces import BoundarySpace, dof_points
from bemkit.operators import boundary
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.compression import Compression
from bemkit.operators.hierarchy.element_pairs import ElementPairs
from bemkit.operators.hierarchy.galerkin_columns import GalerkinColumns
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.material import Material
from tests.slow import slow_except

MATERIAL = Material(2.0, 0.3)
SHAPES = {
    "rectangle": (Rectangle(1.0, 2.0), None),
    "plate with a round hole": (PlateWithHole(2.0, 1.5, 0.4), None),
    "half of a rectangle": (Rectangle(1.0, 2.0, (-0.5, -1.0)), Symmetry(x=0.0)),
    "quarter of a disc": (Disk(1.0), Symmetry(x=0.0, y=0.0)),
}


@cache
def columns_of(name: str, degree: int, n_elements: int = 120) -> tuple[GalerkinColumns, ClusterTree]:
    tree = ClusterTree.of(np.concatenate([dof_points(space) for space in spaces_of(name, degree, n_elements)]), 40)
    return GalerkinColumns.of(*spaces_of(name, degree, n_elements), MATERIAL, tree.order), tree


@cache
def spaces_of(name: str, degree: int, n_elements: int = 120) -> tuple[BoundarySpace, BoundarySpace]:
    shape, symmetry = SHAPES[name]
    mesh: BoundaryMesh = discretise(shape.outline(), n_elements=n_elements, symmetry=symmetry).unit
    discretisation = bk.Galerkin(degree)
    return discretisation.displacement_space(mesh), discretisation.traction_space(mesh)


def dense_of(name: str, degree: int) -> np.ndarray:
    """The same equations from the operators, by place, tractions in their units."""
    u, t = spaces_of(name, degree)
    v, w = boundary.single_layer(t, t, MATERIAL), boundary.hypersingular(u, u, MATERIAL)
    k = boundary.double_layer(u, t, MATERIAL)
    boundary.assemble(v, k, w)
    trace = k.matrix() + 0.5 * boundary.mass(u, t).matrix().toarray()
    whole = np.block([[w.matrix(), trace.T], [trace, -v.matrix()]])
    columns = columns_of(name, degree)[0]
    order, units = (2 * columns.order[:, None] + np.arange(2)).ravel(), np.repeat(columns.units, 2)
    return np.asarray(whole[np.ix_(order, order)] * np.outer(units, units))


@pytest.mark.parametrize(
    ("name", "degree"),
    slow_except(product(SHAPES, (1, 2)), ("plate with a round hole", 1), ("quarter of a disc", 2)),
)
def test_entries_are_those_of_the_operators(name: str, degree: int) -> None:
    columns, _ = columns_of(name, degree)
    dense, everything = dense_of(name, degree), np.arange(2 * columns.n_elements)
    active = np.flatnonzero(~columns.idle)
    block = columns.between(everything, everything)
    # the entries are of the size of E', and far pairs are integrated to 1e-13 by either
    np.testing.assert_allclose(block[np.ix_(active, active)], dense[np.ix_(active, active)], atol=1e-12)
    rng = np.random.default_rng(0)
    rows, some = rng.permutation(everything)[:57], rng.permutation(everything)[:71]
    np.testing.assert_allclose(columns.between(rows, some), block[np.ix_(rows, some)], atol=1e-14)
    # unknowns that are zero by symmetry have an equation that says so, and no other one feels them
    idle = np.flatnonzero(columns.idle & np.repeat(~columns.is_node, 2))
    assert not block[np.ix_(idle, active)].any()
    assert (np.diagonal(block)[idle] < 0.0).all()


def test_forces_are_felt_by_their_own_nodes_alone() -> None:
    columns, _ = columns_of("rectangle", 1)
    node = int(np.flatnonzero(columns.is_node)[5])
    rows = np.arange(2 * columns.n_elements)
    block = columns.entries(rows, np.array([4 * node, 4 * node + 1, 4 * node + 2]))
    expected = np.zeros((rows.size, 2))
    expected[[2 * node, 2 * node + 1], [0, 1]] = -columns.weights[node]
    np.testing.assert_array_equal(block[:, :2], expected)
    np.testing.assert_array_equal(block[:, 2], columns.between(rows, np.array([2 * node]))[:, 0])
    # and the weight is the integral of its function: with those of all others the length of the boundary
    assert columns.weights[columns.is_node].sum() == pytest.approx(columns.weights[~columns.is_node].sum())


@pytest.mark.parametrize("degree", [1, 2])
def test_kernels_in_numpy_are_the_compiled_ones(degree: int, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("numba")
    for name in SHAPES:
        mesh = spaces_of(name, degree)[0].mesh
        pairs, rows, columns = ElementPairs.of(mesh, degree), np.arange(7, 27), np.arange(0, mesh.whole.n_elements, 3)
        one = pairs.integrals(rows, columns)
        with monkeypatch.context() as patch:
            patch.setattr(compiled, "functions", lambda: None)
            two = pairs.integrals(rows, columns)
        # logarithms are good to three units of the last place
        np.testing.assert_allclose(one, two, rtol=1e-13, atol=1e-16 * np.abs(two).max())


def test_rigid_motions_cause_nothing_outside() -> None:
    for degree in (1, 2):
        columns, _ = columns_of("plate with a round hole", degree)
        points = 5.0 * np.exp(2j * np.pi * np.arange(7) / 7.0)
        nodes = np.flatnonzero(columns.is_node)
        of_motion = columns.fields(points, np.concatenate([4 * nodes + 2, 4 * nodes + 3]))
        motion = np.repeat([1.0, -2.0], nodes.size)
        # the Gauss rule of an element of 0.04 diameters at ten times that is exact to round-off
        assert np.abs(of_motion @ motion).max() < 1e-14
        assert np.abs(of_motion).max() > 1e-4


@pytest.mark.parametrize(("name", "degree"), slow_except(product(SHAPES, (1, 2)), ("quarter of a disc", 1)))
def test_products_with_skeletons_are_those_of_the_equations(name: str, degree: int) -> None:
    columns, tree = columns_of(name, degree, 300)
    differ = np.repeat(np.stack([np.ones_like(columns.is_node), columns.is_node], axis=1), 2, axis=1)
    values = np.zeros((columns.n_elements, 4, 2))
    x, y = columns.centre.real, columns.centre.imag
    values[columns.is_node, 2:, 0] = np.stack([np.cos(3.0 * x), np.sin(2.0 * y)], axis=1)[columns.is_node]
    values[~columns.is_node, :2, 1] = np.stack([np.cos(5.0 * y), x], axis=1)[~columns.is_node]
    values[columns.idle.reshape(-1, 2)[:, [0, 1, 0, 1]]] = 0.0
    places = np.arange(0, columns.n_elements, 11)
    for tolerance in (1e-6, 1e-10):
        compression = Compression.of(columns, tree, differ, tolerance)
        product = compression.product(values.reshape(-1, 2)).reshape(-1, 2, 2)[places]
        for k, kind in enumerate((True, False)):
            traction, displacement = values[:, :2, k], values[:, 2:, k]
            exact = columns.applied(places, np.where(kind, 0.0, traction), np.where(kind, displacement, 0.0))
            error = np.abs(product[:, :, k] - exact) / columns.sizes[places, None]
            # a few times the tolerance is found on all shapes
            assert error.max() < 20.0 * tolerance
