"""Every obstacle whose outline is known is drawn where it stands, of one body and of several."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.figure import Figure
from matplotlib.patches import Patch
from matplotlib.path import Path

import bemkit as bk
from bemkit.pictures import draw_deformation
from bemkit.pictures.obstacles import draw_obstacles, draw_rigid_bodies, outline_of
from bemkit.pictures.shown import DrawnScene, shown
from bemkit.results.part_forces import RigidResult

FRAME = np.array([[-3.0, 3.0], [-2.0, 2.0]])
ROUND = tuple((float(np.cos(angle)), float(np.sin(angle))) for angle in np.linspace(0.0, 2.0 * np.pi, 64)[:-1])
OUTLINES = [
    (bk.RigidHalfPlane((0.0, -0.5), (0.1, 1.0)), 1e-12),
    (bk.RigidCircle((0.2, 0.3), 1.0), 1e-12),
    (bk.RigidCavity((0.2, 0.3), 1.5), 1e-12),
    (bk.RigidPolygon(((0.0, 0.0), (1.0, 0.0), (0.0, 1.0))), 1e-12),
    (bk.RigidSpline(ROUND), 1e-12),
    (bk.RigidSpline(((2.0, 0.0), (1.0, 0.3), (-1.0, 0.3), (-2.0, 0.0)), is_closed=False), 1e-12),
    (bk.SignedDistance(bk.Expression("x**2 / 4 + y**2 - 1")), 1e-3),  # found on a grid
]
"""With the accuracy of their outlines."""


def block(obstacle: bk.Obstacle) -> bk.Scene:
    """A square that may touch an obstacle at its lower side."""
    return bk.Scene(
        title="block",
        shape=bk.Rectangle(1.0, 1.0),
        material=bk.Material(1.0, 0.3),
        parts=(
            bk.Part("top", bk.PrescribedDisplacement(y=-0.01), ("top",)),
            bk.Part("left", bk.Roller(), ("left",)),
            bk.Part("bottom", bk.Contact(obstacle), ("bottom",)),
        ),
        mesh=bk.MeshOptions(elements=40),
        discretisation=bk.Galerkin(2),
    )


def with_rigid(body: bk.RigidBody, result: RigidResult) -> DrawnScene:
    """A picture of a block and a rigid body."""
    return replace(shown(block(bk.RigidHalfPlane())), rigid=((body, result),))


@pytest.mark.parametrize(("obstacle", "accuracy"), OUTLINES)
def test_outlines_lie_on_the_surface(obstacle: bk.Obstacle, accuracy: float) -> None:
    (loop,) = outline_of(obstacle, FRAME)
    inside = loop[(np.abs(loop) <= 1.05 * FRAME[:, 1]).all(axis=1)] if len(loop) > 4 else loop[:2]
    assert len(inside) >= 2
    np.testing.assert_allclose(obstacle.gap(inside, np.zeros_like(inside)), 0.0, atol=accuracy)


def test_a_small_part_of_a_large_circle_is_round() -> None:
    (loop,) = outline_of(bk.RigidCircle((0.0, 1000.0), 1000.0), np.array([[-0.5, 0.5], [-0.5, 0.5]]))
    near = loop[np.abs(loop[:, 0]) < 0.5]
    assert np.ptp(near[:, 1]) > 0.0
    assert np.hypot(*np.diff(loop, axis=0).T).min() > 0.0
    assert np.diff(np.sort(near[:, 0])).max() < 0.02


@pytest.mark.parametrize("obstacle", [bk.Gap(0.1), bk.SignedDistance(bk.Expression("y - sqrt(x)"))])
def test_what_has_no_outline_in_the_frame_is_told(obstacle: bk.Obstacle) -> None:
    assert outline_of(obstacle, FRAME) == []


def test_obstacles_known_by_their_gap_are_drawn_where_they_face_the_body() -> None:
    """A slope below a block that is in sight of half of its side."""
    gap = bk.Gap(bk.Expression("where(x < 0.5, 0.1 * x, 100)"), direction=(0.0, -1.0))
    axes = Figure().add_subplot()
    draw_obstacles(axes, shown(block(gap)))
    (band,) = axes.patches
    surface = axes.lines[0].get_xydata()
    np.testing.assert_allclose(surface[:, 1], -0.1 * surface[:, 0], atol=1e-12)
    assert surface[:, 0].max() < 0.5
    assert surface[:, 0].min() == 0.0
    assert band.get_path().contains_point((0.2, -0.03))
    assert not band.get_path().contains_point((0.2, -0.01))


@pytest.mark.parametrize("obstacle", [obstacle for obstacle, _ in OUTLINES])
def test_obstacles_are_drawn_and_filled_on_their_side(obstacle: bk.Obstacle) -> None:
    axes = Figure().add_subplot()
    axes.set_xlim(*FRAME[0])
    axes.set_ylim(*FRAME[1])
    draw_obstacles(axes, shown(block(obstacle)))
    (first,) = axes.patches
    assert first.get_label() == "obstacle"
    assert (axes.get_xlim(), axes.get_ylim()) == ((-3.0, 3.0), (-2.0, 2.0))
    points = np.random.default_rng(0).uniform(-1.9, 1.9, (300, 2))
    gap = obstacle.gap(points, np.zeros_like(points))
    is_clear = np.abs(gap) > 2e-3
    np.testing.assert_array_equal(is_filled(first, points[is_clear]), gap[is_clear] < 0.0)


def is_filled(patch: Patch, points: np.ndarray) -> np.ndarray:
    """Whether points are painted: by the rule of matplotlib, which counts turns, loops of opposite sense are holes."""
    assert patch.get_fill()
    turns = np.zeros(len(points), int)
    for loop in patch.get_path().to_polygons():
        area = np.sum(loop[:-1, 0] * np.diff(loop[:, 1]) - loop[:-1, 1] * np.diff(loop[:, 0]))
        turns += int(np.sign(area)) * Path(loop).contains_points(points)
    return turns != 0


def test_hatching_stays_close_to_the_surface() -> None:
    axes = Figure().add_subplot()
    axes.set_xlim(*FRAME[0])
    axes.set_ylim(*FRAME[1])
    draw_obstacles(axes, shown(block(bk.RigidHalfPlane((0.0, -0.5)))))
    (hatching,) = (each for each in axes.collections if each.get_hatch())
    (path,) = hatching.get_paths()
    assert path.contains_point((0.3, -0.6))
    assert not path.contains_point((0.3, -1.5))
    assert hatching.get_clip_path() is not None  # and off the body


@pytest.mark.slow
def test_a_clockwise_spline_fills_its_outside() -> None:
    axes = Figure().add_subplot()
    draw_obstacles(axes, shown(block(bk.RigidSpline(ROUND[::-1]))))
    np.testing.assert_array_equal(is_filled(axes.patches[0], np.array([[0.2, 0.3], [0.0, 1.2]])), [False, True])


def test_a_rigid_body_that_is_a_cavity_fills_its_outside_where_it_has_moved_to() -> None:
    axes = Figure().add_subplot()
    body = bk.RigidBody(name="bearing", obstacle=bk.RigidCavity((0.5, 0.5), 2.0))
    draw_rigid_bodies(axes, with_rigid(body, RigidResult("bearing", 0.0, 0.0, 0.0, 0.1, 0.0, 0.0)), 10.0)
    filled = is_filled(axes.patches[1], np.array([[-1.0, 0.5], [3.0, 0.5], [3.7, 0.5]]))
    np.testing.assert_array_equal(filled, [True, False, True])


def test_rigid_bodies_are_drawn_before_and_after_and_widen_the_frame() -> None:
    axes = Figure().add_subplot()
    axes.set_xlim(0.0, 1.0)
    axes.set_ylim(0.0, 1.0)
    body = bk.RigidBody(name="disc", obstacle=bk.RigidCircle((0.5, 1.2), 0.2), centre=(0.5, 1.2))
    result = RigidResult("disc", 0.0, 0.0, 0.0, 0.01, -0.02, 0.0)
    draw_rigid_bodies(axes, with_rigid(body, result), 10.0)
    before, after = (patch.get_path().vertices for patch in axes.patches)
    np.testing.assert_allclose(after - before, np.broadcast_to([0.1, -0.2], after.shape), atol=1e-12)
    assert axes.get_xlim() == (0.0, 1.0)
    assert axes.get_ylim() == pytest.approx((0.0, 1.4), rel=1e-3)
    draw_rigid_bodies(axes, with_rigid(replace(body, obstacle=bk.RigidHalfPlane((0.0, 3.0))), result), 10.0)
    assert axes.get_ylim() == pytest.approx((0.0, 1.4), rel=1e-3)


def test_a_turn_is_drawn_about_the_centre() -> None:
    axes = Figure().add_subplot()
    body = bk.RigidBody(name="bar", obstacle=bk.RigidPolygon(((0.0, 0.0), (2.0, 0.0), (2.0, 0.1))))
    draw_rigid_bodies(axes, with_rigid(body, RigidResult("bar", 0.0, 0.0, 0.0, 0.0, 0.0, 0.01)), 5.0)
    np.testing.assert_allclose(axes.patches[1].get_path().vertices[1], [2.0, 0.1], atol=1e-12)


@pytest.mark.parametrize(
    "obstacle",
    [
        pytest.param(bk.RigidSpline(tuple((0.5 + x, y - 1.0) for x, y in ROUND)), marks=pytest.mark.slow),
        bk.SignedDistance(bk.Expression("hypot(x - 0.5, y + 1) - 1")),
        pytest.param(bk.RigidPolygon(tuple((0.5 + x, y - 1.0) for x, y in ROUND)), marks=pytest.mark.slow),
    ],
)
def test_scenes_of_one_body_take_and_draw_them(obstacle: bk.Obstacle) -> None:
    """Instead of a circle, whose force they have to their accuracy."""

    solution = bk.run(block(obstacle))
    assert solution.is_converged
    # 63 corners reach within 1.2e-3 of the circle, an eighth of the motion
    accuracy = 0.2 if isinstance(obstacle, bk.RigidPolygon) else 1e-4
    assert solution.force_normal == pytest.approx(
        bk.run(block(bk.RigidCircle((0.5, -1.0), 1.0))).force_normal, rel=accuracy
    )
    axes = draw_deformation(solution)
    assert "obstacle" in [text.get_text() for text in axes.get_legend().get_texts()]
