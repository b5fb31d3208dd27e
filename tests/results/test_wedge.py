"""Exponents of the fields at corners against known ones, and their symmetries."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.results.wedge import FREE, HELD, ROLLER, JoinedWedge, WedgeSide, joined_exponent, leading_exponent
from tests.slow import slow_except

RIGHT, STRAIGHT = 0.5 * math.pi, math.pi
TANGENT_HELD = WedgeSide(holds_tangent=True)
angles = st.floats(0.4, 6.2)
kappas = st.floats(1.0, 2.9)
frictions = st.floats(-1.5, 1.5)
sides = st.one_of(
    st.sampled_from([FREE, HELD, ROLLER, TANGENT_HELD]), frictions.map(lambda f: WedgeSide(True, False, f))
)


def kappa(poisson_ratio: float) -> float:
    return 3.0 - 4.0 * poisson_ratio


def or_bounded(exponent: float | None) -> float:
    """Return an exponent; those above 0.99 may be missed, and are none."""
    return 0.99 if exponent is None else min(exponent, 0.99)


@pytest.mark.parametrize(
    ("angle", "outgoing", "incoming", "poisson_ratio", "exponent"),
    [
        (2.0 * math.pi, FREE, FREE, 0.3, 0.5),  # a crack
        (1.5 * math.pi, FREE, FREE, 0.3, 0.544484),  # a re-entrant corner
        (1.5 * math.pi, FREE, FREE, 0.1, 0.544484),
        (RIGHT, HELD, FREE, 0.3, 0.711173),
        (RIGHT, FREE, HELD, 0.2, 0.781073),
        (STRAIGHT, HELD, FREE, 0.3, 0.5),  # the edge of a bonded punch, where fields oscillate
        (STRAIGHT, ROLLER, FREE, 0.3, 0.5),  # the edge of a smooth punch
        (1.5 * math.pi, ROLLER, ROLLER, 0.3, 1.0 / 3.0),
    ],
)
def test_known_exponents(
    angle: float, outgoing: WedgeSide, incoming: WedgeSide, poisson_ratio: float, exponent: float
) -> None:
    """Six digits, as they are printed; those of Williams and of flat punches."""
    assert leading_exponent(angle, outgoing, incoming, kappa(poisson_ratio)) == pytest.approx(exponent, abs=1e-6)


@pytest.mark.parametrize(
    ("outgoing", "incoming"), [(FREE, FREE), (ROLLER, FREE), (ROLLER, ROLLER), (ROLLER, HELD), (HELD, HELD)]
)
def test_tractions_at_right_angles_are_bounded_unless_something_held_meets_something_free(
    outgoing: WedgeSide, incoming: WedgeSide
) -> None:
    assert leading_exponent(RIGHT, outgoing, incoming, kappa(0.3)) is None


@pytest.mark.slow
@given(frictions, st.floats(0.0, 0.5))
def test_the_edges_of_a_punch_that_slides(friction: float, poisson_ratio: float) -> None:
    """Tractions go like r^(-1/2 + beta) at one edge and r^(-1/2 - beta) at the other [Johnson1985]."""
    beta = math.atan(friction * (1.0 - 2.0 * poisson_ratio) / (2.0 * (1.0 - poisson_ratio))) / math.pi
    sliding = WedgeSide(holds_normal=True, friction=friction)
    for outgoing, incoming, sign in ((sliding, FREE, 1.0), (FREE, sliding, -1.0)):
        found = leading_exponent(STRAIGHT, outgoing, incoming, kappa(poisson_ratio))
        assert found == pytest.approx(0.5 + sign * beta, abs=1e-7)


@pytest.mark.slow
@given(angles, sides, sides, kappas)
def test_a_mirror_exchanges_the_sides_and_turns_the_slip(
    angle: float, outgoing: WedgeSide, incoming: WedgeSide, kappa: float
) -> None:
    mirrored = [replace(side, friction=-side.friction) for side in (incoming, outgoing)]
    one, other = leading_exponent(angle, outgoing, incoming, kappa), leading_exponent(angle, *mirrored, kappa)
    assert or_bounded(one) == pytest.approx(or_bounded(other), abs=1e-6)


@pytest.mark.slow
@given(st.floats(0.4, 3.1), st.sampled_from([FREE, HELD]), kappas)
def test_halves_of_a_wedge_have_its_exponents(half: float, side: WedgeSide, kappa: float) -> None:
    """Fields of a symmetric wedge are symmetric or antisymmetric: a roller, or a held tangent, on the middle line."""
    halves = [leading_exponent(half, side, middle, kappa) for middle in (ROLLER, TANGENT_HELD)]
    whole = leading_exponent(2.0 * half, side, side, kappa)
    assert or_bounded(whole) == pytest.approx(min(map(or_bounded, halves)), abs=1e-6)


def test_friction_against_outward_slip_makes_pressures_at_a_right_angle_grow() -> None:
    """The corner of a block that is pressed and spreads; without friction, or with slip inwards, they stay bounded."""
    frictions = np.array([0.1, 0.3, 1.0])
    found = [leading_exponent(RIGHT, FREE, WedgeSide(True, friction=f), kappa(0.3)) for f in frictions.tolist()]
    assert all(exponent is not None for exponent in found)
    assert np.all(np.diff(np.array(found, float)) < 0.0)
    assert found[1] == pytest.approx(0.712936, abs=1e-6)
    assert leading_exponent(RIGHT, FREE, WedgeSide(True, friction=-0.3), kappa(0.3)) is None


@pytest.mark.parametrize(
    ("degrees", "friction"),
    slow_except(
        [(60, 0.961909), (75, 0.717733), (90, 0.5430756), (105, 0.409581), (120, 0.302550)],
        (60, 0.961909),
        (90, 0.5430756),
    ),
)
def test_an_edge_on_a_half_plane_of_its_material_sticks_from_a_known_friction_on(degrees: int, friction: float) -> None:
    """Stuck bodies are one wedge; at that friction its fields slide nowhere, so that outward slip has its exponent.

    A change of the friction of 1e-6, its digits, changes the exponent by less than that.
    """
    edge, plane = JoinedWedge(math.radians(degrees), kappa(0.3), 1.0), JoinedWedge(math.pi, kappa(0.3), 1.0)
    whole = leading_exponent(edge.angle + math.pi, FREE, FREE, edge.kappa)
    outwards, at_start = (WedgeSide(True, friction=sign * friction) for sign in (1.0, -1.0))
    assert joined_exponent(edge, plane, HELD) == pytest.approx(whole, abs=1e-9)
    assert joined_exponent(edge, plane, outwards) == pytest.approx(whole, abs=1e-6)
    assert joined_exponent(plane, edge, at_start) == pytest.approx(whole, abs=1e-6)
    larger = joined_exponent(edge, plane, replace(outwards, friction=friction - 0.05))
    assert larger is not None
    assert whole is not None
    assert larger > whole + 1e-3


@pytest.mark.parametrize("contact", [HELD, ROLLER, WedgeSide(True, friction=0.3)])
def test_a_body_on_one_that_is_much_stiffer_is_a_body_on_a_rigid_one(contact: WedgeSide) -> None:
    """To the ratio of the stiffnesses, 1e-8."""
    soft, stiff = JoinedWedge(RIGHT, kappa(0.2), 1e-8), JoinedWedge(STRAIGHT, kappa(0.3), 1.0)
    rigid = leading_exponent(RIGHT, FREE, contact, soft.kappa)
    assert or_bounded(joined_exponent(soft, stiff, contact)) == pytest.approx(min(or_bounded(rigid), 0.99), abs=1e-6)


@pytest.mark.slow
@given(angles, angles, st.sampled_from([HELD, ROLLER, WedgeSide(True, friction=0.4)]), kappas, kappas)
def test_a_mirror_exchanges_the_two_bodies(
    angle: float, other_angle: float, contact: WedgeSide, kappa: float, other_kappa: float
) -> None:
    one, other = JoinedWedge(angle, kappa, 1.0), JoinedWedge(min(other_angle, 6.2 - angle + 0.05), other_kappa, 3.0)
    mirrored = replace(contact, friction=-contact.friction)
    found, again = joined_exponent(one, other, contact), joined_exponent(other, one, mirrored)
    assert or_bounded(found) == pytest.approx(or_bounded(again), abs=1e-5)
