import pickle
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bemkit.errors import GeometryError
from bemkit.geometry.meshing.discretise import discretise
from bemkit.geometry.outline import Selection
from bemkit.geometry.shapes import Disk, ExteriorOf, PlateWithHole, Polygon, Rectangle, Ring, Sector, Shape

from .strategies import angles, polygon_area, rotation, sizes, star_polygons

SHAPES = {
    "rectangle": (Rectangle(2.0, 0.5, (1.0, -1.0)), 1.0, 5.0),
    "polygon": (Polygon(((0, 0), (2, 0), (1, 1), (1, 3))), 2.0, 2 + np.sqrt(2) + 2 + np.sqrt(10)),
    "disk": (Disk(2.0, (3.0, 0.0)), 4 * np.pi, 4 * np.pi),
    "sector": (Sector(2.0, -90.0, 30.0, (1.0, 0.0)), 4 * np.pi / 3, 4 * np.pi / 3 + 4.0),
    "ring": (Ring(1.0, 2.0), 3 * np.pi, 6 * np.pi),
    "plate": (PlateWithHole(2.0, 1.0, 0.25), 2.0 - np.pi / 16, 6.0 + np.pi / 2),
    "exterior": (ExteriorOf(Disk(0.5)), np.inf, np.pi),
}


@pytest.mark.parametrize(("shape", "area", "perimeter"), SHAPES.values(), ids=SHAPES)
@pytest.mark.parametrize("n_elements", [8, 41])
def test_area_and_perimeter(shape: Shape, area: float, perimeter: float, n_elements: int) -> None:
    mesh = discretise(shape.outline(), n_elements=n_elements)
    # curved elements are exact: only quadrature of smooth functions and round-off remain
    assert mesh.area == pytest.approx(area, rel=1e-13)
    assert mesh.lengths.sum() == pytest.approx(perimeter, rel=1e-13)


@pytest.mark.parametrize(
    ("shape", "names"),
    [
        (Rectangle(1, 1), "bottom right top left"),
        (Polygon(((0, 0), (1, 0), (0, 1))), "side-1 side-2 side-3"),
        (Polygon(((0, 0), (1, 0), (0, 1)), ("a", "b", "c")), "a b c"),
        (Disk(1), "arc-1 arc-2 arc-3 arc-4"),
        (Sector(1, 0, 300), "arc end start"),
        (Ring(1, 2), "outer-1 outer-2 outer-3 outer-4 inner-4 inner-3 inner-2 inner-1"),
        (PlateWithHole(4, 4, 1), "bottom right top left hole-4 hole-3 hole-2 hole-1"),
        (ExteriorOf(Rectangle(1, 1)), "left top right bottom"),
    ],
)
def test_side_names(shape: Shape, names: str) -> None:
    assert shape.outline().side_names == tuple(names.split())


@pytest.mark.parametrize("name", SHAPES)
def test_outlines_are_made_and_checked_once(name: str) -> None:
    shape = SHAPES[name][0]
    assert shape.outline() is shape.outline()
    assert pickle.loads(pickle.dumps(shape)) == shape
    other = replace(shape)  # a shape of its own, equal
    assert other == shape
    assert other.outline() is not shape.outline()


@pytest.mark.parametrize(
    "shape", [Disk(1.0), Ring(0.5, 1.0), PlateWithHole(4, 4, 1, (-2.0, -2.0)), ExteriorOf(Disk(1))]
)
def test_arcs_are_numbered_by_quadrant(shape: Shape) -> None:
    for side in shape.outline().sides:
        if not side.curve.is_straight:
            x, y = side.curve.point(np.array([0.5]))[0]
            quadrant = int(side.name[-1])
            assert (x > 0.0, y > 0.0) == (quadrant in (1, 4), quadrant in (1, 2))


def test_rectangle_starts_at_its_corner() -> None:
    outline = Rectangle(2.0, 1.0, (5.0, 6.0)).outline()
    assert outline.corners[0].tolist() == [[5, 6], [7, 6], [7, 7], [5, 7]]


@given(star_polygons(), sizes, angles, st.floats(-1e6, 1e6), st.floats(-1e6, 1e6))
def test_polygon_is_accepted_at_any_size_place_and_direction(vertices, size, angle, x, y) -> None:
    moved = size * (vertices @ rotation(angle).T + [x, y])
    polygon = Polygon(tuple(map(tuple, moved.tolist())))
    mesh = discretise(polygon.outline(), n_elements=3 * len(vertices))
    # coordinates 1e6 times the size of the body have 1e-10 of it as their last digit
    assert mesh.area == pytest.approx(size**2 * polygon_area(vertices), rel=0.0, abs=1e-9 * size**2)


