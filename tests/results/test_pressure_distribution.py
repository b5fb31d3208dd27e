"""The distribution of pressures: that of Hertz in closed form; shares add up to the contact fraction."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import bemkit as bk
from bemkit.results.tables import table_of
from bemkit.scene.keys import with_settings


@pytest.fixture(scope="module")
def solution() -> bk.Solution:
    return bk.run(replace(bk.load_scene("cylinder-on-half-plane"), law=bk.Frictionless()))


def test_pressures_of_hertz_are_distributed_as_on_half_an_ellipse(solution: bk.Solution) -> None:
    """Where |x| < a the pressure exceeds p on the share sqrt(1 - (p / p0)^2) of the contact."""
    shares = table_of(solution, "pressures")
    share, ends = np.array(shares.values("share")), np.array(shares.values("pressure_to"))
    exceeding = 1.0 - np.cumsum(share) / share.sum()
    expected = np.sqrt(1.0 - (ends / ends[-1]) ** 2)
    n_pressed = int(np.count_nonzero(solution.contact.sigma_n < 0.0))
    np.testing.assert_allclose(exceeding, expected, atol=4.0 / n_pressed)  # two nodes at either side of an end


def test_shares_are_those_of_the_length_in_contact(solution: bk.Solution) -> None:
    shares, contact = table_of(solution, "pressures"), solution.contact
    touches = contact.sigma_n < 0.0
    assert sum(shares.values("share")) == pytest.approx(contact.weight[touches].sum() / contact.weight.sum(), rel=1e-12)
    width = shares.values("pressure_to")[0]
    np.testing.assert_allclose(width * np.array(shares.values("density")), shares.values("share"), rtol=1e-12)
    assert shares.values("pressure_to")[-1] == pytest.approx(-contact.sigma_n.min(), rel=1e-15)


def test_a_contact_without_pressure_has_no_distribution() -> None:
    apart = with_settings(bk.load_scene("cylinder-on-half-plane"), ["far.force_y=0.0"])
    assert table_of(bk.run(apart), "pressures").rows == ()
