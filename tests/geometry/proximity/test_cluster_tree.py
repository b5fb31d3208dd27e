"""The tree of clusters."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.geometry import Rectangle, discretise
from bemkit.geometry.proximity.cluster_tree import ClusterTree


@given(n=st.integers(4, 300), leaf_size=st.integers(2, 60), seed=st.integers(0, 9))
@settings(max_examples=40, deadline=None)
def test_leaves_hold_every_point_once_and_nearly_as_many_each(n: int, leaf_size: int, seed: int) -> None:
    tree = ClusterTree.of(np.random.default_rng(seed).normal(size=(n, 2)), leaf_size)
    np.testing.assert_array_equal(np.sort(tree.order), np.arange(n))
    assert tree.n_leaves == 2**tree.n_levels >= 2
    sizes = np.diff(tree.bounds)
    assert sizes.max() - sizes.min() <= 1 or sizes.max() <= 3 * leaf_size  # two leaves, cut at a gap
    assert sizes.sum() == n
    places = np.arange(n)
    for leaf in range(tree.n_leaves):
        np.testing.assert_array_equal(tree.leaves_of(places[tree.positions(0, leaf)]), [leaf] if sizes[leaf] else [])
    for level in range(1, tree.n_levels + 1):
        for cluster in range(2 ** (tree.n_levels - level)):
            one, two = (tree.positions(level - 1, 2 * cluster + k) for k in (0, 1))
            assert tree.positions(level, cluster) == slice(one.start, two.stop)
            assert one.stop == two.start


def test_both_long_sides_of_a_strip_share_a_leaf() -> None:
    strip = discretise(Rectangle(100.0, 0.1).outline(), n_elements=400)
    tree = ClusterTree.of(strip.centres, 32)
    for leaf in range(tree.n_leaves):
        y = strip.centres[tree.order[tree.positions(0, leaf)]][:, 1]
        assert y.min() == pytest.approx(0.0)
        assert y.max() == pytest.approx(0.1)


def test_a_side_with_most_elements_is_divided_at_points() -> None:
    """Of elements in line none is nearer than others to a line along them: any half of these would do."""
    block = discretise(Rectangle(1.0, 1.0).outline(), n_elements=900, density={"bottom": 27.0})
    tree = ClusterTree.of(block.centres, 64)
    leaf_of = np.empty(block.n_elements, np.intp)
    leaf_of[tree.order] = np.repeat(np.arange(tree.n_leaves), np.diff(tree.bounds))
    bottom = np.flatnonzero(block.centres[:, 1] == 0.0)
    changes = np.count_nonzero(np.diff(leaf_of[bottom[np.argsort(block.centres[bottom, 0])]]))
    assert bottom.size > 0.85 * block.n_elements
    assert changes < tree.n_leaves


def test_a_leaf_holds_no_few_elements_far_from_the_others() -> None:
    """Else one leaf of this block has a proxy circle as wide as the block, and three quarters of it inside."""
    block = discretise(Rectangle(1.0, 1.0).outline(), n_elements=22222, density={"bottom": 27.0})
    tree = ClusterTree.of(block.centres, 88)
    z = block.centres[tree.order] @ np.array([1.0, 1.0j])
    for leaf in range(tree.n_leaves):
        own = z[tree.positions(0, leaf)]
        radius = np.abs(own - own.mean()).max()
        assert np.count_nonzero(np.abs(z - own.mean()) < 2.0 * radius) < 0.1 * z.size
