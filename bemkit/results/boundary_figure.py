"""The figure of tractions along the whole boundary, for scenes without contact."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

import numpy as np

from bemkit.results.drawing import BLUE, VERMILION, label_values, panel_above_strip
from bemkit.results.solution import Solution

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

FREE, PARTS = "#F2F2F2", ("#C6DBEA", "#F3D9B1")
_READABLE = 0.06
"""Share of the boundary from which on a piece is long enough for its name."""


def draw_boundary_traction(solution: Solution, *, length: str = "m", stress: str = "Pa") -> Figure:
    """Draw the normal and the tangential traction of each element along the boundary, above the parts it belongs to.

    Parameters
    ----------
    solution : Solution
    length, stress : str
        Names of units on the axes.

    Returns
    -------
    matplotlib.figure.Figure
        Closed curves of the boundary follow each other; a line marks where each of them begins.
    """
    mesh, traction = solution.mesh, solution.boundary.traction
    order = np.concatenate(mesh.loops)
    s = np.append(0.0, np.cumsum(mesh.lengths[order]))
    normals = mesh.normals[order]
    tangents = np.stack([-normals[:, 1], normals[:, 0]], axis=1)
    title = f"Tractions on the boundary\n{solution.scene.title}"
    figure, axes, strip = panel_above_strip(title, f"arc length $s$ [{length}]")
    for directions, colour, label in (
        (normals, BLUE, r"normal $t_n$"),
        (tangents, VERMILION, r"tangential $t_t$"),
    ):
        axes.stairs(np.einsum("ec,ec->e", traction[order], directions), s, color=colour, label=label, linewidth=1.4)
    starts = np.cumsum([0, *(len(loop) for loop in mesh.loops)])[1:-1]
    for place in s[starts]:
        axes.axvline(place, color="black", linewidth=0.8)
    label_values(axes, f"traction [{stress}]")
    _draw_parts(strip, solution, order.tolist(), s.tolist())
    return figure


def _draw_parts(strip: Axes, solution: Solution, order: list[int], s: list[float]) -> None:
    """Paint the part that each piece of the boundary belongs to, with its name where there is room."""
    name_of = {element: name for name, elements in solution.mesh.parts.items() for element in elements.tolist()}
    numbers = {name: number for number, name in enumerate(solution.mesh.parts)}
    for name, group in groupby(range(len(order)), key=lambda k: name_of.get(order[k])):
        places = list(group)
        begin, end = s[places[0]], s[places[-1] + 1]
        strip.axvspan(begin, end, color=FREE if name is None else PARTS[numbers[name] % 2], linewidth=0)
        if name is not None and end - begin > _READABLE * s[-1]:
            strip.text((begin + end) / 2.0, 0.5, name, ha="center", va="center", fontsize=8, parse_math=False)
    strip.set_xlim(0.0, s[-1])
