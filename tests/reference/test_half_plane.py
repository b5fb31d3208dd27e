"""Closed forms of half-planes: their integral equations in multiple precision, loads, limits, printed digits."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import mpmath
import numpy as np
import pytest

from bemkit.arrays import FloatArray
from bemkit.operators.material import Material, Plane
from bemkit.reference import (
    BluntWedge,
    BondedPunch,
    FlatPunch,
    HertzLine,
    LineContact,
    PartialSlip,
    RoundedPunch,
    SlidingPunch,
    hertz_slip,
    pair_modulus,
    spence_stick_ratio,
    static_cylinder_stick_ratio,
)
from tests.slow import slow_except, slow_only

Traction = Callable[[FloatArray], FloatArray]
STEEL = Material(1.0, 0.3)
BETA = 2.0 / 7.0
"""(1 - 2 nu) / (2 (1 - nu)) at nu = 0.3."""
MODULUS = 1.7


def at(traction: Traction, x: float) -> float:
    value = float(traction(np.array(float(x))))
    return value if np.isfinite(value) else 0.0  # the quadrature meets ends of zones by round-off


def cauchy(traction: Traction, x: float, cuts: tuple[float, ...]) -> float:
    """Return 1/pi times the principal value of the integral of traction(s) / (x - s), in panels between cuts."""
    near = min(abs(x - cut) for cut in cuts)
    value = mpmath.quad(lambda e: (at(traction, x - e) - at(traction, x + e)) / e, [0, near / 9, near / 2, near])
    ends = sorted({*cuts, x - near, x + near})
    for begin, end in pairwise(ends):
        if end <= x - 0.5 * near or begin >= x + 0.5 * near:
            value += mpmath.quad(lambda s: at(traction, s) / (x - s), [begin, 0.5 * (begin + end), end])
    return float(value / mpmath.pi)


def resultant(traction: Traction, cuts: tuple[float, ...]) -> float:
    return float(mpmath.quad(lambda s: at(traction, s), list(cuts)))


CONTACTS: dict[str, tuple[LineContact, Callable[[float], float]]] = {
    "hertz": (HertzLine(0.3, 2.0, MODULUS), lambda x: x / 2.0),
    "wedge": (BluntWedge(0.3, 0.2, MODULUS), lambda x: 0.2 * np.sign(x)),
    "rounded": (RoundedPunch(0.3, 0.4, 2.0, MODULUS), lambda x: np.sign(x) * max(abs(x) - 0.4, 0.0) / 2.0),
}


@pytest.mark.parametrize("name", list(CONTACTS))
def test_line_contacts_have_the_slope_of_the_indenter_and_its_load(name: str) -> None:
    """u_z' = -(2 / (pi E*)) PV integral of p / (x - s), [Johnson1985] equation (2.25b)."""
    contact, slope = CONTACTS[name]
    a = contact.half_width
    kinks = (-a, -0.4, 0.0, 0.4, a)
    assert resultant(contact.pressure, kinks) == pytest.approx(contact.load, rel=1e-9)  # quadrature at logarithms
    for x in (0.15 * a, 0.62 * a, 0.9 * a):
        # 15 digits of the quadrature, and logarithms that it meets at the kinks
        assert cauchy(contact.pressure, x, kinks) == pytest.approx(0.5 * MODULUS * slope(x), abs=2e-6)
    np.testing.assert_array_equal(contact.pressure(np.array([1.0001 * a, -3.0 * a])), 0.0)


def test_a_rounded_punch_lies_between_a_cylinder_and_a_flat_punch() -> None:
    x = np.array([0.0, 0.2, 0.3])
    cylinder = HertzLine(0.3, 2.0, MODULUS)
    almost = RoundedPunch(0.3, 1e-9, 2.0, MODULUS)
    assert almost.half_width == pytest.approx(cylinder.half_width, rel=1e-8)  # the flat is 1e-9 of it
    np.testing.assert_allclose(almost.pressure(x[1:]), cylinder.pressure(x[1:]), rtol=1e-7)
    sharp = RoundedPunch(0.3, 1.0, 1e-7, MODULUS)
    np.testing.assert_allclose(sharp.pressure(x), FlatPunch(0.3, 1.0, MODULUS).pressure(x), rtol=2e-4)  # sqrt(radius)


def test_hertz_has_its_printed_digits() -> None:
    assert (HertzLine(1e-4, 0.5, 0.5 / 0.91).half_width) == pytest.approx(0.01076405122, rel=1e-9)
    assert HertzLine(1e-3, 0.5, 0.5 / 0.91).peak_pressure == pytest.approx(0.01870270258, rel=1e-9)
    cgs = HertzLine(35e3, 50.0, pair_modulus(Material(210e3, 0.3), Material(70e3, 0.3)))
    assert cgs.half_width == pytest.approx(6.214627867, rel=1e-9)  # NAFEMS CGS-1, mm and MPa
    assert cgs.peak_pressure == pytest.approx(3585.362231, rel=1e-9)
    # E' = a = p0 = 1: the integral of the strain on the axis, and the next term of the formula is 3 / (4 d^2)
    unit = HertzLine(0.5 * np.pi, 0.5, 1.0)
    for depth, exact in ((10.0, 2.784470), (100.0, 5.084062), (1000.0, 7.386617)):
        assert unit.approach(depth, Material(0.91, 0.3)) == pytest.approx(exact, abs=0.5 / depth**2 + 1e-6)


