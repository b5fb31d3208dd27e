"""Tractions along the whole boundary of a body."""

from __future__ import annotations

from itertools import groupby

import numpy as np

from bemkit.pictures.contact_axes import axes_with_strip, cut_peaks
from bemkit.pictures.drawing import BLUE, VERMILION, Axes, axes_or_new, label_values
from bemkit.pictures.traction_curves import boundary_curve
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import with_unit

_FREE, _PARTS = "#F2F2F2", ("#C6DBEA", "#F3D9B1")
_READABLE = 0.06
"""Least length of a piece that has room for its name, relative to the boundary."""


def draw_boundary_traction(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw the normal and the tangential traction along the boundary, above the parts it belongs to.

    Closed curves of the boundary follow each other; a line marks where each of them begins. Peaks that would flatten
    all else are cut, and the picture says so.

    Parameters
    ----------
    solution : Solution
    axes : optional
        As for `bemkit.pictures.contact_curves.draw_contact_displacement`.
    """
    units = solution.units
    order = np.concatenate(solution.mesh.loops)
    curve = boundary_curve(solution.body, order)
    axes = axes_or_new(axes)
    strip = axes_with_strip(axes, f"Tractions on the boundary\n{solution.title}")
    strip.set_xlabel(with_unit("arc length $s$", "length", units))
    axes.plot(curve.s, curve.normal, color=BLUE, label=r"normal $t_n$", linewidth=1.4)
    axes.plot(curve.s, curve.tangential, color=VERMILION, label=r"tangential $t_t$", linewidth=1.4)
    ends = np.append(0.0, np.cumsum(solution.mesh.lengths[order]))
    for place in ends[np.cumsum([0, *(len(loop) for loop in solution.mesh.loops)])[1:-1]]:
        axes.axvline(place, color="black", linewidth=0.8)
    scale = max(float(np.abs(each).max()) for each in (curve.normal, curve.tangential))
    label_values(axes, with_unit("traction", "stress", units), scale)
    cut_peaks(axes, curve.s, (curve.normal, curve.tangential), units)
    _draw_parts(strip, solution, order.tolist(), ends.tolist())
    return axes


def _draw_parts(strip: Axes, solution: Solution, order: list[int], s: list[float]) -> None:
    """Paint the part that each piece of the boundary belongs to, with its name where there is room."""
    name_of = {element: name for name, elements in solution.mesh.parts.items() for element in elements.tolist()}
    numbers = {name: number for number, name in enumerate(solution.mesh.parts)}
    for name, group in groupby(range(len(order)), key=lambda k: name_of.get(order[k])):
        places = list(group)
        begin, end = s[places[0]], s[places[-1] + 1]
        strip.axvspan(begin, end, color=_FREE if name is None else _PARTS[numbers[name] % 2], linewidth=0)
        if name is not None and end - begin > _READABLE * s[-1]:
            strip.text((begin + end) / 2.0, 0.5, name, ha="center", va="center", fontsize=8, parse_math=False)
    strip.set_xlim(0.0, s[-1])
