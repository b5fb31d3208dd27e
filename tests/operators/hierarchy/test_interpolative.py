"""Interpolative decompositions."""

from __future__ import annotations

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.arrays import FloatArray
from bemkit.operators.hierarchy import interpolative as interpolative_module
from bemkit.operators.hierarchy.interpolative import Block, interpolative, sketched


@given(
    m=st.integers(1, 60),
    n=st.integers(1, 40),
    rank=st.integers(1, 12),
    seed=st.integers(0, 99),
    guess=st.sampled_from([None, 2, 15]),
)
@settings(max_examples=60, deadline=None)
def test_columns_follow_from_those_of_the_skeleton(m: int, n: int, rank: int, seed: int, guess: int | None) -> None:
    rng = np.random.default_rng(seed)
    matrix = rng.normal(size=(m, rank)) @ np.diag(10.0 ** -np.arange(rank)) @ rng.normal(size=(rank, n))
    weights = np.exp(rng.normal(size=m))
    result = interpolative(matrix.copy(), 1e-5)
    if guess is not None:
        result = sketched([Block(matrix, weights)], np.ones(n), 1e-5, guess)
    weighted = matrix if guess is None else matrix * weights[:, None]
    assert result.skeleton.size <= min(m, n, rank)
    np.testing.assert_array_equal(np.sort(np.concatenate([result.skeleton, result.rest])), np.arange(n))
    error = np.linalg.norm(weighted - weighted[:, result.skeleton] @ result.matrix().T, axis=0).max()
    # pivoted QR leaves at most sqrt(n) times the next pivot in any column; random combinations know it to a factor ten
    largest = np.linalg.norm(weighted, axis=0).max()
    assert error <= (1.0 if guess is None else 10.0) * np.sqrt(n) * 1e-5 * largest
    values = rng.normal(size=n)
    np.testing.assert_allclose(
        result.gather(values), result.matrix().T @ values, atol=1e-12 * np.abs(result.weights).max(initial=1.0)
    )


def test_a_rank_above_the_guess_is_found() -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(400, 60)) @ rng.normal(size=(60, 150))
    assert sketched([Block(matrix, np.ones(400))], np.ones(150), 1e-9, 5).skeleton.size == 60


def test_combinations_that_were_too_few_are_kept() -> None:
    rng = np.random.default_rng(0)
    matrix, taken = rng.normal(size=(400, 60)) @ rng.normal(size=(60, 150)), []

    class Recorded(Block):
        def combined(self, numbers: slice, first: int) -> FloatArray:
            taken.append(numbers)
            return super().combined(numbers, first)

    assert sketched([Recorded(matrix, np.ones(400))], np.ones(150), 1e-9, 20).skeleton.size == 60
    assert len(taken) > 2
    assert [each.start for each in taken] == [0, *(each.stop for each in taken[:-1])]


def test_round_off_of_rows_is_no_rank() -> None:
    rng = np.random.default_rng(0)
    matrix = rng.normal(size=(400, 8)) @ rng.normal(size=(8, 150))
    matrix *= 1.0 + 1e-15 * rng.normal(size=matrix.shape)
    assert sketched([Block(matrix, np.ones(400))], np.ones(150), 1e-15, 60).skeleton.size == 8


def test_weights_hold_for_the_columns_as_they_are() -> None:
    rng = np.random.default_rng(0)
    matrix, sizes = rng.normal(size=(90, 5)) @ rng.normal(size=(5, 40)), 10.0 ** rng.uniform(-3, 3, 40)
    result = sketched([Block(matrix, np.ones(90))], sizes, 1e-10, 8)
    assert result.skeleton.size == 5
    np.testing.assert_allclose(matrix[:, result.skeleton] @ result.matrix().T, matrix, atol=1e-8 * np.abs(matrix).max())


def test_blocks_and_kinds_of_columns_count_alike_whatever_their_sizes() -> None:
    rng = np.random.default_rng(0)
    large, small = (rng.normal(size=(120, 4)) @ rng.normal(size=(4, 50)) for _ in range(2))
    kinds = np.repeat([0, 1], 25)
    units = np.where(kinds == 0, 1.0, 1e-9)
    for guess in (None, 12):
        blocks = [Block(large * units, np.ones(120)), Block(1e-9 * small * units, np.ones(120))]
        result = sketched(blocks, np.ones(50), 1e-6, guess, kinds=kinds)
        assert result.skeleton.size == 8
        for block in (large, small):
            error = (block * units)[:, result.skeleton] @ result.matrix().T - block * units
            assert np.abs(error / units).max() < 1e-5 * np.abs(block).max()


def test_columns_may_be_chosen() -> None:
    rng = np.random.default_rng(0)
    matrix, chosen = rng.normal(size=(90, 5)) @ rng.normal(size=(5, 40)), np.arange(3, 40, 2)
    result = sketched([Block(matrix, np.ones(90))], np.ones(chosen.size), 1e-10, 8, chosen=chosen)
    assert result.n == chosen.size
    own = matrix[:, chosen]
    np.testing.assert_allclose(own[:, result.skeleton] @ result.matrix().T, own, atol=1e-8 * np.abs(own).max())


def test_nothing_has_no_skeleton() -> None:
    for shape in ((0, 3), (3, 0)):
        result = interpolative(np.zeros(shape), 1e-8)
        assert result.skeleton.size == 0
        assert result.matrix().shape == (shape[1], 0)
    assert interpolative(np.zeros((4, 3)), 1e-8).skeleton.size == 0


def test_few_random_numbers_are_kept() -> None:
    before = interpolative_module._kept_random.cache_info().currsize
    one, two = (interpolative_module._random(2**10, 2**9 + 1) for _ in range(2))
    np.testing.assert_array_equal(one, two)
    assert interpolative_module._kept_random.cache_info().currsize == before
    assert interpolative_module._random(8, 8) is interpolative_module._random(8, 8)
