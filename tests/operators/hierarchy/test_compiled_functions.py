"""Logarithm and angle of the compiled loops against those of numpy."""

from __future__ import annotations

import numpy as np
import pytest

numba = pytest.importorskip("numba")


def test_log_and_angle_are_good_to_three_units_of_the_last_place() -> None:
    from bemkit.operators.hierarchy.compiled_functions import MATHEMATICS, atan2, log

    @numba.njit(fastmath=MATHEMATICS, error_model="numpy")
    def both(x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        logs, angles = np.empty_like(x), np.empty_like(x)
        for i in range(x.size):
            logs[i], angles[i] = log(abs(x[i])), atan2(y[i], x[i])
        return logs, angles

    rng = np.random.default_rng(0)
    x, y = 10.0 ** rng.uniform(-12.0, 12.0, (2, 5000)) * rng.choice([-1.0, 1.0], (2, 5000))
    x[:5], y[:5] = [1.0, -1.0, 0.5, -2.0, 1e-290], [0.0, 1e-300, -0.5, 2.0, 1e-290]
    for found, known in zip(both(x, y), (np.log(np.abs(x)), np.arctan2(y, x)), strict=True):
        # numpy's own functions are within one unit
        assert np.all(np.abs(found - known) <= 4.0 * np.spacing(np.abs(known)))
