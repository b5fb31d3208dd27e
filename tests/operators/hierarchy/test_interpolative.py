"""Interpolative decompositions."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.operators.hierarchy.interpolative import interpolative


@given(m=st.integers(1, 40), n=st.integers(1, 40), rank=st.integers(1, 12), seed=st.integers(0, 99))
@settings(max_examples=60, deadline=None)
def test_columns_follow_from_those_of_the_skeleton(m: int, n: int, rank: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(m, rank)) @ np.diag(10.0 ** -np.arange(rank)) @ rng.normal(size=(rank, n))
    skeleton, interpolation = interpolative(matrix.copy(), 1e-5)
    assert skeleton.size <= min(m, n, rank)
    np.testing.assert_allclose(interpolation[:, skeleton], np.eye(skeleton.size), atol=1e-14)
    error = np.linalg.norm(matrix - matrix[:, skeleton] @ interpolation, axis=0).max()
    # pivoted QR leaves at most sqrt(n) times the next pivot in any column
    assert error <= np.sqrt(n) * 1e-5 * np.linalg.norm(matrix, axis=0).max()


def test_nothing_has_no_skeleton() -> None:
    for shape in ((0, 3), (3, 0)):
        skeleton, interpolation = interpolative(np.zeros(shape), 1e-8)
        assert skeleton.size == 0
        assert interpolation.shape == (0, shape[1])
    skeleton, _ = interpolative(np.zeros((4, 3)), 1e-8)
    assert skeleton.size == 0
