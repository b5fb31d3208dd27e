"""Gaps and directions of contact: a point moved by its gap along its direction lies on the obstacle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.contact.obstacle import (
    DirectedObstacle,
    Gap,
    Obstacle,
    RigidCavity,
    RigidCircle,
    RigidHalfPlane,
    measure_contact,
)
from bemkit.contact.polygon import RigidPolygon
from bemkit.errors import InputError
from bemkit.formulas import Expression
from bemkit.testing.independent_check.obstacles import distance_to

coordinates = st.floats(-10.0, 10.0)
points = st.tuples(coordinates, coordinates)
angles = st.floats(-math.pi, math.pi)

DART = ((0.0, 0.0), (4.0, -1.0), (1.0, 1.0), (2.0, 3.0))
"""Not convex: the corner (1, 1) points inwards."""


def unit(angle: float) -> tuple[float, float]:
    return math.cos(angle), math.sin(angle)


def touching(obstacle: DirectedObstacle, point: object) -> np.ndarray:  # type: ignore[type-arg]
    """Return where a point touches the obstacle; its own normal says nothing about that."""
    at, normals = np.array([point], float), np.array([[0.6, 0.8]])
    direction = obstacle.approach(at, normals)
    assert np.hypot(*direction[0]) == pytest.approx(1.0, abs=1e-14)
    return np.asarray(at[0] + obstacle.gap(at, normals)[0] * direction[0])


@given(points, points, angles)
def test_a_point_touches_a_half_plane_at_its_nearest_point(
    point: tuple[float, float], origin: tuple[float, float], facing: float
) -> None:
    obstacle = RigidHalfPlane(origin, tuple(3.0 * component for component in unit(facing)))
    normal, surface = np.array(unit(facing)), touching(obstacle, point) - np.array(origin)
    # coordinates up to 10 and gaps up to 30 carry round-off of about 1e-14
    assert surface @ normal == pytest.approx(0.0, abs=1e-12)
    foot = np.array(point) - np.array(origin)
    assert abs(foot[0] * normal[1] - foot[1] * normal[0]) == pytest.approx(
        abs(surface[0] * normal[1] - surface[1] * normal[0]), abs=1e-12
    )


def test_the_half_plane_of_the_paper() -> None:
    points = np.array([[0.0, 0.25], [3.0, -0.5], [0.0, 1.0], [0.0, 1.0]])
    normals = np.array([[0.0, -1.0], [0.0, -1.0], [1.0, 0.0], [0.0, 1.0]])
    gap, direction = measure_contact(RigidHalfPlane(), points, normals)
    np.testing.assert_array_equal(gap, [0.25, -0.5, np.inf, np.inf])
    np.testing.assert_array_equal(direction, [[0.0, -1.0]] * 4)


@pytest.mark.parametrize("shape", [RigidCircle, RigidCavity])
@given(point=points)
def test_a_point_touches_a_circle_along_its_radius(shape: type, point: tuple[float, float]) -> None:
    centre, radius = np.array([1.0, -2.0]), 1.2
    from_centre = touching(shape((1.0, -2.0), radius), point) - centre
    # distances up to 17 carry round-off of about 1e-14
    assert np.hypot(*from_centre) == pytest.approx(radius, abs=1e-13)
    assert from_centre @ (np.array(point) - centre) == pytest.approx(radius * math.dist(point, centre), abs=1e-12)


def test_the_centre_of_a_circle_is_as_far_from_it_in_any_direction() -> None:
    normal = np.array([[0.6, 0.8]])
    for shape, gap in ((RigidCircle, -2.0), (RigidCavity, 2.0)):
        obstacle = shape((0.0, 0.0), 2.0)
        np.testing.assert_array_equal(obstacle.approach(np.zeros((1, 2)), normal), normal)
        assert obstacle.gap(np.zeros((1, 2)), normal)[0] == gap


def test_interference_is_a_negative_gap() -> None:
    inside = np.array([[0.9, 0.0]])  # hole of radius 0.9 around a shaft of radius 1: its normal points to the centre
    assert RigidCircle((0.0, 0.0), 1.0).gap(inside, np.array([[-1.0, 0.0]]))[0] == pytest.approx(-0.1, rel=1e-12)
    outside = np.array([[0.0, 1.1]])  # disc of radius 1.1 in a ring of radius 1
    assert RigidCavity((0.0, 0.0), 1.0).gap(outside, np.array([[0.0, 1.0]]))[0] == pytest.approx(-0.1, rel=1e-12)


def test_a_disc_in_a_ring_has_the_difference_of_the_radii_as_gap() -> None:
    angle = np.linspace(0.0, 2.0 * np.pi, 17)
    normals = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    gap, direction = measure_contact(RigidCavity((0.0, 0.0), 1.25), normals, normals)
    np.testing.assert_allclose(gap, 0.25, rtol=1e-12)
    np.testing.assert_allclose(direction, normals, atol=1e-15)  # round-off of the length
    assert np.isinf(measure_contact(RigidCircle((0.0, 0.0), 0.5), normals, normals)[0]).all()


@pytest.mark.parametrize(
    ("point", "gap", "direction"),
    [
        ((2.0, -2.0), 6.0 / math.sqrt(17.0), (1.0 / math.sqrt(17.0), 4.0 / math.sqrt(17.0))),  # below its long side
        ((-3.0, -4.0), 5.0, (0.6, 0.8)),  # nearest to the corner at the origin
        ((2.5, 2.0), 2.0 / math.sqrt(5.0), (-2.0 / math.sqrt(5.0), 1.0 / math.sqrt(5.0))),  # in the notch
        ((1.0, 0.5), -1.5 / math.sqrt(13.0), (-2.0 / math.sqrt(13.0), -3.0 / math.sqrt(13.0))),  # inside
    ],
)
@pytest.mark.parametrize("vertices", [DART, DART[::-1]])
def test_distances_from_a_polygon(
    vertices: tuple[tuple[float, float], ...], point: object, gap: float, direction: tuple[float, float]
) -> None:
    at, normals = np.array([point], float), np.array([[0.0, 1.0]])
    obstacle = RigidPolygon(vertices)
    assert obstacle.gap(at, normals)[0] == pytest.approx(gap, rel=1e-12)
    np.testing.assert_allclose(obstacle.approach(at, normals)[0], direction, atol=1e-12)


@given(points)
def test_a_point_moved_by_its_gap_lies_on_the_polygon(point: tuple[float, float]) -> None:
    obstacle = RigidPolygon(DART)
    on_it = touching(obstacle, point)
    # gaps up to 15 carry round-off of about 1e-14; points on the polygon itself are touched at once
    assert obstacle.gap(on_it[None], np.array([[0.0, 1.0]]))[0] == pytest.approx(0.0, abs=1e-12)


def test_a_polygon_large_and_far_away_is_a_half_plane() -> None:
    floor = RigidPolygon(((-1e3, -1e3), (1e3, -1e3), (1e3, 0.0), (-1e3, 0.0)))
    at, down = np.array([[0.3, 0.2], [-0.4, -0.1]]), np.array([[0.0, -1.0]] * 2)
    for mine, other in zip(measure_contact(floor, at, down), measure_contact(RigidHalfPlane(), at, down), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-15)


@given(st.floats(0.01, 0.99), st.integers(0, 3), angles)
def test_points_that_rest_on_a_tilted_polygon_touch_its_sides(share: float, number: int, angle: float) -> None:
    turn = np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])
    vertices = np.array(DART) @ turn.T + [30.0, -70.0]
    along = vertices[(number + 1) % 4] - vertices[number]
    at = (vertices[number] + share * along)[None]  # on the side but for round-off
    outward = np.array([[along[1], -along[0]]]) / math.hypot(*along)
    gap, direction = measure_contact(RigidPolygon(tuple(map(tuple, vertices.tolist()))), at, -outward)
    np.testing.assert_allclose(direction, -outward, atol=1e-12)
    assert gap[0] == pytest.approx(0.0, abs=1e-12)  # coordinates of about 100


def test_points_at_the_height_of_a_corner_are_inside_or_outside_like_their_neighbours() -> None:
    # an apex whose height, as an end of a side, is one digit more than as the start of the next one
    apex = (-8.85597793472789, -4.953661135183589)
    spike = RigidPolygon(((-22.79091429013547, -33.45377412800914), (5.078958420679685, -33.45377412800914), apex))
    points, down = np.array([[-9.08, apex[1]], [-8.6, apex[1]], [-8.856, -8.0]]), np.array([[0.0, -1.0]] * 3)
    assert (np.sign(spike.gap(points, down)) == [1.0, 1.0, -1.0]).all()


def test_a_body_that_rests_on_a_corner_touches_along_its_own_normal() -> None:
    normals = np.array([[0.6, -0.8]])
    gap, direction = measure_contact(RigidPolygon(((0.0, 0.0), (1.0, -2.0), (1.0, 0.0))), np.zeros((1, 2)), normals)
    assert gap[0] == 0.0
    np.testing.assert_array_equal(direction, normals)


@given(st.integers(0, 3), angles, angles, st.integers(-8, 8), st.integers(-8, 8))
def test_round_off_does_not_choose_a_side_at_a_corner(number: int, turn: float, facing: float, x: int, y: int) -> None:
    cosine, sine = math.cos(turn), math.sin(turn)
    vertices = np.array(DART) @ np.array([[cosine, sine], [-sine, cosine]]) + [3.0, -7.0]
    at = vertices[number] + np.spacing(vertices[number]) * [x, y]
    normals = np.array([[math.cos(facing), math.sin(facing)]])
    obstacle = RigidPolygon(tuple(map(tuple, vertices.tolist())))
    np.testing.assert_array_equal(obstacle.approach(at[None], normals), normals)
    assert abs(obstacle.gap(at[None], normals)[0]) < 1e-13  # the last digits of coordinates of about ten


def test_a_point_on_the_side_of_a_polygon_is_pushed_against_its_normal() -> None:
    square = RigidPolygon(((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)))
    gap, direction = measure_contact(square, np.array([[0.5, 1.0]]), np.array([[0.0, -1.0]]))
    assert gap[0] == 0.0
    np.testing.assert_array_equal(direction, [[0.0, -1.0]])


def test_a_gap_may_be_a_number_a_formula_or_a_function() -> None:
    points, normals = np.array([[0.5, 0.0], [1.0, 0.0]]), np.array([[0.0, -1.0]] * 2)
    np.testing.assert_array_equal(Gap().gap(points, normals), [0.0, 0.0])
    np.testing.assert_array_equal(Gap(Expression("x**2")).gap(points, normals), [0.25, 1.0])
    np.testing.assert_array_equal(Gap(lambda x, y: 2.0 * x).gap(points, normals), [1.0, 2.0])


def test_a_gap_acts_along_the_normal_of_the_body_or_as_it_is_told() -> None:
    points, normals = np.array([[0.5, 0.0], [1.0, 0.0]]), np.array([[0.6, -0.8]] * 2)
    np.testing.assert_array_equal(Gap(0.1).approach(points, normals), normals)
    np.testing.assert_array_equal(Gap(0.1, direction=(0.0, -3.0)).approach(points, normals), [[0.0, -1.0]] * 2)
    tilted = Gap(0.1, direction=(Expression("x"), -1.0)).approach(points, normals)
    expected = np.array([[0.5, -1.0], [1.0, -1.0]])
    np.testing.assert_allclose(tilted, expected / np.hypot(*expected.T)[:, None], rtol=1e-15)
    with pytest.raises(ValueError, match=r"direction is \(0, 0\) at \(0.5, 0\): give the direction into the obstacle"):
        Gap(0.1, direction=(Expression("x - 0.5"), 0.0)).approach(points, normals)


def test_an_obstacle_of_ones_own_need_not_know_directions() -> None:
    class Step:
        def gap(self, points: np.ndarray, normals: np.ndarray) -> np.ndarray:  # type: ignore[type-arg]
            return np.where(points[:, 0] > 0.0, 0.0, 0.1)

    own: Obstacle = Step()
    normals = np.array([[0.6, -0.8], [0.0, -1.0]])
    gap, direction = measure_contact(own, np.array([[-1.0, 0.0], [1.0, 0.0]]), normals)
    np.testing.assert_array_equal(gap, [0.1, 0.0])
    np.testing.assert_array_equal(direction, normals)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: RigidHalfPlane((0.0, 0.0), (0.0, 0.0)), "normal is"),
        (lambda: RigidHalfPlane((math.nan, 0.0)), "point is"),
        (lambda: RigidCircle((0.0, 0.0), 0.0), "radius is"),
        (lambda: RigidCircle((math.inf, 0.0), 1.0), "centre is"),
        (lambda: RigidCavity((0.0, 0.0), -1.0), "radius is"),
        (lambda: RigidCavity((0.0, math.nan), 1.0), "centre is"),
        (lambda: Gap(math.inf), "value = inf"),
        (lambda: Gap(0.0, direction=(0.0, math.nan)), r"direction\[1\] = nan"),
        (lambda: Gap(0.0, direction=(1.0, 0.0, 0.0)), "direction has 3 components"),
        (lambda: RigidPolygon(((0.0, 0.0), (1.0, 0.0))), "vertices has 2 points: give at least three"),
        (
            lambda: RigidPolygon(((0.0, 0.0), (1.0, 0.0), (1.0, 0.0))),
            r"vertices\[2\] is \(1.0, 0.0\), as is",
        ),
        (lambda: RigidPolygon(((0.0, 0.0), (1.0, 0.0), (1.0, math.inf))), r"vertices\[2\] is"),
    ],
)
def test_obstacles_check_what_they_are_given(make: object, message: str) -> None:
    with pytest.raises(ValueError, match=message):
        make()  # type: ignore[operator]


@pytest.mark.parametrize("off", [-1e-15, 0.0, 1e-15])
def test_in_the_middle_of_a_wedge_the_first_side_counts_whatever_the_round_off(off: float) -> None:
    wedge = RigidPolygon(((0.0, -1e-4), (0.3, 1.0), (-0.3, 1.0)))
    at, up = np.array([[off, 0.0]]), np.array([[0.0, 1.0]])
    side = np.array([0.3, 1.0001]) / np.hypot(0.3, 1.0001)
    into_first = [-side[1], side[0]]
    for gap, direction in (measure_contact(wedge, at, up), distance_to(wedge, at, up)):
        np.testing.assert_allclose(gap, -1e-4 * side[0], rtol=1e-10)
        np.testing.assert_allclose(direction[0], into_first, atol=1e-12)


class Misshapen:
    """An obstacle of one's own that returns what it should not."""

    def __init__(self, gap: object, approach: object) -> None:
        self._gap, self._approach = gap, approach

    def gap(self, points: np.ndarray, normals: np.ndarray) -> object:
        return self._gap

    def approach(self, points: np.ndarray, normals: np.ndarray) -> object:
        return self._approach


