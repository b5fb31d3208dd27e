"""Stresses inside the bodies as filled contours."""

from __future__ import annotations

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.pictures.drawing import Axes
from bemkit.pictures.obstacles import draw_obstacles, draw_rigid_bodies
from bemkit.pictures.plane import draw_initial, joined_frame, plane_axes, set_frame
from bemkit.pictures.shown import shown
from bemkit.results.solution import Solution
from bemkit.results.stress_measures import StressMeasure, find_measure
from bemkit.results.stress_mesh import StressMesh, stress_mesh
from bemkit.scene.unit_names import UnitNames, amount, with_unit

_ACROSS = 48
"""Number of sample points far from the boundary, along the longer side of the picture."""
_LEVELS = 18
_SHOWN = 0.995
"""Share of the picture whose stresses are within the range of colours: corners of supports have infinite stresses."""
_SEEN = 1e-3
"""Least visible displacement, relative to the picture."""
_FLAT = 1e-6
"""Variation of stresses that is drawn as none, relative to the largest."""


def draw_stress(solution: Solution, axes: Axes | None = None, *, measure: str = "von-mises") -> Axes:
    """Draw a stress inside all bodies in their final positions.

    Parameters
    ----------
    solution : Solution
    axes : Axes, optional
        Of matplotlib; those of a new figure by default.
    measure : str
        One of `STRESSES`.

    Returns
    -------
    Axes
        Colours end where only half a per cent of the picture has more; the title states the largest drawn stress.

    Raises
    ------
    InputError
        If the measure is unknown.
    """
    chosen, scene, units = find_measure(measure), shown(solution), solution.units
    bodies = tuple(solution.bodies.values())
    size = float(np.ptp(scene.frame, axis=1).max())
    spacing = size / _ACROSS
    # obstacles are where they are in the end: a body that is seen to move must be there, too
    farthest = max(float(np.abs(body.boundary.displacement).max()) for body in bodies)
    is_seen = farthest > _SEEN * size
    factor = 1.0 if is_seen else 0.0
    filled = [stress_mesh(body, spacing, scene.frame) for body in bodies]
    values = [chosen.of(each.stress, body.scene.material) for each, body in zip(filled, bodies, strict=True)]
    every = np.concatenate(values)
    extreme = float(every[np.argmax(np.abs(every))])
    title = f"Stress up to {amount(extreme, 'stress', units)}\n{scene.title}"  # its name is beside the colours
    axes = plane_axes(axes, scene.frame, title, units)
    largest = largest_shown(np.concatenate([each.points for each in filled]), every, spacing)
    levels = _levels(largest, chosen.is_positive)
    for triangles, value in zip(filled, values, strict=True):
        _draw_contours(axes, triangles, factor, value, levels, chosen)
    draw_initial(axes, scene, factor=factor)
    loops = [loop for body in scene.bodies for loop in body.outlines(factor)]
    set_frame(axes, joined_frame(scene.frame.T, *loops), margin=0.05)
    draw_rigid_bodies(axes, scene, factor)
    draw_obstacles(axes, scene)
    _draw_scale(axes, levels, chosen, units)
    return axes


def largest_shown(points: FloatArray, values: FloatArray, spacing: float) -> float:
    """Return the size that so many of the values (n,) do not exceed, squares of the picture counting alike.

    Points (n, 2) [m] crowd in corners, where stresses are largest.
    """
    _, square, count = np.unique(np.floor(points / spacing), axis=0, return_inverse=True, return_counts=True)
    order = np.argsort(np.abs(values))
    share = np.cumsum(1.0 / count[square.ravel()[order]]) / count.size
    return float(np.abs(values)[order[np.searchsorted(share, _SHOWN)]]) or float(np.abs(values).max()) or 1.0


def _levels(largest: float, is_positive: bool) -> FloatArray:
    """Return where colours change, round numbers: from zero of what is positive, else as far below zero as above."""
    from matplotlib.ticker import MaxNLocator

    return np.asarray(MaxNLocator(_LEVELS, steps=[1, 2, 5, 10]).tick_values(0.0 if is_positive else -largest, largest))


def _draw_contours(
    axes: Axes, filled: StressMesh, factor: float, values: FloatArray, levels: FloatArray, chosen: StressMeasure
) -> None:
    """Fill the triangles of a body moved by a factor times its displacement."""
    from matplotlib.tri import Triangulation

    smooth = np.where(np.abs(values) < _FLAT * levels[-1], 0.0, values)
    x, y = (filled.points + factor * filled.displacement).T
    net = Triangulation(x, y, filled.triangles)
    extend = "max" if chosen.is_positive else "both"
    axes.tricontourf(net, smooth, levels=levels, cmap=_colours(chosen), extend=extend)


def _colours(chosen: StressMeasure) -> str:
    return "viridis" if chosen.is_positive else "RdBu_r"


def _draw_scale(axes: Axes, levels: FloatArray, chosen: StressMeasure, units: UnitNames | None) -> None:
    from matplotlib import colormaps
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import BoundaryNorm
    from matplotlib.ticker import MaxNLocator

    from bemkit.pictures.number_axis import PlainNumbers

    norm = BoundaryNorm(levels.tolist(), 256, extend="max" if chosen.is_positive else "both")
    scale = ScalarMappable(norm, colormaps[_colours(chosen)])
    figure = axes.get_figure(root=True)
    place = axes.inset_axes((1.03, 0.0, 0.04, 1.0))
    ticks = MaxNLocator(6, steps=[1, 2, 5, 10])
    bar = figure.colorbar(  # type: ignore[union-attr]
        scale, cax=place, ticks=ticks, format=PlainNumbers(), spacing="proportional"
    )
    bar.set_label(with_unit(chosen.symbol, "stress", units))
