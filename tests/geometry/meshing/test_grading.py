import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import GeometryError
from bemkit.geometry.meshing.discretise import Algebraic, Geometric, Grading, Uniform

gradings = st.one_of(
    st.just(Uniform()),
    st.floats(1.0, 4.0).map(Algebraic),
    st.builds(Geometric, st.floats(0.1, 0.9), st.integers(0, 8)),
)


@given(gradings, st.integers(1, 60))
def test_positions_increase_from_0_to_1_and_mirror(grading: Grading, n: int) -> None:
    positions = grading.positions(n)
    assert positions.shape == (n + 1,)
    assert positions[0] == 0.0
    assert positions[-1] == 1.0
    assert (np.diff(positions) > 0.0).all()
    # sums of n numbers below 1
    assert np.allclose(positions, 1.0 - positions[::-1], rtol=0.0, atol=1e-15 * n)


@given(st.integers(1, 40))
def test_exponent_1_is_uniform(n: int) -> None:
    assert np.allclose(Algebraic(1.0).positions(n), Uniform().positions(n), rtol=0.0, atol=2e-16)


def test_algebraic_is_a_power_of_the_distance() -> None:
    assert Algebraic(2.0).positions(4).tolist() == [0.0, 0.125, 0.5, 0.875, 1.0]


@given(st.floats(0.2, 0.8), st.integers(1, 6), st.integers(0, 9))
def test_geometric_lengths(ratio: float, levels: int, extra: int) -> None:
    lengths = np.diff(Geometric(ratio, levels).positions(2 * levels + 1 + extra))
    # 0.2**6 = 6e-5 loses four of sixteen digits next to 1
    assert np.allclose(lengths[:levels] / lengths[1 : levels + 1], ratio, rtol=1e-11)
    assert np.allclose(lengths[levels : levels + 1 + extra], lengths.max(), rtol=1e-12)


def test_geometric_with_few_elements_keeps_the_smallest() -> None:
    lengths = np.diff(Geometric(0.5, 40).positions(4))
    assert np.allclose(lengths, [1 / 6, 1 / 3, 1 / 3, 1 / 6], rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Algebraic(0.5), r"Algebraic: exponent is 0.5: give a finite number of at least 1"),
        (lambda: Algebraic(np.inf), r"Algebraic: exponent is inf"),
        (lambda: Geometric(1.0, 3), r"Geometric: ratio is 1.0: give a number between 0 and 1"),
        (lambda: Geometric(np.nan, 3), r"Geometric: ratio is nan"),
        (lambda: Geometric(0.5, -1), r"Geometric: levels is -1: give a whole number"),
        (lambda: Geometric(0.5, 2.5), r"Geometric: levels is 2.5: give a whole number"),
    ],
)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()
