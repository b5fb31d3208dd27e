"""Closed forms and spectral solutions: the printed digits, their own equations, and each other's limits."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from bemkit.operators.material import Material, Plane
from bemkit.reference import DiscBetweenPlates, WavyObstacle, westergaard_half_width, westergaard_pressure
from tests.slow import slow_except

PLATE = Material(0.91, 0.3)  # E' = 1
BLOCK = Material(1.0, 0.3)
WAVE = WavyObstacle(0.0172614981, 0.01, wavelength=1.0, height=1.5, material=BLOCK)


@pytest.mark.parametrize(
    ("half_angle", "load", "peak", "approach"),
    [(0.05, 0.001972, 0.025122, 0.0048860), (0.1, 0.007854, 0.050016, 0.0160341), (0.3, 0.067476, 0.142208, 0.0914917)],
)
def test_the_disc_has_its_tabulated_values(half_angle: float, load: float, peak: float, approach: float) -> None:
    # found independently, by a spectral method in another basis; agreement to the digits given
    disc = DiscBetweenPlates(1.0, approach, PLATE, along_normals=True)
    assert disc.half_angle == pytest.approx(half_angle, rel=4e-5)
    assert disc.load() == pytest.approx(load, rel=3e-4)
    assert float(disc.pressure(np.zeros(1))[0]) == pytest.approx(peak, rel=4e-5)


@pytest.mark.parametrize("along_normals", [False, True])
def test_a_small_contact_of_the_disc_is_hertzian(along_normals: bool) -> None:
    disc = DiscBetweenPlates(2.0, 2e-6, PLATE, along_normals=along_normals)
    half_width = 2.0 * disc.half_angle  # about 1e-3: corrections are of the first order in the half-angle, 5e-4
    assert disc.load() == pytest.approx(np.pi * half_width**2 / (4.0 * 2.0), rel=3e-4)
    x = np.linspace(-1.2, 1.2, 41)
    hertz = 2.0 * disc.load() / (np.pi * half_width) * np.sqrt(np.maximum(1.0 - x**2, 0.0))
    np.testing.assert_allclose(disc.pressure(x * disc.half_angle), hertz, atol=3e-4 * hertz.max())


@pytest.mark.parametrize(("half_width", "mean"), [(0.25, 0.0172616), (0.4, 0.0312267)])
def test_westergaard_has_its_tabulated_values(half_width: float, mean: float) -> None:
    # to the digits given
    peak = {0.25: 0.048824, 0.4: 0.065669}[half_width]
    assert westergaard_half_width(mean, 0.01, 1.0, BLOCK.plane_modulus) == pytest.approx(half_width, rel=3e-5)
    assert float(westergaard_pressure(np.zeros(1), half_width, mean, 1.0)[0]) == pytest.approx(peak, rel=3e-5)
    x = (np.arange(4000) + 0.5) / 4000
    assert westergaard_pressure(x, half_width, mean, 1.0).mean() == pytest.approx(mean, rel=1e-4)


def test_full_contact_of_the_wave_is_no_partial_contact() -> None:
    with pytest.raises(ValueError, match=r"mean_pressure is 0\.04: give one between 0 and 0\.0345"):
        westergaard_half_width(0.04, 0.01, 1.0, BLOCK.plane_modulus)


@pytest.mark.parametrize("approach", [0.0, 0.5, float("nan")])
def test_an_approach_that_is_not_small_is_refused(approach: float) -> None:
    with pytest.raises(ValueError, match=r"approach is .*: give one between 0 and a quarter of the radius, 0\.25"):
        DiscBetweenPlates(1.0, approach, PLATE)


def test_a_tall_block_is_a_half_plane() -> None:
    # far sides change the first mode by exp(-4 pi height / wavelength)
    tall = dataclasses.replace(WAVE, height=4.0)
    reference = tall.reference()
    exact = westergaard_pressure(reference.places[0].s, tall.half_width, WAVE.mean_pressure, 1.0)
    np.testing.assert_allclose(-reference.answer.sigma_n, exact, atol=1e-13)
    assert abs(WAVE.half_width - tall.half_width) == pytest.approx(3e-7, rel=0.1)


@pytest.mark.parametrize("plane", list(Plane))
def test_the_tangential_displacement_of_the_block_belongs_to_its_pressure(plane: Plane) -> None:
    # E' du_t/ds = sigma_tt - r sigma_nn, and on a half-plane without shear sigma_tt = sigma_nn
    tall = dataclasses.replace(WAVE, height=4.0, material=Material(1.0, 0.3, plane))
    reference = tall.reference()
    s, answer = reference.places[0].s, reference.answer
    ratio = tall._ratio
    strain = np.gradient(answer.u_t, s)
    expected = (1.0 - ratio) * (answer.sigma_n + WAVE.mean_pressure) / tall.material.plane_modulus
    chosen = (np.abs(s - tall.half_width) > 0.02) & (s > 0.02) & (s < 0.48)
    np.testing.assert_allclose(strain[chosen], expected[chosen], atol=2e-3 * np.abs(expected).max())


@pytest.mark.parametrize("along_normals", slow_except([False, True], True))
def test_energies_are_half_the_work_of_the_load(along_normals: bool) -> None:
    disc = DiscBetweenPlates(1.0, 0.016, PLATE, n_terms=9, along_normals=along_normals)
    # pushing a little further costs the load times the way, on two plates; gaps along normals n make the way 1 / n_y
    way = 1.0 + 0.25 * disc.half_angle**2 if along_normals else 1.0
    ahead, behind = (
        dataclasses.replace(disc, approach=0.016 + step).reference().answer.energy for step in (1e-5, -1e-5)
    )
    assert 4.0 * (ahead - behind) / 2e-5 == pytest.approx(2.0 * disc.load() * way, rel=1e-4)


@pytest.mark.parametrize("half_angle", [0.05, 0.1, 0.3])
def test_directions_of_contact_make_a_difference_of_the_order_of_the_half_angle(half_angle: float) -> None:
    own, _ = DiscBetweenPlates(1.0, 0.01, PLATE)._solved(half_angle)
    other, _ = DiscBetweenPlates(1.0, 0.01, PLATE, along_normals=True)._solved(half_angle)
    middle = np.zeros(1)
    assert own.at(middle)[0] == pytest.approx(other.at(middle)[0], rel=0.4 * half_angle)
    assert own.at(middle)[0] != pytest.approx(other.at(middle)[0], rel=0.02 * half_angle)


def test_own_errors_are_told_and_small() -> None:
    own = DiscBetweenPlates(1.0, 0.0160343377, PLATE).reference().own_errors
    assert 0.0 < own["sigma_n"] < 1e-6
    assert own["energy"] < 1e-9
