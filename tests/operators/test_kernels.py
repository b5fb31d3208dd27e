"""The closed forms against arithmetic with many digits, from 1e-14 to 1e8 element lengths, up to degree 16."""

from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.arrays import ComplexArray
from bemkit.operators import kernels
from tests.slow import slow_except

DISTANCES = [*(10.0**k for k in (-14, -12, -10, -6, -3, 6, 8)), 0.02, 0.1, 0.3, 0.6, 1.0, 1.4, 2.0, 5.9, 6.1, 30.0, 1e3]
HIGHEST = 16
# the upward recurrence may lose a factor of 30 (`kernels.LOST`); measured 5e-14
RELATIVE = 2e-13


def reference(zeta: mpmath.mpc, highest: int) -> list[mpmath.mpc]:
    """Return C_0 ... C_highest by the recurrence upward, in digits enough for what it loses."""
    with mpmath.workdps(60 + int(2.2 * (highest + 1) * max(0.0, float(mpmath.log10(abs(zeta)))) + 10 * highest)):
        integrals = [mpmath.log((zeta + 1) / (zeta - 1))]
        integrals.append(zeta * integrals[0] - 2)
        for k in range(1, highest):
            integrals.append(((2 * k + 1) * zeta * integrals[k] - k * integrals[k - 1]) / (k + 1))
        return integrals


def worst(computed: list[ComplexArray], expected: list[mpmath.mpc]) -> float:
    return max(abs(complex(mpmath.mpc(c[0]) - e)) / abs(complex(e)) for c, e in zip(computed, expected, strict=False))


@pytest.mark.parametrize("end", slow_except((-1, 1), 1))
@pytest.mark.parametrize("distance", slow_except(DISTANCES, 1e-14, 1e-3, 0.1, 1.0, 5.9, 6.1, 1e3))
def test_near_integrals_hold_at_every_distance_from_an_end_point(distance: float, end: int) -> None:
    for angle in np.linspace(0.05, 6.25, 11):
        with mpmath.workdps(200):
            zeta = end + distance * mpmath.expj(float(angle))
            plus, minus = np.array([complex(zeta + 1)]), np.array([complex(zeta - 1)])
            expected = reference(zeta, HIGHEST)
            log_product = float(mpmath.log(abs(zeta**2 - 1)))
        for highest in (1, 3, HIGHEST):
            computed, log = kernels.near_integrals(plus, minus, highest)
            assert len(computed) == highest + 1
            assert worst(computed, expected) < RELATIVE
            assert log[0] == pytest.approx(log_product, rel=RELATIVE, abs=1e-15)


def test_many_points_at_once_are_those_one_by_one() -> None:
    zeta = np.array([1.0 + 1e-9j, 0.2 + 0.3j, 3.0 - 2.0j, 40.0 + 1j, 1e5 - 1e5j, -1.3 + 0.1j])
    together, _ = kernels.near_integrals(zeta + 1.0, zeta - 1.0, 9)
    for i, point in enumerate(zeta):
        alone, _ = kernels.near_integrals(np.array([point + 1.0]), np.array([point - 1.0]), 9)
        assert [c[i] for c in together] == [c[0] for c in alone]


@given(distance=st.floats(10.0, 1e8), angle=st.floats(-np.pi, np.pi), highest=st.integers(1, 13))
def test_far_integrals_are_exact_to_round_off(distance: float, angle: float, highest: int) -> None:
    zeta = distance * np.exp(1j * angle)
    computed = kernels.far_integrals(np.array([zeta]), highest, kernels.terms_needed(distance))
    # each of the 13 steps downward rounds twice
    assert worst(computed, reference(mpmath.mpc(zeta), highest)) < 1e-14 + 1e-15 * highest


def test_the_angle_jumps_by_two_pi_across_the_element_and_nowhere_else() -> None:
    def angle(zeta: complex) -> float:
        integrals, _ = kernels.near_integrals(np.array([zeta + 1]), np.array([zeta - 1]), 0)
        return float(integrals[0][0].imag)

    assert angle(-0.3 + 1e-9j) == pytest.approx(-np.pi, abs=1e-8)
    assert angle(-0.3 - 1e-9j) == pytest.approx(np.pi, abs=1e-8)
    for beyond in (-1.5, 1.5):
        assert angle(beyond + 1e-9j) == pytest.approx(0.0, abs=1e-8)


@given(xi=st.floats(-3.0, 3.0), eta=st.floats(0.05, 3.0), k=st.integers(0, 12))
def test_log_and_quotient_integrals_are_what_they_claim_to_be(xi: float, eta: float, k: int) -> None:
    zeta = complex(xi, eta)
    integrals, log_product = kernels.near_integrals(np.array([zeta + 1]), np.array([zeta - 1]), k + 1)
    logs, quotients = (
        kernels.log_integrals(integrals, log_product),
        kernels.quotient_integrals(integrals, np.array([eta])),
    )
    points, weights = np.polynomial.legendre.leggauss(400)  # the kernel is analytic at a distance of 0.05
    density = weights * np.polynomial.legendre.legval(points, np.eye(k + 1)[k])
    rho = zeta - points
    log = np.sum(density * np.log(np.abs(rho)))
    quotient = np.sum(density * rho / np.conj(rho))
    assert logs[k, 0] == pytest.approx(log, abs=1e-11)
    assert quotients[k, 0] == pytest.approx(quotient, abs=1e-11)


@pytest.mark.parametrize(("a", "b"), [(0, 0), (0, 2), (1, 1), (3, 1), (4, 4), (11, 11), (12, 2), (3, 4)])
def test_the_logarithm_on_the_element_itself(a: int, b: int) -> None:
    points, weights = np.polynomial.legendre.leggauss(200)
    v = 0.5 * (points + 1.0)
    u, weight = v**4, 2.0 * weights * v**3  # graded towards the end of the outer element, where the inner is singular
    total = 0.0
    for sign in (-1.0, 1.0):
        distance = np.stack([u, 2.0 - u]) if sign < 0 else np.stack([2.0 - u, u])
        integrals, log_product = kernels.near_integrals(distance[0] + 0j, -distance[1] + 0j, b + 1)
        outer = np.polynomial.legendre.legval(distance[0] - 1.0, np.eye(a + 1)[a])
        half = u < 1.0
        total += np.sum((weight * outer * kernels.log_integrals(integrals, log_product)[b])[half])
    assert kernels.log_on_itself(a, b) == pytest.approx(total, abs=2e-13)  # round-off of 400 points
