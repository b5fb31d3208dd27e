"""Element lengths next to denser neighbours."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import bemkit as bk
from bemkit.geometry.meshing.discretise import ALIKE, LARGEST_STRETCH, gradual_positions

sizes = st.floats(1e-6, 1e3)


@given(st.integers(1, 200), sizes, sizes)
def test_positions_increase_and_no_element_is_much_longer_than_the_mean(n: int, before: float, after: float) -> None:
    positions = gradual_positions(n, before, after)
    assert positions.shape == (n + 1,)
    assert positions[0] == 0.0
    assert positions[-1] == 1.0
    lengths = np.diff(positions)
    assert lengths.min() > 0.0
    assert lengths.max() <= LARGEST_STRETCH / n * (1.0 + 1e-3)  # the sums that place them are that good


@given(st.integers(1, 200), st.floats(0.84, 10.0), st.floats(0.84, 10.0))
def test_neighbours_of_about_the_same_length_change_nothing(n: int, before: float, after: float) -> None:
    np.testing.assert_array_equal(gradual_positions(n, before / n, after / n), np.arange(n + 1) / n)


@pytest.mark.parametrize("length", [1.0, 1.0 / ALIKE])
def test_neighbours_as_long_up_to_round_off_are_settled_alike(length: float) -> None:
    n = 8
    shorter, longer = (gradual_positions(n, 0.2 / n, length * (1.0 + off) / n) for off in (-1e-9, 1e-9))
    np.testing.assert_allclose(shorter, longer, atol=1e-8)
    before, after = (gradual_positions(n, length * (1.0 + off) / n, np.inf) for off in (-1e-9, 1e-9))
    np.testing.assert_allclose(before, after, atol=1e-8)


@pytest.mark.parametrize("ratio", [4.0, 10.0, 100.0])
def test_lengths_grow_gradually(ratio: float) -> None:
    n = 60
    lengths = np.diff(gradual_positions(n, 1.0 / (ratio * n), np.inf))
    growth = lengths[1:] / lengths[:-1]
    assert 0.99 < lengths[0] * ratio * n < 1.2  # as long as the neighbour at its end, and 0.3 / 2 of that more
    assert 0.99 < growth.min()
    assert growth.max() < 1.4  # exp(0.3) and round-off of the sums
    np.testing.assert_allclose(
        gradual_positions(n, np.inf, 1.0 / (ratio * n)),
        1.0 - gradual_positions(n, 1.0 / (ratio * n), np.inf)[::-1],
        atol=1e-12,  # sums of some thousand terms
    )


def test_sides_lead_to_a_dense_one_and_keep_their_numbers() -> None:
    outline = bk.Rectangle(1.0, 1.0).outline()
    mesh = bk.discretise(outline, n_elements=130, density={"bottom": 10.0})
    by_side = np.split(mesh.lengths, [100, 110, 120])
    assert [len(lengths) for lengths in by_side] == [100, 10, 10, 10]
    bottom, right, top, left = by_side
    np.testing.assert_allclose(bottom, 0.01, rtol=1e-12)
    np.testing.assert_allclose(top, 0.1, rtol=1e-12)
    np.testing.assert_allclose(right, left[::-1], rtol=1e-9)  # sums of some hundred terms
    assert right[0] < 0.016  # ten elements grow faster than sixty
    assert np.all(np.diff(right) > -1e-12)


def test_a_grading_of_ones_own_stays_as_it_is() -> None:
    outline = bk.Rectangle(1.0, 1.0).outline()
    grading = bk.Algebraic(2.0)
    mesh = bk.discretise(outline, n_elements=130, density={"bottom": 10.0}, grading=grading)
    np.testing.assert_allclose(mesh.lengths[100:110], np.diff(grading.positions(10)), rtol=1e-12)
