"""The closed forms against arithmetic with 80 digits, from 1e-14 to 1e8 element lengths."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.operators import kernels

DISTANCES = [1e-14, 1e-10, 1e-6, 1e-3, 0.1, 1.0, 5.9, 6.1, 30.0, 1e3, 1e6, 1e8]
# |zeta| <= 6 loses at most two digits in the recursion of the moments (6^2 eps), the logarithms less
RELATIVE = 1e-12


def reference(plus: complex, highest: int) -> tuple[list[complex], float]:
    """T_0 ... T_highest and log|zeta^2 - 1| by the recursion in 80 digits."""
    with mpmath.workdps(80):
        zeta = mpmath.mpc(plus) - 1
        moments = [mpmath.log((zeta + 1) / (zeta - 1))]
        for k in range(1, highest + 1):
            moments.append(zeta * moments[-1] - (mpmath.mpf(2) / k if k % 2 else 0))
        return [complex(m) for m in moments], float(mpmath.log(abs(zeta**2 - 1)))


def near(plus: complex, highest: int) -> tuple[list[complex], float]:
    moments, log_minus, log_plus = kernels.near_moments(np.array([plus]), np.array([plus - 2.0]), highest)
    return [complex(m[0]) for m in moments], float(log_minus[0] + log_plus[0])


@pytest.mark.parametrize("angle", [0.0, 0.3, 1.2, 1.6, 2.9, -0.7])
@pytest.mark.parametrize("distance", DISTANCES)
def test_near_moments_hold_at_every_distance_from_an_end_point(distance: float, angle: float) -> None:
    plus = -distance * np.exp(1j * angle)  # seen from the end a, away from the element for small angles
    computed, log_product = near(plus, 2)
    expected, expected_log = reference(plus, 2)
    scale = [abs(value) for value in expected]
    for k in range(3):
        assert abs(computed[k] - expected[k]) <= RELATIVE * scale[k]
    assert log_product == pytest.approx(expected_log, rel=RELATIVE, abs=1e-15)


@given(
    distance=st.floats(10.0, 1e8),
    angle=st.floats(-np.pi, np.pi),
    highest=st.integers(1, 4),
)
def test_far_moments_are_exact_to_round_off(distance: float, angle: float, highest: int) -> None:
    zeta = distance * np.exp(1j * angle)
    computed = kernels.far_moments(np.array([zeta]), highest, kernels.terms_needed(distance))
    expected, _ = reference(zeta + 1.0, highest)
    for k in range(highest + 1):
        # zeta + 1 is rounded before the reference sees it: eps |zeta| / |zeta| relative
        assert abs(computed[k][0] - expected[k]) <= 2e-14 * abs(expected[k])


def test_the_angle_jumps_by_two_pi_across_the_element_and_nowhere_else() -> None:
    above, _ = near(0.7 + 1e-9j, 0)
    below, _ = near(0.7 - 1e-9j, 0)
    assert above[0].imag == pytest.approx(-np.pi, abs=1e-8)
    assert below[0].imag == pytest.approx(np.pi, abs=1e-8)
    for beyond in (-0.5, 2.5):
        assert near(beyond + 1e-9j, 0)[0][0].imag == pytest.approx(0.0, abs=1e-8)


@given(xi=st.floats(-3.0, 3.0), eta=st.floats(0.05, 3.0), k=st.integers(0, 3))
def test_log_and_quotient_moments_are_the_integrals_they_claim_to_be(xi: float, eta: float, k: int) -> None:
    zeta = complex(xi, eta)
    moments, log_minus, log_plus = kernels.near_moments(np.array([zeta + 1]), np.array([zeta - 1]), k + 1)
    points, weights = np.polynomial.legendre.leggauss(400)  # the kernel is analytic at a distance of 0.05
    rho = zeta - points
    log = np.sum(weights * points**k * np.log(np.abs(rho)))
    quotient = np.sum(weights * points**k * rho / np.conj(rho))
    assert kernels.log_moment(k, moments, log_minus + log_plus)[0] == pytest.approx(log, abs=1e-11)
    assert kernels.quotient_moment(k, moments, np.array([eta]))[0] == pytest.approx(quotient, abs=1e-11)
