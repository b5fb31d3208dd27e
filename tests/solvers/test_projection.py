import numpy as np
import pytest
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


def pairs(elements):
    return arrays(float, (N, 2), elements=elements)


# Sums of products of numbers up to 100 carry round-off of about 1e-11.
ROUND_OFF = 1e-9


@given(vector(numbers), vector(numbers))
def test_positive_part_is_firmly_nonexpansive(a, b):
    image = positive_part(a) - positive_part(b)
    assert image @ (a - b) >= image @ image - ROUND_OFF


@given(pairs(numbers), pairs(numbers), vector(bounds))
def test_clip_is_firmly_nonexpansive_for_vectors(x, y, bound):
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


@given(vector(numbers), vector(bounds))
def test_scalars_and_vectors_along_one_axis_agree(x, bound):
    flat = np.stack([np.zeros(N), x], axis=1)
    # |x| (x / |x|) differs from x by at most an ulp or two
    assert np.allclose(clip_to_bound(flat, bound)[:, 1], clip_to_bound(x, bound), rtol=1e-15, atol=0.0)
    by_x, by_bound = clip_to_bound_derivative(x, bound)
    flat_by_x, flat_by_bound = clip_to_bound_derivative(flat, bound)
    assert np.allclose(flat_by_x[:, 1, 1], by_x, atol=1e-15)
    assert np.allclose(flat_by_bound[:, 1], by_bound, rtol=1e-15)


@given(vector(numbers))
def test_positive_part_derivative(a):
    step = 1e-6
    away = np.abs(a) > 2 * step
    difference = (positive_part(a + step) - positive_part(a - step)) / (2 * step)
    # differences of numbers up to 100 with this step carry 1e-8
    assert np.allclose(positive_part_derivative(a)[away], difference[away], atol=1e-7)
    assert positive_part_derivative(np.zeros(1))[0] == 0.0


@given(pairs(numbers), vector(st.floats(0.1, 100.0)))
def test_clip_derivatives_are_those_of_differences(x, bound):
    step = 1e-5
    away = np.abs(np.linalg.norm(x, axis=1) - bound) > 1e-3
    by_x, by_bound = clip_to_bound_derivative(x, bound)
    for component in range(2):
        shift = step * np.eye(2)[component]
        difference = (clip_to_bound(x + shift, bound) - clip_to_bound(x - shift, bound)) / (2 * step)
        # third derivatives are at most bound/|x|^3 < 1e3 (|x| > bound >= 0.1): error step^2 * 1e3 = 1e-7
        assert np.allclose(by_x[away, :, component], difference[away], atol=1e-6)
    difference = (clip_to_bound(x, bound + step) - clip_to_bound(x, bound - step)) / (2 * step)
    assert np.allclose(by_bound[away], difference[away], atol=1e-6)


def test_ties_and_zeros_count_as_stick():
    by_x, by_bound = clip_to_bound_derivative(np.array([0.5, -0.5, 0.0]), np.array([0.5, 0.5, 0.0]))
    assert np.array_equal(by_x, [1.0, 1.0, 1.0])
    assert np.array_equal(by_bound, [0.0, 0.0, 0.0])


def test_refusals():
    with pytest.raises(ValueError, match="bound has the negative value -1"):
        clip_to_bound(np.zeros(2), -1.0)
    with pytest.raises(ValueError, match="x has 3 axes"):
        clip_to_bound(np.zeros((2, 2, 2)), 1.0)
