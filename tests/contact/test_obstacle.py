"""Gaps along the normal, against points moved until they touch."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.contact.obstacle import Cavity, Circle, Gap, HalfPlane
from bemkit.expression import Expression

coordinates = st.floats(-10.0, 10.0)
points = st.tuples(coordinates, coordinates)
angles = st.floats(-math.pi, math.pi)


def direction(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


@given(points, points, angles, angles)
def test_a_point_moved_by_the_gap_lies_on_the_half_plane(
    point: tuple[float, float], origin: tuple[float, float], facing: float, turn: float
) -> None:
    obstacle = HalfPlane(origin, tuple(3.0 * component for component in direction(facing)))
    normal = np.array(direction(facing + math.pi + turn / 3.0))  # within 60 degrees of facing the obstacle
    gap = obstacle.gap(np.array([point]), normal[None])[0]
    touching = np.array(point) + gap * normal
    # coordinates up to 10 and gaps up to 60 carry round-off of about 1e-14
    assert (touching - np.array(origin)) @ np.array(direction(facing)) == pytest.approx(0.0, abs=1e-12)


def test_the_half_plane_of_the_paper() -> None:
    points = np.array([[0.0, 0.25], [3.0, -0.5], [0.0, 1.0], [0.0, 1.0]])
    normals = np.array([[0.0, -1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    np.testing.assert_array_equal(HalfPlane().gap(points, normals), [0.25, -0.5, np.inf, np.inf])


@given(st.floats(1.5, 5.0), angles, st.floats(-0.2, 0.2))
def test_a_point_moved_by_the_gap_lies_on_the_circle(distance: float, angle: float, turn: float) -> None:
    centre, radius = np.array([1.0, -2.0]), 1.2
    point = centre + distance * np.array(direction(angle))
    normal = np.array(direction(angle + math.pi + turn))
    gap = Circle((1.0, -2.0), radius).gap(point[None], normal[None])[0]
    assert np.hypot(*(point + gap * normal - centre)) == pytest.approx(radius, rel=1e-12)
    assert 0.0 < gap < distance * math.cos(turn)  # the near side, not the far one


def test_interference_is_a_negative_gap() -> None:
    inside = np.array([[0.9, 0.0]])  # hole of radius 0.9 around a shaft of radius 1: its normal points to the centre
    assert Circle((0.0, 0.0), 1.0).gap(inside, np.array([[-1.0, 0.0]]))[0] == pytest.approx(-0.1, rel=1e-12)
    outside = np.array([[0.0, 1.1]])  # disc of radius 1.1 in a ring of radius 1
    assert Cavity((0.0, 0.0), 1.0).gap(outside, np.array([[0.0, 1.0]]))[0] == pytest.approx(-0.1, rel=1e-12)


def test_a_disc_in_a_ring_has_the_difference_of_the_radii_as_gap() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 17)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    np.testing.assert_allclose(Cavity((0.0, 0.0), 1.25).gap(normals, normals), 0.25, rtol=1e-12)
    np.testing.assert_array_equal(Circle((0.0, 0.0), 0.5).gap(normals, normals), np.inf)


def test_a_normal_that_misses_the_circle_has_no_gap() -> None:
    miss = Circle((0.0, 0.0), 1.0).gap(np.array([[2.0, 1.5]]), np.array([[-1.0, 0.0]]))
    assert miss[0] == np.inf


def test_a_gap_may_be_a_number_a_formula_or_a_function() -> None:
    points, normals = np.array([[0.5, 0.0], [1.0, 0.0]]), np.array([[0.0, -1.0]] * 2)
    np.testing.assert_array_equal(Gap().gap(points, normals), [0.0, 0.0])
    np.testing.assert_array_equal(Gap(Expression("x**2")).gap(points, normals), [0.25, 1.0])
    np.testing.assert_array_equal(Gap(lambda x, y: 2.0 * x).gap(points, normals), [1.0, 2.0])


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: HalfPlane((0.0, 0.0), (0.0, 0.0)), "normal is"),
        (lambda: HalfPlane((math.nan, 0.0)), "point is"),
        (lambda: Circle((0.0, 0.0), 0.0), "radius is"),
        (lambda: Circle((math.inf, 0.0), 1.0), "centre is"),
        (lambda: Cavity((0.0, 0.0), -1.0), "radius is"),
        (lambda: Cavity((0.0, math.nan), 1.0), "centre is"),
        (lambda: Gap(math.inf), "value = inf"),
    ],
)
def test_obstacles_check_what_they_are_given(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]
