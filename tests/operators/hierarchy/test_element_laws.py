"""Two linear conditions on an element, solved for two of its four quantities."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bemkit.contact.body import augmented, separated, slip, stick
from bemkit.operators.boundary_equations import LinearConditions
from bemkit.operators.hierarchy.system import UndeterminedError, solved


@given(seed=st.integers(0, 10_000), unit=st.sampled_from([1e-6, 1.0, 1e3]))
@settings(max_examples=60, deadline=None)
def test_whatever_the_unknowns_are_the_conditions_hold(seed: int, unit: float) -> None:
    rng = np.random.default_rng(seed)
    on_traction, on_displacement = rng.normal(size=(2, 8, 2, 2)) * rng.integers(0, 2, (2, 8, 2, 2))
    value = rng.normal(size=(8, 2))
    rows = np.concatenate([on_traction, on_displacement / unit], axis=2)
    rank = np.array([np.linalg.matrix_rank(each * [1, 1, unit, unit], tol=1e-9) for each in rows])
    conditions = LinearConditions(on_displacement / unit, on_traction, value)
    for node in np.flatnonzero(rank < 2):
        with pytest.raises(UndeterminedError, match="the two conditions at a contact node are not independent"):
            solved(conditions.take(np.array([node])), unit)
    good = np.flatnonzero(rank == 2)
    laws, rows, value = solved(conditions.take(good), unit), rows[good], value[good]
    z = rng.normal(size=(good.size, 2, 1))
    state = (laws.factors @ z)[:, :, 0] + laws.given
    met = np.einsum("nrk,nk->nr", rows, state)
    size = np.einsum("nrk,nk->nr", np.abs(rows), np.abs(state)) + np.abs(value)
    # pivots are within a factor ten of the best, so that round-off is a few eps of the terms
    assert np.all(np.abs(met - value) <= 1e-11 * size)
    # two unknowns, independent of each other
    assert np.all(np.linalg.matrix_rank(laws.factors * [[1], [1], [1 / unit], [1 / unit]]) == 2)


def test_contact_conditions_are_met_to_the_last_digit() -> None:
    gap, shift = np.array([0.1, 0.3, -0.7]), np.array([0.2, -0.4, 0.5])
    z = np.array([[0.3, -0.9], [1.7, 2.1], [-0.4, 0.6]])
    for conditions, held in (
        (stick(gap, shift), {2: gap, 3: shift}),
        (separated(3), {0: 0.0 * gap, 1: 0.0 * gap}),
        (slip(gap, np.ones(3), np.full(3, -2.0), np.zeros(3)), {2: gap}),
    ):
        laws = solved(conditions, 1e-3)
        state = (laws.factors @ z[:, :, None])[:, :, 0] + laws.given
        for component, expected in held.items():
            np.testing.assert_array_equal(state[:, component], expected)
    np.testing.assert_array_equal(state[:, 1], 2.0 * state[:, 0])  # slip along the tangent: t_t = 2 t_n


def test_augmented_conditions_leave_two_unknowns() -> None:
    conditions = augmented(np.zeros(2), np.zeros(2), np.ones((2, 2)), 5.0, 7.0)
    laws = solved(conditions, 0.1)
    state = (laws.factors @ np.ones((2, 2, 1)))[:, :, 0] + laws.given
    np.testing.assert_allclose(state[:, :2] + state[:, 2:] * [5.0, 7.0], 1.0, rtol=1e-14)
