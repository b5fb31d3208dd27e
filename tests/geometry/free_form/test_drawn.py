"""Outlines drawn side by side, against circles, ellipses and polynomials in closed form."""

from __future__ import annotations

import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.curves import Arc, Curve, reverse_curve
from bemkit.geometry.free_form.drawn import ArcTo, DrawnSide, LineTo, Loop, NurbsTo, OutlineShape, SplineTo
from bemkit.geometry.free_form.nurbs import Nurbs, clamped_knots, conic_arc
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Drawing, Selection
from bemkit.geometry.shapes import ExteriorOf, Rectangle
from bemkit.testing.spaces import check_curve

SQUARE = (LineTo((1.0, 0.0), "bottom"), LineTo((1.0, 1.0)), LineTo((0.0, 1.0)), LineTo((0.0, 0.0), "left"))
S = np.linspace(0.0, 1.0, 9)


@pytest.mark.parametrize("sweep", [1e-4, 0.02, 0.5, 3.0, np.pi, 4.0, 6.0])
@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_arc_through_three_points(sweep: float, sense: float) -> None:
    centre, radius, start = np.array([0.3, -0.2]), max(1.0, 1.0 / sweep), 0.7

    def place(fraction: float) -> tuple[float, float]:
        angle = start + sense * sweep * fraction
        return (centre[0] + radius * np.cos(angle), centre[1] + radius * np.sin(angle))

    curve = ArcTo(place(1.0), place(0.4)).curve(place(0.0))
    # three points of a flat arc know its middle to their round-off over their height
    assert np.abs(curve.point(S) - [place(s) for s in S]).max() < 1e-15 * radius * max(10.0, 10.0 / sweep)
    check_curve(curve)


def test_whole_circle() -> None:
    curve = ArcTo((2.0, 0.0), (0.0, 0.0)).curve((2.0, 0.0))
    assert isinstance(curve, Arc)
    assert (curve.centre, curve.radius, curve.end_angle - curve.start_angle) == ((1.0, 0.0), 1.0, 2.0 * np.pi)


def test_quarter_of_an_ellipse_is_exact() -> None:
    curve = conic_arc(np.zeros(2), np.array([2.0, 1.0]), np.array([-0.5, 1.0]), 0.0, np.pi / 2).curve()
    along = np.linalg.solve(np.array([[2.0, -0.5], [1.0, 1.0]]), curve.point(S).T)
    assert np.abs((along**2).sum(axis=0) - 1.0).max() < 1e-15 * 4
    check_curve(curve)


def test_bezier_curve_follows_its_polynomial() -> None:
    points = np.array([[0.0, 0.0], [0.0, 1.0], [2.0, 1.0], [1.0, 0.0]])
    curve = Nurbs(points, 3, clamped_knots(4, 3), np.ones(4))
    t = S[:, None]
    exact = (
        (1 - t) ** 3 * points[0] + 3 * t * (1 - t) ** 2 * points[1] + 3 * t**2 * (1 - t) * points[2] + t**3 * points[3]
    )
    assert np.abs(curve.point(S) - exact).max() < 1e-15
    assert curve.curve().is_analytic
    check_curve(curve.curve())


def test_curve_that_stands_still_at_its_end_has_a_tangent_there() -> None:
    curve = NurbsTo((1.0, 1.0), ((0.0, 0.0), (1.0, 0.0))).curve((0.0, 0.0))
    tangent = curve.derivative(np.array([0.0]))[0]
    # x = 3 t^2 - 2 t^3, y = t^3: the tangent starts along x, and is taken 1e-7 after it
    assert abs(tangent[1]) < 1e-6 * tangent[0]


def test_spline_passes_through_its_points_and_is_not_analytic() -> None:
    angles = np.linspace(0.0, np.pi, 33)
    points = [(float(x), float(y)) for x, y in zip(np.cos(angles), np.sin(angles), strict=True)]
    curve = SplineTo(points[-1], tuple(points[1:-1])).curve(points[0])
    assert not reverse_curve(curve).is_analytic
    # the error of a cubic spline: (pi / 32)^4 / 384 of the fourth derivative, and more at its ends
    assert np.abs(np.hypot(*curve.point(S).T) - 1.0).max() < 3e-6
    assert np.abs(curve.point(S[::4]) - [points[0], points[16], points[-1]]).max() < 1e-12


def test_closed_spline_is_smooth_where_it_closes() -> None:
    angles = np.linspace(0.0, 2.0 * np.pi, 25)[:-1]
    points = [(float(x), float(y)) for x, y in zip(np.cos(angles), np.sin(angles), strict=True)]
    curve = SplineTo(points[0], tuple(points[1:])).curve(points[0])
    first, last = curve.derivative(np.array([0.0, 1.0]))
    assert np.abs(first - last).max() < 1e-12
    area = discretise(
        OutlineShape((Loop(points[0], (SplineTo(points[0], tuple(points[1:])),)),)).outline(), n_elements=60
    ).area
    assert area == pytest.approx(np.pi, rel=2e-5)  # (2 pi / 24)^4 / 384


