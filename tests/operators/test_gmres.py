"""GMRES with directions in single precision."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.operators.linear.gmres import KEPT, gmres

N = 300
RANDOM = np.random.default_rng(0)
MATRIX = np.eye(N) + 0.3 * RANDOM.standard_normal((N, N)) / np.sqrt(N)
RIGHT = RANDOM.standard_normal(N)
SIZE = float(np.linalg.norm(RIGHT))


def product(x: FloatArray) -> FloatArray:
    return np.asarray(MATRIX @ x)


@pytest.mark.parametrize("target", [1e-3, 1e-9, 1e-13])
def test_directions_in_single_precision_cost_no_digits(target: float) -> None:
    solution, n_steps, left = gmres(product, RIGHT, target=target * SIZE, max_steps=100)
    assert left <= target * SIZE
    assert np.linalg.norm(RIGHT - MATRIX @ solution) == pytest.approx(left, rel=1e-2, abs=1e-15 * SIZE)
    # the radius of the spectrum is 0.3; a few steps more where a second round begins
    assert n_steps <= np.log(target) / np.log(0.3) + 5
    assert n_steps > np.log(target) / np.log(0.3) - 2


def test_steps_that_do_not_suffice() -> None:
    for most in (3, KEPT + 2):
        _, n_steps, left = gmres(product, RIGHT, target=1e-15 * SIZE, max_steps=most)
        assert n_steps == most
        assert 1e-15 * SIZE < left < 0.3 ** (most - 4) * SIZE


def test_round_off_ends_it() -> None:
    _, n_steps, left = gmres(product, RIGHT, target=1e-30 * SIZE, max_steps=1000)
    assert left < 1e-14 * SIZE
    assert n_steps < 100


def test_nothing_to_solve_takes_no_step() -> None:
    solution, n_steps, left = gmres(product, np.zeros(N), target=0.0, max_steps=10)
    assert (n_steps, left, np.abs(solution).max()) == (0, 0.0, 0.0)
