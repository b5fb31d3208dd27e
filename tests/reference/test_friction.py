"""Slip, losses and limits of friction against their own integrals and limits."""

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from bemkit.errors import InputError
from bemkit.reference import (
    HertzLine,
    PartialSlip,
    arch_friction_limit,
    cantilevers_loss,
    closed_cracks_slip,
    mindlin_loss,
)


@pytest.mark.parametrize(("share", "published"), [(0.1, 0.0638934), (0.25, 0.4412712), (0.4, 1.4952403)])
def test_the_mean_slip_of_closed_cracks_is_that_of_the_profile(share, published):
    slip = closed_cracks_slip(share)
    assert slip == pytest.approx(published, abs=5e-8)

    def profile(x):
        return 4 / mpmath.pi * mpmath.acosh(mpmath.cos(mpmath.pi * x) / mpmath.cos(mpmath.pi * share))

    assert slip == pytest.approx(float(2 * mpmath.quad(profile, [0, share])), rel=1e-9)


def test_short_cracks_do_not_see_each_other():
    assert closed_cracks_slip(1e-3) == pytest.approx(2.0 * np.pi * 1e-6, rel=1e-5)  # one crack: 2 pi tau a^2 / E'


@pytest.mark.parametrize("shear", [0.05, 0.2, 0.29])
def test_a_mindlin_cycle_loses_the_area_of_its_loop(shear):
    sheared, modulus = PartialSlip(HertzLine(1.0, 2.0, 0.7), shear, 0.3), 0.7

    def approach(load):  # less a multiple of the load, which drops out
        return -load * np.log(load) / (np.pi * modulus)

    def moved(force):
        return 0.3 * (approach(1.0) - approach(1.0 - force / 0.3))

    # each branch of the loop is the first curve, twice as large: 4 Q f(Q) - 8 times the integral of f
    area = 4.0 * shear * moved(shear) - 8.0 * quad(moved, 0.0, shear)[0]
    assert mindlin_loss(sheared, modulus) == pytest.approx(area, rel=1e-9)


def test_small_mindlin_cycles_lose_the_cube_of_the_shear():
    losses = [mindlin_loss(PartialSlip(HertzLine(1.0, 1.0, 1.0), shear, 0.3), 1.0) for shear in (1e-2, 2e-2)]
    assert losses[1] / losses[0] == pytest.approx(8.0, rel=0.1)


def test_cantilevers_lose_what_their_faces_rub():
    """Beyond F_s each beam carries half of the rest; faces slip by the turn of the sections times h, to and fro."""
    friction, pressure, load, length = 0.3, 1e-4, 9e-5, 20.0
    excess = load - 4.0 * friction * pressure / 3.0

    def slip(x):  # turn of a beam with E = h = 1 and I = 1 / 12
        return 12.0 * (excess / 2.0) * (length * x - x**2 / 2.0)

    rubbed = 4.0 * friction * pressure * quad(slip, 0.0, length)[0]  # from one end to the other and back
    assert cantilevers_loss(friction, pressure, load, length, 1.0) == pytest.approx(rubbed, rel=1e-9)


def test_the_arch_of_21_blocks():
    assert arch_friction_limit(21) == pytest.approx(0.308988, abs=5e-7)
    assert arch_friction_limit(2001) == pytest.approx(arch_friction_limit(4001), rel=1e-4)


def test_refusals():
    with pytest.raises(InputError, match=r"length_share is 0.5: give a number between 0 and 0.5"):
        closed_cracks_slip(0.5)
    with pytest.raises(InputError, match=r"load is 1e-05: the beams slip from 4e-05 on: give more"):
        cantilevers_loss(0.3, 1e-4, 1e-5, 20.0, 1.0)
    with pytest.raises(InputError, match="n_blocks is 20: give an odd number from 3 on"):
        arch_friction_limit(20)
    with pytest.raises(InputError, match="modulus"):
        mindlin_loss(PartialSlip(HertzLine(1.0, 1.0, 1.0), 0.1, 0.3), 0.0)