@given(star_polygons(), sizes, angles)
def test_polygon_that_is_none_is_refused(vertices, size, angle) -> None:
    turned = size * vertices @ rotation(angle).T
    clockwise = tuple(map(tuple, turned[::-1].tolist()))
    with pytest.raises(GeometryError, match=r"Polygon: vertices run clockwise: list the vertices anticlockwise"):
        Polygon(clockwise)
    repeated = np.insert(turned, 1, turned[0], axis=0)
    with pytest.raises(GeometryError, match=r"repeats the point .* \(vertex 2\): remove one"):
        Polygon(tuple(map(tuple, repeated.tolist())))
    # a spike out of a vertex and back folds back, whatever the digits
    spike = np.insert(turned, 1, [2.0 * turned[0], turned[0]], axis=0)
    with pytest.raises(GeometryError, match=r"cross, touch or fold back"):
        Polygon(tuple(map(tuple, spike.tolist())))


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Rectangle(0.0, 1.0), r"Rectangle: width is 0.0: give a positive finite length"),
        (lambda: Rectangle(1.0, np.inf), r"Rectangle: height is inf: give a positive"),
        (lambda: Rectangle(1.0, 1.0, (np.nan, 0.0)), r"Rectangle: corner is .*nan.*: give two finite numbers"),
        (lambda: Polygon(((0, 0), (1, 0))), r"Polygon: vertices has 2 points: give at least three"),
        (lambda: Polygon(((0, 0), (1, 0), (1, "a"))), r"Polygon: vertex 3 is \(1, 'a'\): give two finite numbers"),
        (lambda: Polygon(((0, 0), (1, 0), (0, 1)), ("a",)), r"side_names has 1 names for 3 sides: name every side"),
        (lambda: Polygon(((0, 0), (1, 1), (1, 0), (0, 1))), r"side 'side-1' and side 'side-3' cross, touch"),
        (lambda: Polygon(((0, 0), (0, 1), (1, 1), (1, 0))), r"vertices run clockwise: list the vertices anticlockwise"),
        (lambda: Disk(-1.0), r"Disk: radius is -1.0"),
        (lambda: Disk(1.0, (0.0,)), r"Disk: centre is \(0.0,\): give two finite numbers"),
        (lambda: Sector(0.0, 0.0, 90.0), r"Sector: radius is 0.0: give a positive"),
        (lambda: Sector(1.0, 90.0, 0.0), r"from 90.0 to 0.0 degrees: end less than 360 degrees after the start"),
        (lambda: Sector(1.0, 0.0, 360.0), r"from 0.0 to 360.0 degrees: end less than 360"),
        (lambda: Ring(2.0, 1.0), r"Ring: inner_radius is 2.0, not less than outer_radius, 1.0: give the smaller"),
        (lambda: Ring(0.0, 1.0), r"Ring: inner_radius is 0.0: give a positive"),
        (lambda: Ring(1.0, 2.0, (0.0, np.inf)), r"Ring: centre is"),
        (lambda: PlateWithHole(1.0, 2.0, 0.5), r"radius is 0.5, but the plate is 1.0 by 2.0: give a radius less than"),
        (lambda: PlateWithHole(1.0, 2.0, 0.0), r"PlateWithHole: radius is 0.0"),
        (lambda: PlateWithHole(1.0, 2.0, 0.1, (0.0, np.nan)), r"PlateWithHole: corner is"),
        (
            lambda: ExteriorOf(ExteriorOf(Disk(1.0))),
            r"ExteriorOf: shape is already an exterior: give the bounded shape",
        ),
        (lambda: ExteriorOf(Ring(1.0, 2.0)), r"ExteriorOf: shape has 1 hole\(s\), .*: give a shape without holes"),
    ],
)
def test_refused(make, message: str) -> None:
    with pytest.raises(GeometryError, match=message):
        make()


@pytest.mark.parametrize(
    ("shape", "group", "radius"),
    [
        (Disk(2.0), "arc", 2.0),
        (Ring(1.0, 2.0), "inner", 1.0),
        (Ring(1.0, 2.0), "outer", 2.0),
        (PlateWithHole(6.0, 6.0, 0.5, corner=(-3.0, -3.0)), "hole", 0.5),
        (ExteriorOf(Disk(2.0)), "arc", 2.0),
    ],
)
def test_the_arcs_of_a_circle_are_a_group(shape, group: str, radius: float) -> None:
    chosen = Selection((group,))
    sides = [side for side in shape.outline().sides if chosen.names(side.name, side.group)]
    assert {side.name for side in sides} == {f"{group}-{k}" for k in range(1, 5)}
    points = np.concatenate([side.curve.point(np.linspace(0.0, 1.0, 5)) for side in sides])
    assert np.allclose(np.hypot(*points.T), radius, rtol=1e-14)  # cos and sin are rounded
