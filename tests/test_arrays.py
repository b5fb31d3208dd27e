"""Blocks of matrices, copied run by run."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import block_of

FEW, EVERY_THIRD = np.r_[0:5, 9, 12:20], np.arange(1, 20, 3)
SCATTERED = np.array([19, 0, 7, 5, 3, 11, 9, 15, 13, 1, 17])
"""More runs than are told apart."""


@pytest.mark.parametrize("rows", [FEW, EVERY_THIRD, SCATTERED, FEW[:0]])
@pytest.mark.parametrize("columns", [FEW, EVERY_THIRD, SCATTERED, FEW[:0]])
def test_a_block_is_that_of_all_pairs_of_indices(rows: np.ndarray, columns: np.ndarray) -> None:
    matrix = np.random.default_rng(0).normal(size=(20, 20))
    block = block_of(matrix, rows, columns)
    np.testing.assert_array_equal(block, matrix[np.ix_(rows, columns)])
    assert block.flags.c_contiguous
    assert not np.shares_memory(block, matrix)
