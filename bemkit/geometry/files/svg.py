"""Outlines from SVG drawings, through svgpathtools."""

from __future__ import annotations

import math
import re
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any
from xml.etree.ElementTree import Element, ParseError

import numpy as np

from bemkit.errors import GeometryError, printable
from bemkit.geometry.files.strokes import Stroke, bezier_stroke, check_only, ellipse_strokes, require_package
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, Point

_LENGTH = re.compile(r"\s*([-+.\deE]+?)\s*(mm|cm|in|pt|pc)\s*$")
_MILLIMETRES = {"mm": 1.0, "cm": 10.0, "in": 25.4, "pt": 25.4 / 72.0, "pc": 25.4 / 6.0}
_LABEL = "{http://www.inkscape.org/namespaces/inkscape}label"


def read_svg(path: Path, only: Sequence[str] = ()) -> tuple[list[Stroke], str]:
    """Read the paths, rectangles, circles, ellipses, lines and polygons of an SVG file.

    Parameters
    ----------
    path : Path
    only : sequence of str
        Ids or labels of the shapes that are the outline, or of groups of them; all if empty.

    Returns
    -------
    strokes : list of Stroke
        With y upwards from the lower edge of the picture. Their groups are the labels or ids of the shapes.
    unit : str
        Millimetres if the picture has a size in a unit of length, else empty.

    Raises
    ------
    GeometryError
        If svgpathtools is missing, cannot read the file, or a name is unknown.
    """
    require_package("svgpathtools", "cad")
    from svgpathtools import Document

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # remarks about syntax that it skips
            document = Document(str(path))
            paths = document.paths()
    except (ParseError, ValueError, KeyError, IndexError, TypeError, AttributeError, AssertionError) as error:
        raise GeometryError(f"it cannot be read ({printable(str(error))}): save it again as plain SVG") from error
    root = document.root
    factor, height, unit = _frame(root)
    parents = {child: parent for parent in root.iter() for child in parent}
    names = {id(each): list(_names(each.element, parents)) for each in paths}
    check_only(only, sorted({name for listed in names.values() for name in listed}), "the ids and labels")

    def place(z: complex) -> Point:
        return factor * z.real, factor * (height - z.imag)

    strokes: list[Stroke] = []
    for each in paths:
        if not only or set(only) & {*names[id(each)]}:
            group = names[id(each)][0] if names[id(each)] else ""
            strokes += [stroke for segment in each for stroke in _strokes(segment, group)]
    return [stroke.mapped(lambda p: place(complex(*p))) for stroke in strokes], unit


def _names(element: Element, parents: dict[Element, Element]) -> Iterator[str]:
    """Yield the label and id of a shape and of the groups that it is in, the innermost first."""
    here: Element | None = element
    while here is not None and not here.tag.endswith("}svg"):
        for name in (here.get(_LABEL), here.get("id")):
            if name:
                yield name
        here = parents.get(here)


def _frame(root: Element) -> tuple[float, float, str]:
    """Return the factor from units of the picture to millimetres or 1, the height of its lower edge, and the unit."""
    box = [float(number) for number in re.split(r"[\s,]+", root.get("viewBox", "").strip()) if number]
    length = _LENGTH.match(root.get("width", ""))
    if len(box) == 4 and box[2] > 0.0:
        lower = box[1] + box[3]
        if length:
            return float(length[1]) * _MILLIMETRES[length[2]] / box[2], lower, "mm"
        return 1.0, lower, ""
    height = re.match(r"\s*([-+.\deE]+)", root.get("height", ""))
    return 1.0, float(height[1]) if height else 0.0, ""


def _strokes(segment: Any, group: str) -> list[Stroke]:
    """Return a segment of a path in the coordinates of the picture."""
    if segment.start == segment.end and type(segment).__name__ == "Line":
        return []
    if type(segment).__name__ == "Line":
        return [Stroke(_pair(segment.start), LineTo(_pair(segment.end), group=group))]
    if type(segment).__name__ != "Arc":
        points = np.array([_pair(point) for point in segment.bpoints()])
        return [] if not np.ptp(points, axis=0).any() else [bezier_stroke(points, group)]
    first, second = abs(segment.radius.real), abs(segment.radius.imag)
    if abs(first - second) <= 1e-9 * first and abs(segment.delta) < 359.0:
        return [Stroke(_pair(segment.start), ArcTo(_pair(segment.end), _pair(segment.point(0.5)), group=group))]
    angle = math.radians(segment.rotation)
    along = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-along[1], along[0]])
    start, end = math.radians(segment.theta), math.radians(segment.theta + segment.delta)
    return ellipse_strokes(np.array(_pair(segment.center)), first * along, second * across, start, end, group)


def _pair(z: complex) -> Point:
    return float(z.real), float(z.imag)
