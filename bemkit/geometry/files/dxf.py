"""Outlines from DXF drawings, through ezdxf."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.errors import GeometryError, printable
from bemkit.geometry.files.strokes import Stroke, check_only, ellipse_strokes, nurbs_strokes, require_package
from bemkit.geometry.free_form.drawn import ArcTo, LineTo, Point

_UNITS: Mapping[int, str] = MappingProxyType({1: "in", 2: "ft", 4: "mm", 5: "cm", 6: "m", 13: "um"})
"""Units of length by their number in the header of a DXF file."""
_PLANE = 1e-9
_FLAT = 1e-6
"""Angle [rad] of arcs that are lines: points about a centre that far away have no more digits."""
_DEEPEST = 8
"""Blocks within blocks."""


def read_dxf(path: Path, only: Sequence[str] = ()) -> tuple[list[Stroke], str, list[str]]:
    """Read the lines, arcs, circles, polylines, ellipses and splines of the model space of a DXF file.

    Parameters
    ----------
    path : Path
    only : sequence of str
        Layers of the outline; if empty, all that are on.

    Returns
    -------
    strokes : list of Stroke
        Their groups are the layers, but that of layer 0 is empty.
    unit : str
        Unit of length that the file states; empty if none.
    notes : list of str
        Entries that are skipped.

    Raises
    ------
    GeometryError
        If ezdxf is missing, cannot read the file, a layer is unknown, or the drawing is not plane.
    """
    require_package("ezdxf", "cad")
    from ezdxf import recover
    from ezdxf.lldxf.const import DXFError

    try:
        document, audit = recover.readfile(path)
    except (DXFError, ValueError, KeyError, IndexError, TypeError, AttributeError) as error:
        raise GeometryError(f"it cannot be read ({printable(str(error))}): save it as DXF anew") from error
    entities = list(_entities(document.modelspace(), 0))
    layers = sorted({_layer(entity) for entity in entities})
    check_only(only, layers, "the layers with lines")
    strokes: list[Stroke] = []
    left_out: Counter[str] = Counter()
    for entity in entities:
        layer = _layer(entity)
        if (layer not in only) if only else _is_off(document, layer):
            continue
        group = "" if layer == "0" else layer
        try:
            drawn = _strokes(entity, group)
        except (DXFError, ValueError, ZeroDivisionError) as error:
            raise GeometryError(
                f"a {entity.dxftype()} on layer {layer!r} is not a curve ({error}): redraw it"
            ) from error
        if drawn is None:
            left_out[entity.dxftype()] += 1
        else:
            strokes += drawn
    words = ", ".join(f"{count} {kind}" for kind, count in sorted(left_out.items()))
    notes = [f"skipped, because no lines: {words}"] if words else []
    if repairs := [*audit.fixes, *audit.errors]:
        notes.append(
            f"damaged, and repaired or skipped: {len(repairs)} entries, such as: {printable(repairs[0].message)}"
        )
    unit = _UNITS.get(int(document.header.get("$INSUNITS", 0)), "")
    return strokes, unit, notes


def _entities(container: Iterable[Any], depth: int) -> Iterator[Any]:
    """Yield entities, those of blocks and the lines and arcs of polylines in place."""
    for entity in container:
        kind = entity.dxftype()
        if kind in ("LWPOLYLINE", "POLYLINE") or (kind == "INSERT" and depth < _DEEPEST):
            yield from _entities(entity.virtual_entities(), depth + 1)
        else:
            yield entity


def _layer(entity: Any) -> str:
    return str(entity.dxf.layer)


def _is_off(document: Any, layer: str) -> bool:
    if layer.lower() == "defpoints":
        return True
    if layer not in document.layers:
        return False
    found = document.layers.get(layer)
    return bool(found.is_off() or found.is_frozen())


def _strokes(entity: Any, group: str) -> list[Stroke] | None:
    """Return the strokes of an entity, or None if it is none of those that bound bodies."""
    match entity.dxftype():
        case "LINE":
            start, end = _point(entity.dxf.start), _point(entity.dxf.end)
            return [] if start == end else [Stroke(start, LineTo(end, group=group))]
        case "ARC":
            return [_arc(entity, math.radians(entity.dxf.start_angle), math.radians(entity.dxf.end_angle), group)]
        case "CIRCLE":
            return [_arc(entity, k * math.pi / 2.0, (k + 1) * math.pi / 2.0, group) for k in range(4)]
        case "ELLIPSE":
            return _ellipse(entity, group)
        case "SPLINE":
            spline = entity.construction_tool()
            points = [_point(point) for point in spline.control_points]
            weights = np.array(spline.weights()) if len(spline.weights()) else np.ones(len(points))
            return nurbs_strokes(np.array(points), spline.degree, np.array(spline.knots()), weights, group)
    return None


def _point(place: Any) -> Point:
    """Return x and y of a point of the world, which lies in the plane."""
    if abs(place.z) > _PLANE * max(abs(place.x), abs(place.y)) and abs(place.z) > 1e-12:
        raise GeometryError(
            f"a line passes through z = {place.z:.6g}: bemkit solves plane problems; give a drawing at z = 0"
        )
    return float(place.x), float(place.y)


def _arc(entity: Any, start: float, end: float, group: str) -> Stroke:
    """Return an arc by three of its points, which holds for mirrored ones, too."""
    from ezdxf.math import Vec3

    if end <= start:
        end += 2.0 * math.pi
    centre, radius = entity.dxf.center, entity.dxf.radius
    angles = (start, 0.5 * (start + end), end)
    places = [centre + Vec3.from_angle(angle, radius) for angle in angles]
    begin, middle, finish = (_point(each) for each in entity.ocs().points_to_wcs(places))
    is_flat = end - start < _FLAT
    return Stroke(begin, LineTo(finish, group=group) if is_flat else ArcTo(finish, middle, group=group))


def _ellipse(entity: Any, group: str) -> list[Stroke]:
    centre, first, second = (
        np.array(_point(each)) for each in (entity.dxf.center, entity.dxf.major_axis, entity.minor_axis)
    )
    start, end = float(entity.dxf.start_param), float(entity.dxf.end_param)
    if end <= start + 1e-12:
        end += 2.0 * math.pi
    return ellipse_strokes(centre, first, second, start, end, group)
