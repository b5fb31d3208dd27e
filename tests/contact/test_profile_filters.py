"""Levelling, Gaussian filters and statistics of profiles, against closed forms."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.profile_filters import Levelling, filtered, levelled, rms_height, rms_slope

X = np.arange(1000) / 1000.0
ROUND_OFF = 1e-13
"""Of sums of a thousand numbers about 1."""


def wave(length: float) -> np.ndarray:
    return np.cos(2.0 * np.pi * X / length)


def test_the_line_of_least_squares_is_subtracted() -> None:
    heights = 3.0 - 2.0 * X + wave(0.1)
    above = levelled(X + 50.0, heights, Levelling.LINE)
    assert above.mean() == pytest.approx(0.0, abs=ROUND_OFF)
    assert np.polyfit(X, above, 1)[0] == pytest.approx(0.0, abs=1e-10)  # round-off of the fit, whose offset is 50
    np.testing.assert_allclose(np.diff(above - heights, 2), 0.0, atol=ROUND_OFF)


def test_the_line_through_the_ends_is_subtracted() -> None:
    above = levelled(X, 3.0 - 2.0 * X + wave(0.3), Levelling.ENDS)
    assert above[[0, -1]] == pytest.approx([0.0, 0.0], abs=ROUND_OFF)
    assert levelled(X, X, Levelling.NONE) is X


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_gaussian_filters_pass_waves_by_their_length(ratio: float) -> None:
    """The transmission of a wave as long as the cut-off is one half, of others 2^-(cut-off / wavelength)^2."""
    cut_off = 0.05
    passed = 2.0 ** -((1.0 / ratio) ** 2)
    heights = wave(ratio * cut_off)
    x, smooth = filtered(X, heights, 1.0, cut_off, None)
    np.testing.assert_allclose(x, X, atol=ROUND_OFF)
    np.testing.assert_allclose(smooth, passed * heights, atol=ROUND_OFF)
    np.testing.assert_allclose(filtered(X, heights, 1.0, None, cut_off)[1], (1.0 - passed) * heights, atol=ROUND_OFF)


def test_both_cut_offs_keep_the_waves_between_them() -> None:
    long, middle, short = wave(1.0), wave(0.05), wave(0.004)
    kept = filtered(X, long + middle + short, 1.0, 0.01, 0.25)[1]
    # transmissions of the wave between both, and what is left of the others, by the law of the test above
    expected = 2.0 ** -(0.2**2) * (1.0 - 2.0 ** -(5.0**2))
    np.testing.assert_allclose(kept, expected * middle, atol=1.0 - 2.0 ** -(0.25**2) + 2.0 ** -(2.5**2))


def test_without_a_period_a_straight_line_has_no_roughness() -> None:
    x = np.sort(np.random.default_rng(1).random(500))
    even, rough = filtered(x, 2.0 + 3.0 * x, None, None, 0.1)
    np.testing.assert_allclose(rough, 0.0, atol=ROUND_OFF)
    np.testing.assert_allclose(np.diff(even), (x[-1] - x[0]) / 499, rtol=1e-9)  # differences of 500 rounded numbers


def test_without_a_period_half_waves_from_end_to_end_pass_like_others() -> None:
    x = np.linspace(0.0, 1.0, 1001)
    heights = np.sin(3.0 * np.pi * x)  # three halves of a wave of the length 2 / 3
    passed = 2.0 ** -((0.5 / (2.0 / 3.0)) ** 2)
    np.testing.assert_allclose(filtered(x, heights, None, 0.5, None)[1], passed * heights, atol=ROUND_OFF)


def test_statistics_are_those_of_the_broken_line() -> None:
    """A symmetric triangle of height 1 between 0 and 2: its variance is 1/12, its slopes are 1."""
    assert rms_height(np.array([0.0, 1.0, 2.0]), np.array([0.0, 1.0, 0.0])) == pytest.approx(12.0**-0.5, rel=1e-14)
    assert rms_slope(np.array([0.0, 1.0, 4.0]), np.array([0.0, 1.0, 4.0])) == pytest.approx(1.0, rel=1e-14)
    assert rms_slope(np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 0.0])) == np.inf
    assert rms_slope(np.array([0.0, 1.0, 1.0]), np.array([0.0, 1.0, 1.0])) == 1.0


def test_a_profile_from_a_file_has_the_statistics_of_its_waves(tmp_path: Path) -> None:
    surface = bk.SelfAffineProfile(period=1.0, rms_height=2e-3, roll_off=0.25, cut_off=0.05, seed=3)
    np.savetxt(tmp_path / "p.txt", np.column_stack([X, 0.7 + surface.heights(X)]))
    profile = bk.Profile(str(tmp_path / "p.txt"), period=1.0)
    # chords of waves of 50 points and more: the relative error is (pi / 50)^2 / 3 at most
    assert profile.rms_height == pytest.approx(2e-3, rel=2e-3)
    assert profile.rms_slope == pytest.approx(surface.rms_slope, rel=2e-3)
    assert bk.Profile(str(tmp_path / "p.txt"), period=1.0, longest_wavelength=0.1).rms_height < 0.5 * 2e-3
