"""All obstacles and shapes conform, and each planted fault is found by its name."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

import bemkit as bk
from bemkit.contact.rough_profile import Profile, ProfilePoints, SelfAffineProfile
from bemkit.geometry import Arc, GeometryError, Outline, Side, discretise, shapes
from bemkit.scene.registry import OBSTACLES
from bemkit.testing import CheckFailed, check_obstacle, check_shape

MESH = discretise(bk.Rectangle(1.0, 1.0).outline(), n_elements=40)
ROUND = tuple((float(np.cos(angle)), float(np.sin(angle))) for angle in np.linspace(0.0, 2.0 * np.pi, 64)[:-1])
DISTANCES = [
    bk.RigidHalfPlane((0.0, -0.5), (0.1, 1.0)),
    bk.RigidCircle((0.2, 0.3), 1.0),
    bk.RigidCavity((0.2, 0.3), 1.5),
    bk.RigidPolygon(((0.0, -1.0), (1.0, -1.0), (0.0, -0.2))),
    bk.RigidSpline(ROUND),
    bk.RigidSpline(((2.0, -0.5), (1.0, -0.3), (-1.0, -0.3), (-2.0, -0.5)), is_closed=False),
    bk.SignedDistance(bk.Expression("sqrt(x**2 + (y + 1)**2) - 0.5")),
]
GAPS = [
    bk.Gap(bk.Expression("where(x < 0.5, 0.1 * x, 100)"), direction=(0.0, -1.0)),
    ProfilePoints(((-1.0, 0.1), (0.2, 0.0), (2.0, 0.3))),
    bk.load_scene("rough-surface").only.parts[0].condition.obstacle,  # type: ignore[union-attr]
]
SHAPES = [
    bk.Rectangle(1.0, 2.0),
    bk.Polygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))),
    bk.Disk(1.0),
    shapes.Sector(1.0, 0.0, 90.0),
    shapes.Ring(0.5, 1.0),
    bk.PlateWithHole(2.0, 1.0, 0.3),
    bk.ExteriorOf(bk.Disk(1.0)),
    shapes.ElasticHalfPlane(-1.0, 1.0),
    shapes.PeriodicHalfPlane(1.0),
]


@pytest.mark.parametrize("obstacle", DISTANCES, ids=lambda each: type(each).__name__)
def test_obstacles_conform(obstacle: bk.Obstacle) -> None:
    check_obstacle(obstacle, MESH)


@pytest.mark.parametrize("obstacle", GAPS, ids=lambda each: type(each).__name__)
def test_gaps_on_the_boundary_conform(obstacle: bk.Obstacle) -> None:
    check_obstacle(obstacle, MESH, is_everywhere=False)
    with pytest.raises(CheckFailed, match="gap changes by"):
        check_obstacle(obstacle, MESH)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda each: type(each).__name__)
def test_shapes_conform(shape: shapes.Shape) -> None:
    check_shape(shape)


def test_every_obstacle_and_shape_is_checked() -> None:
    names = {reference.split(":")[1] for reference in OBSTACLES.built_in.values()}
    assert names - {type(each).__name__ for each in (*DISTANCES, *GAPS)} <= {
        Profile.__name__,
        SelfAffineProfile.__name__,
    }
    public = {
        name
        for name, each in vars(shapes).items()
        if isinstance(each, type) and issubclass(each, shapes.CheckedShape) and each is not shapes.CheckedShape
    }
    assert public == {type(each).__name__ for each in SHAPES}


@dataclass(frozen=True)
class Floor:
    """A floor of which single methods can be replaced."""

    of_gap: Callable[..., Any] = lambda points, normals: points[:, 1] + 0.5
    of_approach: Callable[..., Any] = lambda points, normals: np.broadcast_to([0.0, -1.0], points.shape)

    def gap(self, points: np.ndarray, normals: np.ndarray) -> Any:
        return self.of_gap(points, normals)

    def approach(self, points: np.ndarray, normals: np.ndarray) -> Any:
        return self.of_approach(points, normals)


def spoilt(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    points += 1.0
    return points[:, 1]


def spoilt_normals(points: np.ndarray, normals: np.ndarray) -> np.ndarray:
    normals *= 0.5
    return points[:, 1] + 0.5


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"of_gap": lambda points, normals: points}, r"gap returns the shape \(40, 2\)"),
        ({"of_gap": lambda points, normals: points[:, 1] * np.nan}, "gap is not finite"),
        ({"of_gap": lambda points, normals: np.full(len(points), -np.inf)}, "gap is not finite"),
        ({"of_gap": spoilt}, "gap changes its argument"),
        ({"of_gap": spoilt_normals}, "gap changes its argument normals"),
        ({"of_gap": lambda points, normals: points[:, 1] + np.random.default_rng().normal()}, "gap gives two answers"),
        ({"of_gap": lambda points, normals: points[:, 1] - points[:, 1].mean()}, "gap at some points depends on the"),
        (
            {"of_gap": lambda points, normals: 2.0 * points[:, 1]},
            r"gap changes by -2 times a step towards .*, not by -1",
        ),
        ({"of_gap": lambda points, normals: -points[:, 1]}, "gap changes by 1 times a step towards the obstacle"),
        ({"of_gap": lambda points, normals: points[:, 1] + 0.1 * points[:, 0]}, r"changes by 0.1 times a step across"),
        ({"of_approach": lambda points, normals: np.tile([0.0, -1.1], (len(points), 1))}, "is no unit vector"),
        ({"of_approach": lambda points, normals: np.tile([0.0, 1.0], (len(points), 1))}, "gap changes by 1 times"),
        ({"of_approach": lambda points, normals: np.tile([0.6, -0.8], (len(points), 1))}, "gap changes by -0.8 times"),
    ],
)
def test_broken_obstacles_are_caught(changes: dict[str, Any], complaint: str) -> None:
    check_obstacle(Floor(), MESH)
    with pytest.raises(CheckFailed, match=complaint):
        check_obstacle(replace(Floor(), **changes), MESH)


@dataclass(frozen=True)
class Own:
    """A shape whose outline is given by a function."""

    of_outline: Callable[[], Any]

    def outline(self) -> Any:
        return self.of_outline()


class Uneven(Arc):
    """An arc whose parameter is not proportional to its length."""

    is_analytic = False

    def point(self, s: np.ndarray) -> np.ndarray:
        return super().point(0.5 * (s + s**2))

    def derivative(self, s: np.ndarray) -> np.ndarray:
        return super().derivative(0.5 * (s + s**2)) * (0.5 + s)[:, None]


class Wrong(Arc):
    """An arc with a derivative that is too long."""

    def derivative(self, s: np.ndarray) -> np.ndarray:
        return 1.001 * super().derivative(s)


def circle(kind: type[Arc] = Arc, end: float = 2.0 * np.pi) -> Outline:
    half = (Side("first", kind((0.0, 0.0), 1.0, 0.0, np.pi)), Side("second", Arc((0.0, 0.0), 1.0, np.pi, end)))
    return Outline((half,))


def plain_circle() -> Outline:
    return circle()


def wandering_circle() -> Outline:
    return bk.Disk(float(np.random.default_rng().uniform(1.0, 2.0))).outline()


@pytest.mark.parametrize(
    ("outline", "complaint"),
    [
        (lambda: 3, "Own.outline fails: .*outline returned a int: return a bemkit.geometry.outline.Outline"),
        (lambda: circle(end=6.0), "Own.outline fails: .*make every side start where the one before it ends"),
        (wandering_circle, r"Own.outline has side 'arc-1' [\d.]+ away the next"),
    ],
)
def test_broken_shapes_are_caught(outline: Callable[[], Any], complaint: str) -> None:
    check_shape(Own(plain_circle))
    with pytest.raises(CheckFailed, match=complaint):
        check_shape(Own(outline))


def uneven_circle() -> Outline:
    return circle(Uneven)


def wrong_circle() -> Outline:
    return circle(Wrong)


@pytest.mark.parametrize(
    ("outline", "complaint"),
    [(uneven_circle, "side 'first': the speed varies by 0.6"), (wrong_circle, "side 'first': Wrong.derivative is")],
)
def test_broken_sides_are_caught(outline: Callable[[], Outline], complaint: str) -> None:
    with pytest.raises(CheckFailed, match=complaint):
        check_shape(Own(outline))


def test_clockwise_boundaries_are_refused_before_the_check() -> None:
    with pytest.raises(GeometryError, match="clockwise"):
        Outline(
            (
                tuple(
                    reversed(
                        [Side("a", Arc((0.0, 0.0), 1.0, np.pi, 0.0)), Side("b", Arc((0.0, 0.0), 1.0, 0.0, -np.pi))]
                    )
                ),
            )
        )


def test_a_shape_without_outline_is_refused_before_the_run() -> None:
    with pytest.raises(bk.InputError, match=r"shape is .*, which has no method outline\(\): give one as"):
        replace(bk.load_scene("paper-1"), shape=object())


def test_a_shape_that_returns_no_outline_is_refused_before_the_run() -> None:
    with pytest.raises(bk.InputError, match=r"Own.outline returned a int: return a bemkit.geometry.outline.Outline"):
        _ = replace(bk.load_scene("paper-1"), shape=Own(lambda: 3)).only


@dataclass(frozen=True)
class WithArguments:
    """A shape whose outline takes an argument."""

    def outline(self, scale: float) -> Outline:
        return bk.Rectangle(scale, scale).outline()


def test_a_shape_whose_outline_takes_arguments_is_refused_before_the_run() -> None:
    message = r"WithArguments.outline cannot be called \(.*'scale'\): define outline\(self\), which returns a bemkit"
    scene, shape = bk.load_scene("paper-1"), WithArguments()
    with pytest.raises(bk.InputError, match=message):
        replace(scene, shape=shape)  # type: ignore[arg-type]
    two = bk.load_scene("two-cylinders")
    with pytest.raises(bk.InputError, match=message):
        replace(two, bodies=tuple(replace(body, shape=shape) for body in two.bodies))  # type: ignore[arg-type]


def test_a_single_point_has_a_distance() -> None:
    """Newton's steps are limited by the spread of points, which a single one does not have."""
    distance = bk.SignedDistance(bk.Expression("sqrt(x**2 + (y + 1)**2) - 0.5"))
    gap = distance.gap(np.array([[0.0, 0.6]]), np.array([[0.0, -1.0]]))
    np.testing.assert_allclose(gap, 1.1, rtol=1e-7)  # slopes by differences
