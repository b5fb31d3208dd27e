"""Splines and signed distances as obstacles: against circles, ellipses, parabolas and boxes known in closed form."""

from __future__ import annotations

import math

import numpy as np
import pytest

from bemkit.contact.obstacle import RigidCavity, RigidCircle, RigidHalfPlane
from bemkit.contact.polygon import RigidPolygon
from bemkit.contact.signed_distance import SignedDistance
from bemkit.contact.spline import RigidSpline
from bemkit.formulas import Expression

RNG = np.random.default_rng(0)
ANGLE = RNG.uniform(-np.pi, np.pi, 200)
AROUND = RNG.uniform(0.4, 3.0, 200)[:, None] * np.stack([np.cos(ANGLE), np.sin(ANGLE)], axis=1)
"""Points inside and outside of the unit circle."""
UP = np.broadcast_to([0.0, 1.0], AROUND.shape)


def on_circle(n_points: int, sense: int = 1) -> tuple[tuple[float, float], ...]:
    angle = sense * 2.0 * np.pi * np.arange(n_points) / n_points
    return tuple(zip(np.cos(angle).tolist(), np.sin(angle).tolist(), strict=True))


def errors(obstacle: object, exact: object, points: np.ndarray) -> tuple[float, float]:  # type: ignore[type-arg]
    """Return the largest errors of gap and direction."""
    normals = UP[: len(points)]
    gap = np.abs(obstacle.gap(points, normals) - exact.gap(points, normals))  # type: ignore[attr-defined]
    ways = np.abs(obstacle.approach(points, normals) - exact.approach(points, normals))  # type: ignore[attr-defined]
    return float(gap.max()), float(ways.max())


def test_a_spline_meets_a_circle_to_the_fourth_power_and_its_normals_to_the_third() -> None:
    found = np.array(
        [errors(RigidSpline(on_circle(n)), RigidCircle((0.0, 0.0), 1.0), AROUND) for n in (16, 32, 64, 128)]
    )
    orders = np.log2(found[:-1] / found[1:])
    assert (np.abs(orders[1:] - [4.0, 3.0]) < 0.2).all()
    assert found[-1, 0] < 2e-8
    assert found[-1, 1] < 4e-6


def test_polygon_spline_and_distance_of_one_circle_agree_to_their_accuracy() -> None:
    circle, n = RigidCircle((0.0, 0.0), 1.0), 64
    sagitta = 1.0 - math.cos(math.pi / n)
    assert errors(RigidPolygon(on_circle(n)), circle, AROUND)[0] == pytest.approx(sagitta, rel=0.01)
    assert errors(RigidSpline(on_circle(n)), circle, AROUND)[0] < 3e-7
    for formula in ("hypot(x, y) - 1", "x**2 + y**2 - 1", "(x**2 + y**2)**2 - 1"):
        gap, direction = errors(SignedDistance(Expression(formula)), circle, AROUND)
        assert gap < 1e-13  # round-off of lengths of three
        assert direction < 1e-11  # differences of sixth order


def test_the_order_of_its_points_says_on_which_side_a_spline_is_filled() -> None:
    gap, direction = errors(RigidSpline(on_circle(128, -1)), RigidCavity((0.0, 0.0), 1.0), AROUND)
    assert gap < 2e-8
    assert direction < 4e-6


def test_points_on_a_spline_are_pushed_along_its_normal() -> None:
    points = RigidSpline(on_circle(128)).curve(5)
    obstacle = RigidSpline(on_circle(128))
    np.testing.assert_allclose(obstacle.gap(points, UP[:1]), 0.0, atol=1e-15)
    np.testing.assert_allclose(obstacle.approach(points, UP[:1]), -points, atol=4e-6)