def test_loops_may_run_in_either_sense() -> None:
    circle = Loop((0.3, 0.5), (ArcTo((0.3, 0.5), (0.7, 0.5), "hole"),))
    reversed_square = Loop((0.0, 0.0), (LineTo((0.0, 1.0)), LineTo((1.0, 1.0)), LineTo((1.0, 0.0)), LineTo((0.0, 0.0))))
    for outer in (Loop((0.0, 0.0), SQUARE), reversed_square):
        for loops in ((outer, circle), (circle, outer)):
            areas = discretise(OutlineShape(loops).outline(), n_elements=40).loop_areas
            assert sorted(areas) == pytest.approx([-0.04 * np.pi, 1.0], rel=1e-12)


def test_names_and_groups_choose_sides() -> None:
    sides = (*SQUARE[:1], LineTo((1.0, 1.0), group="wall"), LineTo((0.0, 1.0)), LineTo((0.0, 0.0), "left", "wall"))
    outline = OutlineShape((Loop((0.0, 0.0), sides),)).outline()
    assert outline.side_names == ("bottom", "side-2", "side-3", "left")
    assert outline.selectable_names == ("wall", "bottom", "side-2", "side-3", "left")
    parts = {"held": Selection(("wall",)), "top": Selection(("side-3",))}
    mesh = discretise(outline, n_elements=40, parts=parts, density={"wall": 2.0})
    assert {name: len(mesh.part(name)) for name in mesh.parts} == {"held": 26, "top": 7}
    assert set(mesh.centres[mesh.part("held"), 0]) == {0.0, 1.0}


def test_exterior_of_a_drawn_outline() -> None:
    shape = OutlineShape((Loop((0.0, 0.0), SQUARE),), ("as read",))
    exterior = ExteriorOf(shape)
    assert exterior.outline().is_exterior
    assert exterior.outline().drawing == Drawing(("as read",), "")
    assert Rectangle(1.0, 1.0).outline().drawing is None


def curve_of(side: DrawnSide) -> Curve:
    return side.curve((0.0, 0.0))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (
            lambda: curve_of(ArcTo((2.0, 0.0), (1.0, 0.0))),
            r"arc from \(0, 0\) through \(1, 0\) to \(2, 0\) is straight: write",
        ),
        (lambda: curve_of(SplineTo((1.0, 0.0), ())), r"spline through 0 points: give more, or write a line"),
        (
            lambda: curve_of(SplineTo((1.0, 0.0), ((0.5, 0.1), (0.5, 0.1)))),
            r"the point \(0.5, 0.1\) comes twice in a row",
        ),
        (
            lambda: curve_of(NurbsTo((1.0, 0.0), ((0.5, 1.0),), degree=3)),
            r"degree is 3 with 3 control points: give one from 1",
        ),
        (
            lambda: curve_of(NurbsTo((1.0, 0.0), ((0.5, 1.0),), weights=(1.0, 0.0, 1.0))),
            r"weights are .*positive numbers",
        ),
        (
            lambda: curve_of(NurbsTo((1.0, 0.0), ((0.5, 1.0),), knots=(0.0, 1.0))),
            r"knots has 2 numbers for 3 control points",
        ),
        (
            lambda: curve_of(NurbsTo((1.0, 0.0), ((0.5, 1.0),), degree=1, knots=(0.0, 0.0, 0.5, 1.0, 1.0))),
            r"do not make a smooth curve from the first control point",
        ),
        (lambda: OutlineShape((Loop((0.0, 0.0), ()),)), r"a loop without sides bounds no body"),
        (
            lambda: OutlineShape((Loop((0.0, 0.0), (LineTo((1.0, 0.0)), ArcTo((2.0, 0.0), (1.5, 0.0)))),)).outline(),
            r"outline: side 'side-2': arc from .* is straight",
        ),
        (
            lambda: OutlineShape((Loop((0.0, 0.0), (*SQUARE[:3], LineTo((0.0, 0.0), "last", "bottom"))),)).outline(),
            r"'bottom' names a side and a group of sides with 'last': rename one of them",
        ),
        (
            lambda: OutlineShape((Loop((0.0, 0.0), SQUARE[:3]),)).outline(),
            r"side 'side-3' ends at \(0, 1\), but side 'bottom' starts at \(0, 0\)",
        ),
        (
            lambda: OutlineShape(
                (Loop((0.0, 0.0), (LineTo((1.0, 1.0)), LineTo((1.0, 0.0)), LineTo((0.0, 1.0)), LineTo((0.0, 0.0)))),)
            ).outline(),
            r"cross, touch or fold back",
        ),
    ],
)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()