def test_arrays_of_an_obstacle_of_ones_own_have_the_shapes_of_the_points() -> None:
    points, normals = np.zeros((2, 2)), np.tile([0.0, -1.0], (2, 1))
    gap, direction = measure_contact(Misshapen([0.1, 0.2], normals.tolist()), points, normals)
    np.testing.assert_array_equal(gap, [0.1, 0.2])  # lists will do
    np.testing.assert_array_equal(direction, normals)
    with pytest.raises(
        ValueError, match=r"Misshapen.gap returned an array of the shape \(3,\): return the shape \(2,\)"
    ):
        measure_contact(Misshapen(np.zeros(3), normals), points, normals)
    with pytest.raises(ValueError, match=r"Misshapen.approach returned an array of the shape \(2,\): return the shape"):
        measure_contact(Misshapen(np.zeros(2), np.array([0.0, -1.0])), points, normals)


class OnePoint(Misshapen):
    def gap(self, x: np.ndarray) -> object:  # type: ignore[override]
        return x[:, 1]


def test_methods_of_an_obstacle_of_ones_own_take_points_and_normals() -> None:
    points = np.zeros((2, 2))
    with pytest.raises(
        InputError, match=r"OnePoint.gap cannot be called .*: define gap\(self, points, normals\) .* \(n,\)$"
    ):
        measure_contact(OnePoint(0.0, 0.0), points, points)
