"""The friction cone: tangential against normal tractions of the contact nodes, with the bounds of the law."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.pictures.contact_axes import LIMIT, STATUS_COLOURS, traction_scale
from bemkit.pictures.crowds import marked
from bemkit.pictures.shown import Result
from bemkit.results.drawing import axes_or_new, ignore_round_off, show_grid
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_friction_cone(
    solution: Result, part: str, axes: Axes | None = None, *, units: UnitNames | None = None
) -> Axes:
    """Draw the tractions of the nodes of one contact over its pressures, within the friction bound.

    Nodes that stick lie between the bounds, nodes that slip on one of them. Where the coefficient varies along the
    contact, each node has a bound of its own.

    Parameters
    ----------
    solution : Solution or AssemblySolution
    part : str
        Name of a contact part, or of a contact of several bodies.
    axes, units : optional
        As for `bemkit.pictures.contact_curves.draw_contact_displacement`.
    """
    units = units or solution.units
    axes = axes_or_new(axes, 5.6, 4.6)
    table, own = solution.contact, solution.contact.rows(part)
    pressure, scale = -table.sigma_n, traction_scale(solution)
    if solution.friction_bound is not None:
        nodes = np.flatnonzero(own)[np.argsort(pressure[own])]
        bound = solution.friction_bound[nodes]
        is_line = bool(np.all(np.diff(bound) >= -1e-9 * scale))
        style = LIMIT if is_line else {**LIMIT, "linestyle": "", "marker": "_", "markersize": 4.0}
        axes.plot(pressure[nodes], bound, label="friction bound", **style)
        axes.plot(pressure[nodes], -bound, **style)
    words = np.array(table.status_words())
    for word, colour in STATUS_COLOURS.items():
        chosen = np.stack([pressure, table.sigma_t], axis=1)[own & (words == word)]
        if len(chosen):
            x, y = chosen[marked(chosen, chosen[:, 0], scale)].T
            axes.scatter(x, y, s=18.0, color=colour, edgecolors="black", linewidths=0.4, zorder=3, label=word)
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)
    show_grid(axes)
    ignore_round_off(axes, scale)
    axes.set_xlim(*_wide_enough(axes.get_xlim(), scale))
    axes.set_xlabel(with_unit(r"pressure $-\sigma_n$", "stress", units))
    axes.set_ylabel(with_unit(r"tangential traction $\sigma_t$", "stress", units))
    axes.set_title(f"Friction on '{part}'\n{solution.title}", parse_math=False, fontsize=11)
    axes.legend(frameon=False, fontsize=9)
    return axes


def _wide_enough(limits: tuple[float, float], scale: float) -> tuple[float, float]:
    """Return limits of pressures that begin at zero at the latest: a uniform pressure is one column of points."""
    low, high = limits
    return min(low, -0.05 * scale), max(high, 0.05 * scale)
