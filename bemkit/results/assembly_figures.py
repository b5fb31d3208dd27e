"""Figures of an assembly: all bodies, deformed, and every contact once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.geometry.spaces import BoundarySpace
from bemkit.results.assembly_solution import AssemblySolution, BodyResult
from bemkit.results.drawing import GREY, new_figure
from bemkit.results.figures import (
    STATUS_COLOURS,
    contact_figures,
    draw_body,
    exaggeration,
    outlines,
)
from bemkit.results.obstacle_drawing import draw_obstacles, draw_rigid_bodies
from bemkit.scene.unit_names import UnitNames, amount, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MOST_CONTACTS = 6
"""Contacts up to which each has figures of its own."""


def all_assembly_figures(solution: AssemblySolution, *, units: UnitNames | None = None) -> dict[str, Figure]:
    """Draw everything there is to show.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By file names without ``.png``: ``deformation``, ``contacts``, and if there are few contacts those of
        `bemkit.results.figures.contact_figures`.
    """
    figures = {
        "deformation": draw_deformed_bodies(solution, units=units),
        "contacts": draw_contact_map(solution, units=units),
    }
    return figures | (contact_figures(solution, units=units) if len(solution.contact.parts) <= MOST_CONTACTS else {})


def draw_deformed_bodies(solution: AssemblySolution, *, units: UnitNames | None = None) -> Figure:
    """Draw all bodies before and after, all displacements enlarged by one factor that the picture tells.

    The factor is so small that no body is drawn inside another one by more than a line is thick.
    """
    units = units or solution.units
    bodies = list(solution.bodies.values())
    moved = np.concatenate([body.boundary.displacement for body in bodies])
    size = float(np.hypot(*_extent(solution)))
    factor = exaggeration(size, moved, solution.contact)
    figure = _figure(solution)
    axes = figure.add_subplot()
    for number, body in enumerate(bodies):
        draw_body(axes, _space(body), body.boundary.displacement, factor, is_labelled=number == 0)
    axes.set_aspect("equal")
    axes.margins(0.05)
    conditions = [part.condition for body in bodies for part in body.scene.contact_parts]
    draw_rigid_bodies(axes, [(body, solution.rigid[body.name]) for body in solution.assembly.rigid], factor)
    draw_obstacles(axes, [getattr(condition, "obstacle", None) for condition in conditions])
    _name_axes(axes, solution.title, units)
    figure.legend(loc="outside lower center", ncols=3, frameon=False)
    return figure


def draw_contact_map(solution: AssemblySolution, *, units: UnitNames | None = None) -> Figure:
    """Draw all bodies, and each contact once: its status by colour, its pressure by the length of a comb."""
    units = units or solution.units
    from matplotlib.collections import LineCollection
    from matplotlib.lines import Line2D

    table = solution.contact
    figure = _figure(solution)
    axes = figure.add_subplot()
    for body in solution.bodies.values():
        for loop in outlines(_space(body), body.boundary.displacement, 0.0):
            axes.plot(*loop.T, color=GREY, linewidth=0.8, zorder=1)
    axes.set_aspect("equal")
    axes.margins(0.05)
    draw_rigid_bodies(axes, [(body, solution.rigid[body.name]) for body in solution.assembly.rigid], 0.0)
    points = np.stack([table.x, table.y], axis=1)
    largest = float(np.max(-table.sigma_n, initial=0.0))
    length = _comb_length(solution) * np.maximum(-table.sigma_n, 0.0) / (largest or 1.0)
    tips = points - length[:, None] * solution.contact_directions
    words = np.array(table.status_words())
    for word, colour in STATUS_COLOURS.items():
        own = words == word
        if own.any():
            axes.add_collection(LineCollection(np.stack([points, tips], axis=1)[own], colors=colour, linewidths=1.4))
            axes.scatter(points[own, 0], points[own, 1], s=7.0, color=colour, zorder=3, linewidths=0.0)
    present = [word for word in STATUS_COLOURS if np.any(words == word)]
    handles = [Line2D([], [], color=STATUS_COLOURS[word], marker="o", label=word) for word in present]
    _name_axes(axes, f"Contacts, pressure up to {amount(largest, 'stress', units)}\n{solution.title}", units)
    figure.legend(handles=handles, loc="outside lower center", ncols=3, frameon=False)
    return figure


def _comb_length(solution: AssemblySolution) -> float:
    """Return the length of the longest tooth: a tenth of the picture, or a third of a body where there are many."""
    diameters = [body.mesh.diameter for body in solution.bodies.values() if not body.mesh.is_exterior]
    return float(min(0.1 * np.hypot(*_extent(solution)), np.median(diameters or [np.inf]) / 3.0))


def _extent(solution: AssemblySolution) -> FloatArray:
    """Return the width and the height of all bodies together."""
    return np.asarray(np.ptp(np.concatenate([body.mesh.nodes for body in solution.bodies.values()]), axis=0))


def _figure(solution: AssemblySolution) -> Figure:
    """Return an empty figure whose height suits that of the bodies."""
    width, height = _extent(solution)
    return new_figure(6.4, float(np.clip(6.0 * height / width + 1.4, 3.0, 9.0)))


def _space(body: BodyResult) -> BoundarySpace:
    return body.scene.discretisation.displacement_space(body.mesh)


def _name_axes(axes: Axes, title: str, units: UnitNames | None) -> None:
    axes.set_xlabel(with_unit("$x$", "length", units))
    axes.set_ylabel(with_unit("$y$", "length", units))
    axes.set_title(title, parse_math=False, fontsize=11)
