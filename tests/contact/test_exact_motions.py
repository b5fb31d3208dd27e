"""Rigid motions of a condensed body to the last digit, and nothing repaired that is not round-off."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.contact.contact_nodes import resisting_none, with_work

EPS = np.finfo(float).eps


@given(st.integers(0, 2**32 - 1), st.booleans())
def test_round_off_is_taken_out(seed: int, is_symmetric: bool) -> None:
    rng = np.random.default_rng(seed)
    n = 12
    motions = np.linalg.qr(rng.standard_normal((n, 3)))[0].T
    rest = np.eye(n) - motions.T @ motions
    exact, noise = rest @ rng.standard_normal((n, n)) @ rest, 1e-8 * rng.standard_normal((n, n))
    if is_symmetric:
        exact, noise = exact + exact.T, noise + noise.T
    stiffness = resisting_none(exact + noise, motions)
    # sums of a dozen products of numbers up to five or ten, twice
    atol = 200 * EPS
    assert max(np.abs(stiffness @ motions.T).max(), np.abs(motions @ stiffness).max()) < atol
    np.testing.assert_allclose(rest @ stiffness @ rest, rest @ (exact + noise) @ rest, atol=atol)
    np.testing.assert_allclose(stiffness, stiffness.T if is_symmetric else stiffness, atol=atol)
    load = rng.standard_normal(n)
    np.testing.assert_allclose(
        motions @ with_work(load + 1e-8, motions, motions @ load, 10.0), motions @ load, atol=atol
    )


@pytest.mark.parametrize("defect", [1e-4, 1.0])
def test_what_is_no_round_off_stays(defect: float) -> None:
    motions = np.array([[1.0, 0.0, 1.0, 0.0]])
    held = np.diag([defect, 1.0, 0.0, 1.0])
    assert resisting_none(held, motions) is held
    load = np.array([defect, 0.0, 0.0, 0.0])
    assert with_work(load, motions, np.zeros(1), 1.0) is load
