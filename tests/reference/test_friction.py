"""Slip, losses and limits of friction against their own integrals and limits."""

import mpmath
import numpy as np
import pytest
from scipy.integrate import quad

from bemkit.errors import InputError
from bemkit.operators.material import Material
from bemkit.reference import (
    CompleteContact,
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


STEEL = Material(0.91, 0.3)
EDGES = [(60, 0.961909), (75, 0.717733), (90, 0.5430756), (105, 0.409581), (120, 0.302550)]


@pytest.mark.parametrize(("degrees", "published"), EDGES)
def test_an_edge_sticks_from_the_published_friction_on(degrees, published):
    assert CompleteContact(np.radians(degrees), STEEL).friction_limit == pytest.approx(published, abs=6e-7)


@pytest.mark.parametrize("degrees", [60, 90, 120])
def test_the_sides_of_an_edge_are_free_and_its_field_is_elastic(degrees):
    """Differences of the displacements give the stresses to the cancellation of 1e-5 wide differences."""
    angle = np.radians(degrees)
    edge = CompleteContact(angle, STEEL)
    side = 0.7 * np.array([[np.cos(angle), np.sin(angle)]])
    assert edge.stress(side)[0] @ [-np.sin(angle), np.cos(angle)] == pytest.approx([0.0, 0.0], abs=1e-13)
    assert edge.stress(np.array([[-0.7, -1e-300]]))[0, :, 1] == pytest.approx([0.0, 0.0], abs=1e-13)
    assert edge.stress(np.array([[0.5, 0.0]]))[0, 1, 1] == pytest.approx(-(0.5 ** (edge.exponent - 1.0)))
    points, shifts = np.array([[0.3, -0.4], [0.2, 0.1]]), 1e-5 * np.eye(2)
    slopes = [edge.displacement(points + shift) - edge.displacement(points - shift) for shift in shifts]
    gradient = np.stack(slopes, axis=2) / 2e-5
    strain = 0.5 * (gradient + gradient.transpose(0, 2, 1))
    lame = 2.0 * STEEL.shear_modulus * 0.3 / (1.0 - 0.6)
    volume = np.trace(strain, axis1=1, axis2=2)[:, None, None] * np.eye(2)
    assert 2.0 * STEEL.shear_modulus * strain + lame * volume == pytest.approx(edge.stress(points), abs=1e-8)


def test_refusals():
    with pytest.raises(InputError, match=r"angle is 4.0: give an angle between 0 and pi"):
        CompleteContact(4.0, STEEL)
    with pytest.raises(InputError, match=r"length_share is 0.5: give a number between 0 and 0.5"):
        closed_cracks_slip(0.5)
    with pytest.raises(InputError, match=r"load is 1e-05: the beams slip from 4e-05 on: give more"):
        cantilevers_loss(0.3, 1e-4, 1e-5, 20.0, 1.0)
    with pytest.raises(InputError, match="n_blocks is 20: give an odd number from 3 on"):
        arch_friction_limit(20)
    with pytest.raises(InputError, match="modulus"):
        mindlin_loss(PartialSlip(HertzLine(1.0, 1.0, 1.0), 0.1, 0.3), 0.0)
