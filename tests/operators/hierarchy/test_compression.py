"""Skeletons of clusters: far blocks of the equations from a few entries, whatever the kinds of unknowns."""

from __future__ import annotations

import pickle

import numpy as np
import pytest

from bemkit.geometry import BoundaryMesh, Polygon, Rectangle, discretise
from bemkit.geometry.proximity.cluster_tree import ClusterTree, Discs
from bemkit.operators.collocation.equations import collocation_equations
from bemkit.operators.hierarchy.skeletons import PROXY_RATIO, Compression, n_proxies, near_clusters, proxy_points
from bemkit.operators.material import Material
from tests.slow import slow_except, slow_only

L_SHAPE = Polygon(((0.0, 0.0), (2.0, 0.0), (2.0, 1.0), (1.0, 1.0), (1.0, 2.0), (0.0, 2.0)))


def compressed(mesh: BoundaryMesh, tolerance: float, *, slopes: bool = True) -> Compression:
    tree = ClusterTree.of(mesh.centres, 24)
    equations = collocation_equations(mesh, Material(1.0, 0.3), tree.order, takes_slopes=slopes)
    return Compression.of(equations, tree, np.ones((mesh.n_elements, 4), bool), tolerance)


@pytest.mark.parametrize("slopes", slow_except([True, False], True), ids=["slopes", "constant"])
@pytest.mark.parametrize("tolerance", slow_except([1e-6, 1e-11], 1e-11))
@pytest.mark.parametrize(
    "shape",
    slow_only([Rectangle(1.0, 1.0), Rectangle(20.0, 0.1), L_SHAPE], Rectangle(1.0, 1.0)),
    ids=["square", "strip", "L"],
)
def test_blocks_between_leaves_follow_from_their_skeletons(
    shape: Rectangle | Polygon, tolerance: float, slopes: bool
) -> None:
    compression = compressed(discretise(shape.outline(), n_elements=240).unit, tolerance, slopes=slopes)
    equations, tree, leaves = compression.equations, compression.tree, compression.skeletons[0]
    for one in (0, 3, tree.n_leaves - 1):
        for two in (1, 2, tree.n_leaves - 2):
            if one == two:
                continue
            rows = np.arange(2 * tree.positions(0, one).start, 2 * tree.positions(0, one).stop)
            block = equations.block(rows, compression.unknowns[two])
            few = equations.block(leaves[one].rows, leaves[two].columns)
            error = np.abs(leaves[one].row_map.matrix() @ few @ leaves[two].column_map.matrix().T - block).max()
            # ten times: interpolation multiplies what pivoted QR leaves out, which is measured in mean squares
            assert error <= 10.0 * tolerance * np.abs(block).max() + 1e-14


@pytest.mark.parametrize("is_compiled", [False, True], ids=["numpy", "numba"])
def test_columns_of_one_kind_are_compressed_alone(request: pytest.FixtureRequest, is_compiled: bool) -> None:
    if is_compiled:
        request.getfixturevalue("compiled_at_once")
    mesh = discretise(L_SHAPE.outline(), n_elements=240).unit
    tree = ClusterTree.of(mesh.centres, 24)
    equations = collocation_equations(mesh, Material(1.0, 0.3), tree.order, takes_slopes=True)
    place = equations.points.real + 2.0 * equations.points.imag
    for kind in (0, 1):
        may_differ = np.tile(np.arange(4) // 2 == kind, (mesh.n_elements, 1))
        compression = Compression.of(equations, tree, may_differ, 1e-9)
        leaves = compression.skeletons[0]
        for receiver, source in ((0, len(leaves) - 1), (len(leaves) - 1, 0), (1, 2)):
            unknowns, own = compression.unknowns[source], tree.positions(0, receiver)
            values = np.cos(place[unknowns // 4] + unknowns % 4)
            exact = equations.block(np.arange(2 * own.start, 2 * own.stop), unknowns) @ values
            between = equations.block(leaves[receiver].rows, leaves[source].columns)
            found = leaves[receiver].row_map.matrix() @ (between @ leaves[source].column_map.gather(values))
            # sums over all elements of errors below the tolerance each
            assert np.abs(found - exact).max() <= 1e-8 * np.abs(exact).max()


@pytest.mark.slow
def test_skeletons_stay_small_on_thin_bodies() -> None:
    for height in (1.0, 1e-3):
        compression = compressed(discretise(Rectangle(10.0, height).outline(), n_elements=1200).unit, 1e-8)
        # both sides of the strip are one cluster; along the boundary they would be two that couple everywhere
        assert max(skeleton.columns.size for level in compression.skeletons for skeleton in level) < 200


@pytest.mark.slow
def test_memory_grows_like_the_number_of_elements() -> None:
    small, large = (
        len(pickle.dumps(compressed(discretise(Rectangle(1.0, 1.0).outline(), n_elements=n).unit, 1e-6).skeletons))
        for n in (300, 1200)
    )
    assert 3.0 < large / small < 5.0


def test_discs_hold_their_clusters_and_proxies_lie_around_them() -> None:
    mesh = discretise(L_SHAPE.outline(), n_elements=200).unit
    tree = ClusterTree.of(mesh.centres, 16)
    equations = collocation_equations(mesh, Material(1.0, 0.3), tree.order, takes_slopes=True)
    for level in range(tree.n_levels):
        discs = Discs.around(tree, level, equations.supports)
        for cluster in range(discs.radius.size):
            places = tree.positions(level, cluster)
            far = np.abs(equations.supports[:, places] - discs.centre[cluster]).max()
            assert far == pytest.approx(discs.radius[cluster])
            around = np.abs(proxy_points(discs, cluster, 8) - discs.centre[cluster])
            np.testing.assert_allclose(around, PROXY_RATIO * discs.radius[cluster])
            near = near_clusters(discs, cluster)
            assert cluster not in near
            others = np.setdiff1d(np.arange(discs.radius.size), [cluster, *near])
            apart = np.abs(discs.centre[others] - discs.centre[cluster]) - discs.radius[others]
            assert np.all(apart >= PROXY_RATIO * discs.radius[cluster] * (1.0 - 1e-14))
    # an element acts on its neighbours
    assert np.all(np.abs(equations.supports - equations.points).max(axis=0) > equations.lengths)
    assert n_proxies(1e-12) > n_proxies(1e-6)
