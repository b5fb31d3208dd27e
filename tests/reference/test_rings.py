"""Closed forms of rings, discs, pins, layers, holes and columns: equilibrium, limits, digits found independently."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from bemkit.operators.material import Material, Plane
from bemkit.reference import (
    BrazilianDisc,
    GravityColumn,
    HertzLine,
    KirschHole,
    LameRing,
    PinInHole,
    RecedingLayer,
    RotatingDisc,
    ShrinkFit,
    pair_modulus,
    persson_load,
    persson_pressure,
)
from tests.slow import slow_except

STEEL = Material(1.0, 0.3)
SHEET = Material(1.0, 0.3, Plane.STRESS)


@pytest.mark.parametrize("material", [STEEL, SHEET, Material(2.0, 0.5)])
def test_fields_of_the_radius_alone_meet_hooke_and_equilibrium(material: Material) -> None:
    """sigma_r' + (sigma_r - sigma_theta) / r + body force = 0 and Hooke's law, by differences."""
    nu, mu = material.effective_poisson_ratio, material.shear_modulus
    r, step = np.array([0.7, 1.1, 1.4]), 1e-5
    ring = LameRing(0.6, 1.5, 1.3, 0.4, material)
    disc = RotatingDisc(1.5, 0.8, material)
    for field, force in ((ring, 0.0), (disc, 0.8)):
        radial, hoop = field.stresses(r)
        slope = (field.stresses(r + step)[0] - field.stresses(r - step)[0]) / (2.0 * step)
        np.testing.assert_allclose(slope + (radial - hoop) / r + force * r, 0.0, atol=1e-8)  # differences
        strain = (field.displacement(r + step) - field.displacement(r - step)) / (2.0 * step)
        around = field.displacement(r) / r
        np.testing.assert_allclose(2.0 * mu * strain, radial - nu * (radial + hoop), atol=1e-8)
        np.testing.assert_allclose(2.0 * mu * around, hoop - nu * (radial + hoop), atol=1e-8)
    np.testing.assert_allclose(ring.stresses(np.array([0.6, 1.5]))[0], [-1.3, -0.4], rtol=1e-14)
    assert disc.stresses(1.5)[0] == pytest.approx(0.0, abs=1e-14)


@pytest.mark.parametrize(("plane", "pressure", "torque", "inner", "outer"), [
    (Plane.STRESS, 1.96078431e-4, 2.46399424e-4, -2.67973856e-4, 7.32026144e-4),
    (Plane.STRAIN, 2.08044383e-4, 2.61436282e-4, -2.34396671e-4, 7.65603329e-4),
])  # fmt: skip
def test_a_shrink_fit_has_its_printed_digits(
    plane: Plane, pressure: float, torque: float, inner: float, outer: float
) -> None:
    fit = ShrinkFit(0.5, 1.0, 2.0, Material(1.0, 0.3, plane), Material(0.5, 0.2, plane), 1e-3)
    assert fit.pressure == pytest.approx(pressure, rel=5e-9)
    assert fit.largest_torque(0.2) == pytest.approx(torque, rel=5e-9)
    assert fit.displacements() == pytest.approx((inner, outer), rel=5e-9)


def test_rotating_discs_have_their_printed_factors() -> None:
    for material, centre, rim in ((SHEET, 0.4125, 0.175), (STEEL, 0.428571429, 0.142857143)):
        disc = RotatingDisc(1.5, 1.3, material)
        assert float(disc.stresses(0.0)[0]) / (1.3 * 1.5**2) == pytest.approx(centre, rel=2e-9)
        assert float(disc.displacement(1.5)) * material.plane_modulus / (1.3 * 1.5**3) == pytest.approx(rim, rel=2e-9)


@pytest.mark.parametrize(
    ("degrees", "clearance", "peak"),
    slow_except(
        [(30, 7.943540, 1.260289), (45, 2.823121, 0.882111), (75, 0.287077, 0.628103)], (45, 2.823121, 0.882111)
    ),
)
def test_a_pin_between_equal_materials_is_perssons(degrees: float, clearance: float, peak: float) -> None:
    angle = np.radians(degrees)
    assert 1.0 / persson_load(angle) == pytest.approx(clearance, abs=6e-7)
    load = persson_load(angle) * STEEL.plane_modulus * 1e-3
    pin = PinInHole(load, 2.0, 1e-3, STEEL, STEEL)
    assert pin.half_angle == pytest.approx(angle, rel=1e-9)  # the same by another method, Chebyshev polynomials
    places = np.array([0.0, 0.5, 0.9, 1.1]) * angle
    expected = persson_pressure(places, angle) * load / 2.0
    np.testing.assert_allclose(pin.pressure(places), expected, atol=1e-8 * pin.peak_pressure)
    assert pin.peak_pressure * 2.0 / load == pytest.approx(peak, abs=6e-7)


def test_a_small_contact_of_a_pin_is_hertzian_whatever_the_materials() -> None:
    stiff = Material(5.0, 0.1)
    pin = PinInHole(1e-6, 1.0, 1e-2, STEEL, stiff)
    hertz = HertzLine(1e-6, 1.0 / 1e-2, pair_modulus(STEEL, stiff))  # 1 / R = clearance / radius^2
    assert pin.half_angle == pytest.approx(hertz.half_width, rel=2e-3)  # of the order of the angle squared, 2e-4
    assert pin.peak_pressure == pytest.approx(hertz.peak_pressure, rel=2e-3)


def test_a_rigid_pin_meets_the_sum_over_the_modes_of_the_hole() -> None:
    """The displacement of the sheet by its complex symbols, summed mode by mode, follows the rigid pin."""
    sheet = Material(1.0, 0.25)
    pin = PinInHole(2e-3, 1.0, 1e-3, Material(1e12, 0.3), sheet)
    angle = np.linspace(-0.9, 0.9, 7) * pin.half_angle
    grid = (np.arange(20000) + 0.5) * np.pi / 10000 - np.pi
    pressure = pin.pressure(grid)
    kappa, mu = sheet.kappa, sheet.shear_modulus
    n = np.arange(2, 4000)
    size = 2.0 * (np.fft.fft(pressure)[n] * np.exp(-1j * n * grid[0])).real / len(grid)
    symbol = ((kappa + 1.0) * n + kappa - 1.0) / (4.0 * mu * (n**2 - 1.0))
    outwards = pressure.mean() / (2.0 * mu) + np.cos(np.outer(angle, n)) @ (symbol * size)
    # contact: outwards = approach cos(angle) - clearance, for an approach of the size that the middle demands
    middle = outwards[3] + 1e-3
    np.testing.assert_allclose(outwards, middle * np.cos(angle) - 1e-3, atol=2e-8)  # 4000 modes, 1e-5 of the clearance


TABLE = {
    0.0: ((0.0, 0.8569939, 0.9603330), (0.5, 1.0077824, 0.7895882)),
    1.0 / 3.0: ((0.5, 1.1718335, 0.7124563),),
    1.0: ((0.0, 1.3241654, 0.7130806),),
    3.0: ((0.0, 1.83630, 0.53946),),
}
"""By the ratio of moduli: half-width of the load, of the contact, and peak pressure, by Chebyshev series elsewhere."""
ROWS = [(ratio, row) for ratio, rows in TABLE.items() for row in rows]


@pytest.mark.parametrize(("ratio", "row"), slow_except(ROWS, ROWS[1]))
def test_a_receding_layer_has_its_tabulated_values(ratio: float, row: tuple[float, float, float]) -> None:
    load, contact, peak = row
    layer = RecedingLayer(3.0, 2.0 * load, 2.0, ratio)
    # the ends of contact in the table are good to 1e-6, at the ratio 3 to 5e-6
    assert layer.half_width / 2.0 == pytest.approx(contact, rel=5e-6)
    assert layer.peak_pressure * 2.0 / 3.0 == pytest.approx(peak, rel=5e-6)
    x = (np.arange(4000) + 0.5) / 4000 * layer.half_width
    assert 2.0 * layer.pressure(x).mean() * layer.half_width == pytest.approx(3.0, rel=1e-5)  # midpoint rule


def test_the_brazilian_disc_has_its_printed_digits_and_balances_its_jaws() -> None:
    disc = BrazilianDisc(1.0, 0.2)
    along, across = disc.stresses(np.array([0.8]))
    assert (along[0], across[0]) == pytest.approx((-0.861634611, -0.087724067), rel=1e-8)
    # what presses half of the disc sideways: the horizontal part of the pressure on two halves of arcs
    places = (np.arange(20000) + 0.5) / 20000
    assert float(disc.stresses(places)[1].mean()) == pytest.approx(np.cos(0.2) - 1.0, abs=2e-5)


def test_the_rim_of_kirschs_hole_has_no_radial_strain_but_its_hoop_stress() -> None:
    hole = KirschHole(1.5, 0.7, STEEL)
    angle, step = np.linspace(0.0, 3.0, 7), 1e-5
    slope = (hole.rim_displacement(angle + step) - hole.rim_displacement(angle - step)) / (2.0 * step * 0.7)
    around = np.sum(slope * np.column_stack([-np.sin(angle), np.cos(angle)]), axis=1)
    np.testing.assert_allclose(STEEL.plane_modulus * around, hole.hoop_stress(angle), atol=1e-8)
    assert hole.hoop_stress(np.array([0.5 * np.pi]))[0] == pytest.approx(4.5)  # three times the tension
    far = hole.far_displacement(np.array([[2.0, 0.0], [0.0, 2.0]]))
    strain = np.array([far[0, 0], far[1, 1]]) / 2.0
    mu, nu = STEEL.shear_modulus, 0.3
    stress = 2.0 * mu * (strain + nu / (1.0 - 2.0 * nu) * strain.sum())
    np.testing.assert_allclose(stress, [1.5, 0.0], atol=1e-14)


def test_two_columns_settle_as_printed() -> None:
    column = GravityColumn((1.5, 1.0), (2.0, 1.0), (Material(2.0, 0.2), STEEL))
    assert column.base_pressures() == (4.0, 1.0)
    assert column.settlements() == pytest.approx((1.6875, 2.05892857), rel=1e-8)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: LameRing(2.0, 1.0, 0.0, 1.0, STEEL), r"inner_radius is 2\.0, outer_radius 1\.0: give 0 <= inner"),
        (lambda: LameRing(0.0, 1.0, 1.0, 0.0, STEEL), r"inner_pressure is 1\.0, but a disc has no hole: give zero"),
        (lambda: ShrinkFit(1.0, 0.5, 2.0, STEEL, STEEL, 1.0), r"the radii are \(1\.0, 0\.5, 2\.0\): give 0 <="),
        (lambda: persson_load(4.0), r"half_angle is 4\.0: give one between 0 and pi, in radians"),
        (lambda: RecedingLayer(1.0, -1.0, 1.0), r"load_half_width is -1\.0: give a finite number, not negative"),
        (lambda: GravityColumn((0.0,), (1.0,), (STEEL,)), r"height is 0\.0: give a positive"),
    ],
)
def test_what_closed_forms_do_not_cover_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()
