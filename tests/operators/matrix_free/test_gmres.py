"""GMRES with directions in single precision."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.operators.matrix_free.gmres import KEPT, gmres

N = 300
RANDOM = np.random.default_rng(0)
MATRIX = np.eye(N) + 0.3 * RANDOM.standard_normal((N, N)) / np.sqrt(N)
RIGHT = RANDOM.standard_normal(N)
SIZE = float(np.linalg.norm(RIGHT))


def product(x: FloatArray) -> FloatArray:
    return np.asarray(MATRIX @ x)


def solved(tolerance: float, max_steps: int, start: FloatArray | None = None) -> tuple[FloatArray, int, float]:
    x = np.zeros(N) if start is None else start.copy()
    n_steps, left = gmres(product, lambda x: RIGHT - MATRIX @ x, x, tolerance=tolerance, size=SIZE, max_steps=max_steps)
    return x, n_steps, left


@pytest.mark.parametrize("tolerance", [1e-3, 1e-9, 1e-13])
def test_directions_in_single_precision_cost_no_digits(tolerance: float) -> None:
    solution, n_steps, left = solved(tolerance, 100)
    assert left <= tolerance
    assert np.linalg.norm(RIGHT - MATRIX @ solution) / SIZE == pytest.approx(left, rel=1e-2, abs=1e-15)
    # the radius of the spectrum is 0.3; a few steps more where further rounds begin
    assert n_steps <= np.log(tolerance) / np.log(0.3) + 6
    assert n_steps > np.log(tolerance) / np.log(0.3) - 2


def test_steps_that_do_not_suffice() -> None:
    for most in (3, KEPT + 2):
        _, n_steps, left = solved(1e-15, most)
        assert n_steps == most
        assert 1e-15 < left < 0.3 ** (most - 4)


def test_round_off_ends_it() -> None:
    _, n_steps, left = solved(1e-30, 1000)
    assert left < 1e-14
    assert n_steps < 100


def test_a_start_close_to_the_solution_takes_few_steps() -> None:
    exact = np.linalg.solve(MATRIX, RIGHT)
    close = exact + 1e-6 * np.linalg.norm(exact) / np.sqrt(N) * np.cos(np.arange(N))
    assert solved(1e-9, 100, close)[1] < 0.6 * solved(1e-9, 100)[1]
    assert solved(1e-9, 100, exact)[1] == 0


def test_nothing_to_solve_takes_no_step() -> None:
    x = np.zeros(N)
    assert gmres(product, lambda x: -MATRIX @ x, x, tolerance=0.0, size=0.0, max_steps=10) == (0, 0.0)
    assert not x.any()