def test_an_open_spline_goes_on_straight() -> None:
    """A parabola y = x^2 / 10 with the obstacle below, whose tangents at the ends have the slope 2/5."""
    x = np.linspace(-2.0, 2.0, 161)
    obstacle = RigidSpline(tuple(zip(x[::-1].tolist(), (0.1 * x**2)[::-1].tolist(), strict=True)), is_closed=False)
    level = SignedDistance(lambda x, y: y - 0.1 * x**2)  # the obstacle is below
    points = np.stack([RNG.uniform(-1.2, 1.2, 50), RNG.uniform(-1.0, 1.0, 50)], axis=1)
    below = RigidSpline(obstacle.points[::-1], is_closed=False)  # filled above
    np.testing.assert_allclose(obstacle.gap(points, UP[:50]), level.gap(points, UP[:50]), atol=2e-8)
    np.testing.assert_allclose(below.gap(points, UP[:50]), -obstacle.gap(points, UP[:50]), atol=1e-14)
    far = np.array([[5.0, 3.0], [-4.0, 0.5]])
    for side, rows in ((1.0, slice(0, 1)), (-1.0, slice(1, 2))):
        plane = RigidHalfPlane((2.0 * side, 0.4), (-0.4 * side, 1.0))
        np.testing.assert_allclose(obstacle.gap(far, UP[:2])[rows], plane.gap(far, UP[:2])[rows], atol=1e-6)
        np.testing.assert_allclose(obstacle.approach(far, UP[:2])[rows], plane.approach(far, UP[:2])[rows], atol=1e-6)


def test_the_nearest_point_of_an_ellipse_is_found_though_its_formula_is_no_distance() -> None:
    angle, distance = ANGLE, RNG.uniform(-0.3, 3.0, ANGLE.size)  # its least radius of curvature is 1/2
    foot = np.stack([2.0 * np.cos(angle), np.sin(angle)], axis=1)
    normals = np.stack([np.cos(angle) / 2.0, np.sin(angle)], axis=1)
    normals /= np.hypot(*normals.T)[:, None]
    obstacle = SignedDistance(Expression("x**2 / 4 + y**2 - 1"))
    points = foot + distance[:, None] * normals
    np.testing.assert_allclose(obstacle.gap(points, UP), distance, atol=1e-12)  # Newton to round-off
    np.testing.assert_allclose(obstacle.approach(points, UP), -normals, atol=1e-11)


def test_points_deep_inside_an_ellipse_find_its_near_sides() -> None:
    """Also from the long axis, where the way along the slope leads to its far end."""
    points = np.array([[0.1, 0.0], [1.4, 0.0], [1.5, 0.0], [-1.449, 0.0407], [0.0, 0.2], [1.0, 0.5]])
    angle = np.linspace(-np.pi, np.pi, 100_001)
    surface = np.stack([2.0 * np.cos(angle), np.sin(angle)], axis=1)
    expected = [-float(np.hypot(*(surface - point).T).min()) for point in points]
    found = SignedDistance(Expression("x**2 / 4 + y**2 - 1")).gap(points, UP[:6])
    np.testing.assert_allclose(found, expected, atol=1e-8)  # squares of a hundred-thousandth of the outline


def test_a_distance_may_have_corners() -> None:
    apart = "hypot(max(abs(x) - 1, 0), max(abs(y) - 1, 0)) + min(max(abs(x) - 1, abs(y) - 1), 0)"
    box = RigidPolygon(((-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)))
    points = AROUND[np.abs(np.abs(AROUND[:, 0]) - np.abs(AROUND[:, 1])) > 0.01]  # inside, two sides are equally near
    gap, direction = errors(SignedDistance(Expression(apart)), box, points)
    assert gap < 1e-14
    assert direction < 1e-10


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_units_do_not_matter(scale: float) -> None:
    def level(x: np.ndarray, y: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
        return (x / scale) ** 2 + (y / scale) ** 2 - 1.0

    gap, direction = errors(SignedDistance(level), RigidCircle((0.0, 0.0), scale), scale * AROUND)
    assert gap < 1e-13 * scale
    assert direction < 1e-11


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RigidSpline(((0.0, 0.0), (1.0, 0.0))), "points has 2 entries: give at least three"),
        (
            lambda: RigidSpline(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 0.0))),
            r"points\[0\] is \(0.0, 0.0\), as is the one before it: remove one of them",
        ),
        (lambda: RigidSpline(((0.0, 0.0), (1.0, math.nan), (1.0, 1.0))), r"points\[1\] is \(1.0, nan\)"),
        (lambda: SignedDistance(1.0), "distance = 1.0 is a number; give a formula in x and y, or a function"),
        (lambda: SignedDistance(Expression("x > 0")), "distance = 'x > 0' is a condition"),
        (
            lambda: SignedDistance(Expression("1 + 0 * x")).gap(AROUND, UP),
            "distance has no slope at .*: give a function that increases away from the obstacle",
        ),
        (
            lambda: SignedDistance(Expression("x**2 + y**2 + 1")).gap(AROUND, UP),
            "no nearest point of its zero level is found from .*; give a smooth function",
        ),
    ],
)
def test_smooth_obstacles_check_what_they_are_given(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]
