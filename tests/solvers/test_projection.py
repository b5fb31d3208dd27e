import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bemkit.solvers.active_sets import (
    clip_to_bound,
    clip_to_bound_derivative,
    positive_part,
    positive_part_derivative,
)

# Small integers among the numbers make ties and zeros common.
numbers = st.one_of(st.integers(-3, 3).map(float), st.floats(-100.0, 100.0, allow_subnormal=False))
bounds = st.one_of(st.integers(0, 3).map(float), st.floats(0.0, 100.0, allow_subnormal=False))
positive = st.floats(0.01, 100.0)
N = 6


def vector(elements):
    return arrays(float, N, elements=elements)


# Sums of products of numbers up to 100 carry round-off of about 1e-11.
ROUND_OFF = 1e-9


@given(vector(numbers), vector(numbers))
def test_positive_part_is_firmly_nonexpansive(a, b):
    image = positive_part(a) - positive_part(b)
    assert image @ (a - b) >= image @ image - ROUND_OFF


@given(vector(numbers), vector(numbers), vector(bounds))
def test_clip_is_firmly_nonexpansive(x, y, bound):
    image = clip_to_bound(x, bound) - clip_to_bound(y, bound)
    assert (image * (x - y)).sum() >= (image * image).sum() - ROUND_OFF


@given(vector(numbers), vector(bounds))
def test_clip_is_a_projection(x, bound):
    image = clip_to_bound(x, bound)
    assert np.all(np.abs(image) <= bound)
    assert np.array_equal(clip_to_bound(image, bound), image)
    inside = np.abs(x) <= bound
    assert np.array_equal(image[inside], x[inside])
    assert np.array_equal(image[~inside], (bound * np.sign(x))[~inside])


@given(vector(numbers))
def test_positive_part_derivative(a):
    step = 1e-6
    away = np.abs(a) > 2 * step
    difference = (positive_part(a + step) - positive_part(a - step)) / (2 * step)
    # differences of numbers up to 100 with this step carry 1e-8
    assert np.allclose(positive_part_derivative(a)[away], difference[away], atol=1e-7)
    assert positive_part_derivative(np.zeros(1))[0] == 0.0


@given(vector(numbers), vector(st.floats(0.1, 100.0)))
def test_clip_derivative_is_that_of_differences(x, bound):
    step = 1e-5
    away = np.abs(np.abs(x) - bound) > 2 * step
    by_bound = clip_to_bound_derivative(x, bound)
    difference = (clip_to_bound(x, bound + step) - clip_to_bound(x, bound - step)) / (2 * step)
    # differences of numbers up to 100 with this step carry 1e-9
    assert np.allclose(by_bound[away], difference[away], atol=1e-7)


def test_ties_and_zeros_count_as_stick():
    assert not clip_to_bound_derivative(np.array([0.5, -0.5, 0.0]), np.array([0.5, 0.5, 0.0])).any()
