"""DXF and SVG drawings: exact curves, gaps, names, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from bemkit.errors import GeometryError
from bemkit.geometry.files.shape_file import DrawingFile
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, NurbsTo, OutlineShape
from bemkit.geometry.meshing.discretise import discretise

from .parts import AREA, PART_DXF, PART_SVG, dxf, line, needs_ezdxf, needs_svgpathtools

FRAME = (line("0", 0, 0, 9, 0), line("0", 9, 0, 9, 9), line("0", 9, 9, 0, 9), line("0", 0, 9, 0, 0))
WEIGHTLESS = (
    "SPLINE 100 AcDbEntity 8 0 100 AcDbSpline 70 4 71 1 72 4 73 2 40 0 40 0 40 1 40 1 41 0 41 1 "
    "10 0 20 0 30 0 10 1 20 0 30 0"
)
ONE_POINT = "SPLINE 100 AcDbEntity 8 0 100 AcDbSpline 70 8 71 3 72 2 73 1 74 0 40 0 40 1 10 0 20 0 30 0"


def read(folder: Path, name: str, text: str, **options) -> OutlineShape:
    (folder / name).write_text(text)
    return DrawingFile(str(folder / name), **options).shape


def areas(shape: OutlineShape) -> list[float]:
    return discretise(shape.outline(), n_elements=200).loop_areas.tolist()


def names(shape: OutlineShape) -> list[str]:
    return [side.name for loop in shape.loops for side in loop.sides]


@needs_ezdxf
def test_dxf_of_the_part(tmp_path) -> None:
    shape = read(tmp_path, "part.dxf", dxf(*PART_DXF, unit=4))
    assert sum(areas(shape)) == pytest.approx(AREA, rel=1e-13)
    holes = [f"HOLE-{k}" for k in range(1, 5)]
    assert names(shape) == ["FOOT", "WALL-1", "BODY-1", "BODY-2", "WALL-2", *holes]
    assert (shape.unit, shape.notes) == ("mm", ("skipped, because no lines: 1 TEXT",))


@needs_ezdxf
def test_gaps_within_the_tolerance_are_closed_and_said(tmp_path) -> None:
    ends = (line("0", 0, 0, 1, 0), line("0", 1, 0.001, 1, 1), line("0", 1, 1, 0, 0))
    with pytest.raises(
        GeometryError,
        match=r"gap.dxf: the outline is open: a line ends at \(1, 0\), and the nearest loose end is 0.001 away at "
        r"\(1, 0.001\) \(2 ends are loose\): close the gaps, or give a tolerance above 1e-05",
    ):
        read(tmp_path, "gap.dxf", dxf(*ends))
    shape = read(tmp_path, "gap.dxf", dxf(*ends), tolerance=0.002)
    assert shape.notes == ("closed: 1 gap between ends of lines, of up to 0.001",)
    assert shape.loops[0].sides[0].to == (1.0, 0.0005)


@needs_ezdxf
def test_open_lines_name_their_layer_and_the_layers_that_close(tmp_path) -> None:
    square = [(0, 0, 1, 0), (1, 0, 1, 1), (1, 1, 0, 1), (0, 1, 0, 0)]
    outline = [line("PLATE", *ends) for ends in square]
    with pytest.raises(
        GeometryError,
        match=r"a line of 'AXIS' ends at .* \(2 ends are loose\): without the lines of 'AXIS' the outline is "
        r"closed: write only = \['PLATE'\], or --only PLATE",
    ):
        read(tmp_path, "axis.dxf", dxf(*outline, line("AXIS", -1, 0.5, 2, 0.5)))
    with pytest.raises(
        GeometryError, match=r"3 lines of 'PLATE', 'RIB' meet at \(0, 0\).*: without the lines of 'RIB'"
    ):
        read(tmp_path, "rib.dxf", dxf(*outline, line("RIB", 0, 0, 1, 1)))
    shape = read(tmp_path, "rib.dxf", dxf(*outline, line("RIB", 0, 0, 1, 1)), only=("PLATE",))
    assert areas(shape) == [1.0]
    with pytest.raises(GeometryError, match=r"3 lines meet at .* remove lines inside the body"):
        read(tmp_path, "one.dxf", dxf(*(line("0", *ends) for ends in [*square, (0, 0, 1, 1)])))


@needs_ezdxf
def test_lines_drawn_twice_and_specks_are_left_out(tmp_path) -> None:
    twice = (*FRAME, line("0", 9, 9, 9, 0), line("0", 5, 5, 5.00001, 5), "CIRCLE 8 0 10 4 20 4 40 1")
    shape = read(tmp_path, "twice.dxf", dxf(*twice))
    assert areas(shape) == pytest.approx([81.0, -math.pi], rel=1e-13)
    assert shape.notes == ("skipped, because shorter than 9e-05: lines, 1", "drawn twice and taken once: lines, 1")


@needs_ezdxf
def test_damaged_entities_are_left_out_and_said(tmp_path) -> None:
    shape = read(tmp_path, "part.dxf", dxf(*FRAME, ONE_POINT))
    assert areas(shape) == [81.0]
    assert shape.notes[0].startswith("damaged, and repaired or skipped: 1 entries, such as: ")


@needs_ezdxf
def test_polyline_with_bulges_and_ellipse(tmp_path) -> None:
    bulge = math.tan(math.pi / 8.0)  # of a quarter of a circle
    entity = "100 AcDbEntity 8 0 100"
    polyline = (
        f"LWPOLYLINE {entity} AcDbPolyline 90 5 70 1 10 0 20 0 10 4 20 0 42 {bulge} 10 5 20 1 10 5 20 3 10 0 20 3"
    )
    ellipse = f"ELLIPSE {entity} AcDbEllipse 10 2 20 1.5 30 0 11 1 21 0.2 31 0 40 0.5 41 0 42 6.283185307179586"
    shape = read(tmp_path, "poly.dxf", dxf(polyline, ellipse))
    kinds = [[type(side) for side in loop.sides] for loop in shape.loops]
    assert kinds == [[LineTo, ArcTo, LineTo, LineTo, LineTo], [NurbsTo] * 4]
    assert areas(shape) == pytest.approx([15.0 - 1.0 + math.pi / 4.0, -math.pi * 0.5 * 1.04], rel=1e-13)


@needs_ezdxf
@pytest.mark.parametrize(("bulge", "kind"), [(0.3, ArcTo), (1e-4, ArcTo), (1e-9, LineTo)])
def test_polylines_old_and_new_are_lines_and_arcs_and_points_drawn_twice_are_one(bulge, kind, tmp_path) -> None:
    import ezdxf

    corners = [(100, 100, 0), (105, 100, bulge), (105, 103, 0), (105, 103, 0), (100, 103, 0)]
    angle = 4.0 * math.atan(bulge)
    segment = 0.5 * (1.5 / math.sin(0.5 * angle)) ** 2 * (angle - math.sin(angle))
    for add in ("add_lwpolyline", "add_polyline2d"):
        document = ezdxf.new(units=0)
        getattr(document.modelspace(), add)(corners, format="xyb", close=True)
        document.saveas(tmp_path / "corners.dxf")
        shape = DrawingFile(str(tmp_path / "corners.dxf")).shape
        assert [type(side) for side in shape.loops[0].sides] == [LineTo, kind, LineTo, LineTo]
        assert shape.notes == ()
        # an arc about a centre 1e4 away loses four digits
        assert areas(shape) == pytest.approx([15.0 + segment], rel=1e-12)


@needs_ezdxf
def test_closed_spline_without_repeated_knots_is_the_same_curve(tmp_path) -> None:
    from scipy.interpolate import BSpline

    corners = np.array([(2, 1), (3, 1), (3.5, 2), (3, 3), (2, 3), (1.5, 2)], float)
    points, knots = np.vstack([corners, corners[:3]]), np.arange(13.0)
    fields = " ".join([*(f"40 {knot}" for knot in knots), *(f"10 {x} 20 {y} 30 0" for x, y in points)])
    spline = f"SPLINE 100 AcDbEntity 8 0 100 AcDbSpline 70 8 71 3 72 13 73 9 74 0 {fields}"
    shape = read(tmp_path, "spline.dxf", dxf(*FRAME, spline))
    exact = BSpline(knots, points, 3)
    curve = shape.outline().loops[1][0].curve
    seen = curve.point(np.linspace(0.0, 1.0, 2001))
    for place in exact(np.linspace(3.0, 9.0, 23)):
        # as near as the spacing of what is seen: half of it, squared, times the curvature
        assert np.hypot(*(seen - place).T).min() < 0.5 * 6.0 / 2000.0
    t = np.linspace(3.0, 9.0, 20001)
    (x, y), (dx, dy) = exact(t).T, exact(t, 1).T
    assert areas(shape)[1] == pytest.approx(-np.trapezoid(0.5 * (x * dy - y * dx), t), rel=1e-7)


@needs_ezdxf
def test_blocks_are_placed_and_mirrored(tmp_path) -> None:
    import ezdxf

    document = ezdxf.new(units=0)
    block = document.blocks.new("B")
    block.add_lwpolyline([(0, 0, 0), (2, 0, 1), (2, 1, 0), (0, 1, 0)], format="xyb", close=True)
    document.modelspace().add_blockref("B", (5, 5), dxfattribs={"xscale": -2, "yscale": 2, "rotation": 30})
    document.saveas(tmp_path / "block.dxf")
    shape = DrawingFile(str(tmp_path / "block.dxf")).shape
    assert areas(shape) == pytest.approx([4.0 * (2.0 + math.pi / 8.0)], rel=1e-13)


@needs_ezdxf
def test_layers_that_are_off_and_those_that_are_not_chosen_are_left_out(tmp_path) -> None:
    both = dxf(*PART_DXF, line("CUT", 0, 0, 3, 1.5))
    remedy = (
        r"where a boundary has two: without the lines of 'CUT' the outline is closed: write only = \['BODY', 'FOOT'"
    )
    with pytest.raises(GeometryError, match=r"3 lines of 'CUT', 'FOOT', 'WALL' meet at \(0, 0\), " + remedy):
        read(tmp_path, "part.dxf", both)
    shape = read(tmp_path, "part.dxf", both, only=("FOOT", "WALL", "BODY"))
    assert names(shape) == ["FOOT", "WALL-1", "BODY-1", "BODY-2", "WALL-2"]
    with pytest.raises(GeometryError, match=r"only names 'BDY': the layers with lines are BODY, CUT, .*mean 'BODY'"):
        read(tmp_path, "part.dxf", both, only=("BDY",))
    layer = "2 TABLES 0 TABLE 2 LAYER 0 LAYER 2 CUT 70 0 62 -7 0 ENDTAB 0 ENDSEC 0 SECTION 2 ENTITIES"
    off = both.replace("2\nENTITIES", layer.replace(" ", "\n"))
    assert sum(areas(read(tmp_path, "part.dxf", off))) == pytest.approx(AREA, rel=1e-13)


@needs_ezdxf
@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("hello", r"part.dxf: it cannot be read \(.*\): save it as DXF anew"),
        (dxf(), r"part.dxf: it is empty, without lines: draw a closed outline"),
        (dxf("LINE 8 0 10 0 20 0 30 1 11 1 21 0 31 1"), r"a line passes through z = 1: bemkit solves plane problems"),
        (
            dxf(*FRAME, line("0", 20, 0, 21, 0), line("0", 21, 0, 20, 1), line("0", 20, 1, 20, 0)),
            r"is a hole that lies outside",
        ),
        (
            dxf(WEIGHTLESS),
            r"a SPLINE on layer '0' is not a curve",
        ),
    ],
)
def test_drawings_that_bound_no_body(text: str, message: str, tmp_path) -> None:
    with pytest.raises(GeometryError, match=message):
        read(tmp_path, "part.dxf", text)


@needs_svgpathtools
def test_svg_of_the_part(tmp_path) -> None:
    shape = read(tmp_path, "part.svg", PART_SVG, only=("part",))
    assert sum(areas(shape)) == pytest.approx(100.0 * AREA, rel=1e-12)
    assert names(shape) == ["plate-1", "plate-2", "plate-3", "plate-4", "plate-5", "hole-1", "hole-2"]
    assert [type(side) for side in shape.loops[0].sides] == [LineTo, LineTo, ArcTo, LineTo, LineTo]
    assert shape.loops[0].start == pytest.approx((0.0, 0.0), abs=1e-12)
    assert shape.unit == "mm"
    assert read(tmp_path, "part.svg", PART_SVG, only=("part",), scale=0.1).unit == ""
    with pytest.raises(GeometryError, match=r"only names 'plat': the ids and labels are .*did you mean 'plate'"):
        read(tmp_path, "part.svg", PART_SVG, only=("plat",))


@needs_svgpathtools
def test_svg_curves_in_units_of_the_picture(tmp_path) -> None:
    shapes = (
        '<rect x="10" y="10" width="100" height="50" rx="8"/>',
        '<ellipse cx="40" cy="30" rx="12" ry="6" transform="rotate(30 40 30)"/>',
        '<path d="M70 30 C75 20 85 20 90 30 Q80 45 70 30 Z"/>',
    )
    svg = f'<svg xmlns="http://www.w3.org/2000/svg" width="200" height="100">{"".join(shapes)}</svg>'
    shape = read(tmp_path, "round.svg", svg)
    assert shape.unit == ""
    # under the cubic curve 450 (1/6 + 2/30), above the parabola two thirds of 20 by 7.5
    assert areas(shape) == pytest.approx([5000.0 - (4.0 - math.pi) * 64.0, -72.0 * math.pi, -205.0], rel=1e-12)
    assert shape.loops[0].sides[0].to[1] == pytest.approx(40.0)  # y upwards from the lower edge


@needs_svgpathtools
def test_svg_that_is_none(tmp_path) -> None:
    with pytest.raises(GeometryError, match=r"part.svg: it cannot be read \(.*\): save it again as plain SVG"):
        read(tmp_path, "part.svg", "hello")


def test_other_drawings(tmp_path) -> None:
    with pytest.raises(GeometryError, match=r"part.dwg: it is not a drawing that bemkit reads: give .dxf or .svg"):
        read(tmp_path, "part.dwg", "")


def test_missing_packages_say_what_to_install(without, tmp_path) -> None:
    without("ezdxf", "svgpathtools")
    for name, package in (("part.dxf", "ezdxf"), ("part.svg", "svgpathtools")):
        with pytest.raises(GeometryError, match=rf'{name}: {package} is not installed: pip install "bemkit\[cad\]"'):
            read(tmp_path, name, "")
