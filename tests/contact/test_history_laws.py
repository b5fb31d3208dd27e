"""Friction by slip and speed: values, units, places, and what they refuse."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.contact.body import SlipHistory
from bemkit.contact.further_laws import PiecewiseLaw, RateStrengthening, SlipWeakening
from bemkit.contact.laws import Coulomb, FrictionLaw, RescaledLaw
from bemkit.errors import InputError
from bemkit.formulas import Expression
from bemkit.testing import CheckFailed, check_law

SIGMA = np.array([-1.0, -2.0, -4.0])


def motion(slip: FloatArray, last_slip: FloatArray | None = None) -> SlipHistory:
    return SlipHistory(3.0, 0.5, slip, slip if last_slip is None else last_slip)


def test_slip_weakening_falls_linearly_and_stays() -> None:
    law = SlipWeakening(0.6, 0.2, 0.1)
    bound = law.at_slip(motion(np.array([0.0, 0.05, 7.0]))).bound(SIGMA)
    np.testing.assert_allclose(bound, [0.6, 0.4 * 2.0, 0.2 * 4.0], rtol=1e-15)
    np.testing.assert_array_equal(law.bound(SIGMA), Coulomb(0.6).bound(SIGMA))


def test_rate_strengthening_is_the_logarithm_of_the_speed() -> None:
    law = RateStrengthening(0.3, 0.05, 0.2)
    last = np.array([0.0, 0.1, 0.2])  # in half a second
    bound = law.at_slip(motion(np.full(3, 9.0), last)).bound(SIGMA)
    np.testing.assert_allclose(bound, -SIGMA * (0.3 + 0.05 * np.log([1.0, 2.0, 3.0])), rtol=1e-15)
    assert law.at_slip(SlipHistory.at_rest(3)).bound(SIGMA).tolist() == law.bound(SIGMA).tolist()


def test_the_path_adds_up_at_closed_nodes_whichever_way_they_slip() -> None:
    there = SlipHistory.at_rest(2).followed(1.0, np.array([0.2, 0.3]), np.array([True, False]))
    back = there.followed(3.0, np.array([-0.5, 0.1]), np.array([True, True]))
    np.testing.assert_allclose(back.slip, [0.7, 0.1], rtol=1e-15)
    np.testing.assert_allclose(back.rate, [0.25, 0.05], rtol=1e-15)
    assert (back.time, back.time_step) == (3.0, 2.0)


def test_laws_of_parts_see_the_slip_of_their_own_nodes() -> None:
    weakening = SlipWeakening(Expression("x"), 0.0, 1.0)
    points = np.array([[0.5, 0.0], [0.8, 0.0]])
    law = PiecewiseLaw([weakening.at(points), Coulomb(0.1)], [np.array([2, 0]), np.array([1])])
    assert law.needs_history
    assert not PiecewiseLaw([Coulomb(0.1)], [np.arange(3)]).needs_history
    bound = law.at_slip(motion(np.array([0.5, 9.0, 0.25]))).bound(SIGMA)
    np.testing.assert_allclose(bound, [0.8 * 0.5, 0.2, 0.5 * 0.75 * 4.0], rtol=1e-15)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: SlipWeakening(0.3, 0.2, 0.0), r"slip_distance = 0: give a positive length"),
        (lambda: SlipWeakening(0.3, 0.4, 1.0), r"kinetic_friction = 0\.4 is larger than static_friction = 0\.3"),
        (lambda: RateStrengthening(0.3, 0.4, 0.0), r"reference_rate = 0: give a positive speed"),
        (lambda: RateStrengthening(0.3, -0.4, 1.0), r"rate_coefficient = -0\.4; give a number >= 0"),
    ],
)
def test_what_is_no_law_is_refused(make, message) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises(InputError, match=message):
        make()


@dataclass(frozen=True)
class Remembering(FrictionLaw):
    """A law of one's own with some fault in `at_slip`."""

    fault: str = ""

    @property
    def needs_history(self) -> bool:
        return True

    def at_slip(self, motion: SlipHistory) -> FrictionLaw:
        if self.fault == "itself":
            return self
        slip = motion.slip.max() if self.fault == "others" else motion.slip
        return RescaledLaw(Coulomb(np.exp(-slip) * np.ones_like(motion.slip)), 1.0)

    def bound(self, sigma_n: FloatArray) -> FloatArray:
        return np.maximum(-sigma_n, 0.0)

    def bound_derivative(self, sigma_n: FloatArray) -> FloatArray:
        return np.where(sigma_n <= 0.0, -1.0, 0.0)

    def scaled(self, stress_scale: float) -> FrictionLaw:
        return self


def test_own_laws_that_remember_are_checked() -> None:
    check_law(Remembering())
    with pytest.raises(CheckFailed, match="at_slip returns a law that needs a history itself"):
        check_law(Remembering("itself"))
    with pytest.raises(CheckFailed, match="at_slip at node 0 depends on the slip of other nodes"):
        check_law(Remembering("others"))
