"""Equilibrium is measured as it is, and what round-off may leave of it stands beside it."""

import numpy as np
import pytest

from bemkit.contact.equilibrium import Imbalance, resultant_imbalance

POINTS = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
BALANCED = np.array([[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]])


def test_what_round_off_may_leave_is_not_subtracted():
    """Forces of 4 in all, off by 4e-8, of which 1e-6 may be round-off: the certificate must not show zero."""
    force = BALANCED.copy()
    force[0, 0] += 4e-8
    off = resultant_imbalance(POINTS, force, (0, 1), round_off=4e-7)
    assert off.force == pytest.approx(1e-8)
    assert off.moment == 0.0
    assert off.round_off == pytest.approx(1e-7)
    assert off.is_below(1e-9)
    assert not resultant_imbalance(POINTS, force, (0, 1), round_off=0.0).is_below(1e-9)


def test_no_more_than_a_millionth_is_put_down_to_round_off():
    huge = Imbalance(2e-6, 0.0, 1.0)
    assert huge.round_off == 1e-6
    assert not huge.is_below(1e-9)
    assert Imbalance(0.0, 1e-6, np.inf).is_below(1e-9)
    assert not Imbalance(0.0, 2e-6, np.inf).is_below(1e-9)


def test_only_the_resultants_that_must_vanish_count():
    pulled = BALANCED + np.array([1.0, 0.0])  # the sum of the sizes is 8, without a zero entry
    assert resultant_imbalance(POINTS, pulled, (1,), 0.0) == Imbalance(0.0, 0.0)
    assert resultant_imbalance(POINTS, pulled, (0,), 0.0).force == pytest.approx(4.0 / np.abs(pulled).sum())
    turned = BALANCED[[1, 2, 3, 0]]
    assert resultant_imbalance(POINTS, turned, (2,), 0.0).moment > 0.1
    assert resultant_imbalance(POINTS, 0.0 * pulled, (0, 1, 2), 1.0) == Imbalance(0.0, 0.0)


def test_the_larger_of_two_and_never_nan():
    joined = Imbalance(1e-3, 0.0, 1e-12).joined(Imbalance(1e-4, 1e-2, 1e-9))
    assert joined == Imbalance(1e-3, 1e-2, 1e-9)
    assert joined.worst == 1e-2
    for one, other in ((Imbalance(np.nan, 0.0), Imbalance(0.0, 0.0)), (Imbalance(0.0, 0.0), Imbalance(0.0, np.nan))):
        assert not one.joined(other).is_below(1e300)
    assert not Imbalance(0.0, 0.0, np.nan).is_below(1e300)