@pytest.mark.parametrize(("shear", "ratio", "middle", "slip"), [
    (2.5e-4, 0.7071067812, 0.1464466094, 1.543434907e-4),
    (4.0e-4, 0.4472135955, 0.2763932023, 3.508965980e-4),
])  # fmt: skip
def test_sheared_cylinders_have_their_printed_digits(shear: float, ratio: float, middle: float, slip: float) -> None:
    contact = HertzLine(1e-3, 0.5, 0.5 / 0.91)
    sheared = PartialSlip(contact, shear, 0.5)
    a = contact.half_width
    assert sheared.stick_half_width / a == pytest.approx(ratio, rel=1e-9)
    assert at(sheared.traction, 0.0) / contact.peak_pressure == pytest.approx(middle, rel=1e-9)
    assert at(lambda x: hertz_slip(sheared, x), a) == pytest.approx(slip, rel=1e-8)
    assert at(lambda x: hertz_slip(sheared, x), 0.5 * ratio * a) == 0.0


@pytest.mark.parametrize("name", slow_only(CONTACTS, "rounded"))
def test_partial_slip_carries_its_load_and_strains_nothing_that_sticks(name: str) -> None:
    contact, _ = CONTACTS[name]
    sheared = PartialSlip(contact, 0.05, 0.4)
    a, c = contact.half_width, sheared.stick_half_width
    assert c < a
    cuts = tuple(sorted({-a, -c, -0.4, 0.0, 0.4, c, a}))
    assert resultant(sheared.traction, cuts) == pytest.approx(0.05, rel=1e-8)
    for x in (0.3 * c, 0.8 * c):
        assert cauchy(sheared.traction, x, cuts) == pytest.approx(0.0, abs=2e-6)  # logarithms at the kinks
    outside = np.array([0.5 * (a + c)])
    np.testing.assert_allclose(sheared.traction(outside), 0.4 * contact.pressure(outside), rtol=1e-14)


def test_the_slip_of_cylinders_is_the_integral_of_their_strains() -> None:
    sheared = PartialSlip(HertzLine(0.3, 2.0, MODULUS), 0.05, 0.4)
    a, c = sheared.contact.half_width, sheared.stick_half_width
    slopes = [cauchy(sheared.traction, c + (a - c) * share, (-a, -c, c, a)) for share in (0.3, 0.6)]
    for share, slope in zip((0.3, 0.6), slopes, strict=True):
        x, step = c + (a - c) * share, 1e-5 * a
        ends = hertz_slip(sheared, np.array([x - step, x + step]))
        assert (ends[1] - ends[0]) / (2.0 * step) == pytest.approx(2.0 / MODULUS * slope, rel=1e-6)  # differences


@pytest.mark.parametrize("tilt", slow_only([0.0, 0.1, 0.3], 0.0))
def test_a_tilted_punch_has_its_slope_load_and_moment(tilt: float) -> None:
    punch = FlatPunch(0.3, 1.0, MODULUS, tilt)
    start = punch.contact_start
    assert (start > -1.0) == (tilt == 0.3)
    cuts = (start, 0.5 * (start + 1.0), 1.0)
    # the quadrature meets square roots that end at infinity: 1e-6
    assert resultant(punch.pressure, cuts) == pytest.approx(0.3, rel=1e-6)
    assert resultant(lambda x: x * punch.pressure(x), cuts) == pytest.approx(punch.moment, abs=1e-6)
    for share in (0.4, 0.8):
        x = start + share * (1.0 - start)
        assert cauchy(punch.pressure, x, (start, 1.0)) == pytest.approx(-0.5 * MODULUS * tilt, abs=1e-6)


@pytest.mark.parametrize("friction", [0.3, -1.0])
def test_a_sliding_punch_stays_flat(friction: float) -> None:
    """u_z' = 0: 1/pi PV integral of p / (x - s) = beta q."""
    punch = SlidingPunch(0.3, 1.0, friction, STEEL)
    # singular powers of the distance at both ends
    assert resultant(punch.pressure, (-1.0, 0.0, 1.0)) == pytest.approx(0.3, rel=1e-4)
    for x in (-0.5, 0.3):
        assert cauchy(punch.pressure, x, (-1.0, 1.0)) == pytest.approx(BETA * at(punch.traction, x), abs=2e-5)
    assert (at(punch.pressure, -0.5) > at(punch.pressure, 0.5)) == (friction > 0.0)  # more at the trailing edge


@pytest.mark.parametrize("shear", slow_except([0.0, 0.2], 0.2))
def test_a_bonded_punch_moves_no_point_of_its_face(shear: float) -> None:
    """u_x' = 0 and u_z' = 0: the transforms of q and p are -beta p and beta q."""
    punch = BondedPunch(0.3, 1.0, STEEL, shear)
    assert resultant(punch.pressure, (-1.0, 0.0, 1.0)) == pytest.approx(0.3, rel=1e-6)
    assert resultant(punch.traction, (-1.0, 0.0, 1.0)) == pytest.approx(shear, abs=1e-6)
    for x in (-0.5, 0.3):
        assert cauchy(punch.pressure, x, (-1.0, 1.0)) == pytest.approx(BETA * at(punch.traction, x), abs=1e-6)
        assert cauchy(punch.traction, x, (-1.0, 1.0)) == pytest.approx(-BETA * at(punch.pressure, x), abs=1e-6)


def crude_stick_ratio(friction: float, n: int, *, is_parabola: bool) -> float:
    """Return c / a of n constant elements, uniform in the angle, and of plain changes of status."""
    edges = np.sin(np.linspace(0.0, 0.5 * np.pi, n + 1))
    x, width = 0.5 * (edges[:-1] + edges[1:]), np.diff(edges)

    def log_integral(at: FloatArray) -> FloatArray:
        distance = at[:, None] - edges
        values = distance * np.log(np.abs(distance)) - distance
        return values[:, :-1] - values[:, 1:]

    before = np.tril(np.ones((n, n)), -1) * width + np.diag(0.5 * width)
    direct, image = log_integral(x), log_integral(-x)
    of_p, of_q = -(direct + image) / np.pi, -(direct - image) / np.pi
    one = np.eye(n)
    sticks = np.ones(n, bool)
    for _ in range(40):
        top = np.hstack([of_p, -BETA * (width - before), -np.ones((n, 1))])
        held = np.hstack([-BETA * before, of_q, np.zeros((n, 1))])
        slips = np.hstack([-friction * one, one, np.zeros((n, 1))])
        load = np.concatenate([width, np.zeros(n + 1)])
        if is_parabola:  # the pressure ends at zero
            load = np.concatenate([np.zeros(n - 2), [-0.5, 1.5], np.zeros(n + 1)])
        system = np.vstack([top, np.where(sticks[:, None], held, slips), load])
        depth = np.append(-(x**2) if is_parabola else 0.0 * x, np.zeros(n + 1))
        depth[-1] = 0.0 if is_parabola else 1.0
        found = np.linalg.solve(system, depth)
        p, q = found[:n], found[n : 2 * n]
        now = np.where(sticks, q <= friction * p, of_q @ q - BETA * before @ p >= 0.0)
        if np.array_equal(now, sticks):
            break
        sticks = now
    return float(edges[sticks.sum()])


@pytest.mark.slow
@pytest.mark.parametrize("friction", [0.2, 0.3])
def test_stick_ratios_are_those_of_crude_elements(friction: float) -> None:
    # the crude answer is known to an element or two, of which there are 200 in a quarter of a circle
    flat = crude_stick_ratio(friction, 200, is_parabola=False)
    assert spence_stick_ratio(friction, STEEL) == pytest.approx(flat, abs=1.2e-2)
    parabola = crude_stick_ratio(friction, 200, is_parabola=True)
    assert static_cylinder_stick_ratio(friction, STEEL) == pytest.approx(parabola, abs=1.2e-2)


@pytest.mark.slow
def test_stick_ratios_of_known_cases() -> None:
    # converged in panels and points to 1e-8; crude elements above give two digits of them
    assert spence_stick_ratio(0.3, STEEL) == pytest.approx(0.68908656, abs=1e-7)
    assert static_cylinder_stick_ratio(0.3, STEEL) == pytest.approx(0.29633929, abs=1e-7)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HertzLine(-1.0, 1.0, 1.0), r"load is -1\.0: give a positive, finite number"),
        (lambda: BluntWedge(1.0, 0.0, 1.0), r"slope is 0\.0: give a positive, finite number"),
        (lambda: FlatPunch(1.0, 1.0, 1.0, -0.1), r"tilt is -0\.1: give a small slope, not negative"),
        (lambda: PartialSlip(HertzLine(1.0, 1.0, 1.0), 0.3, 0.3), r"is 0\.3: all slides from 0\.3 on: give less"),
        (
            lambda: hertz_slip(PartialSlip(BluntWedge(1.0, 1.0, 1.0), 0.1, 0.3), np.zeros(1)),
            "contact is a BluntWedge: this slip is that of a HertzLine",
        ),
        (lambda: spence_stick_ratio(50.0, STEEL), r"friction is 50\.0 and Poisson's ratio 0\.3: less than 0\.001"),
        (lambda: spence_stick_ratio(0.0, STEEL), r"friction is 0\.0: give a positive"),
    ],
)
def test_what_closed_forms_do_not_cover_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()


def test_plane_stress_changes_the_coupling() -> None:
    sheet = Material(1.0, 0.3, Plane.STRESS)  # nu of plane strain 0.3 / 1.3
    assert SlidingPunch(1.0, 1.0, 1.0, sheet).exponent == pytest.approx(-np.arctan(0.35) / np.pi, rel=1e-12)
