"""Pictures of a load history: the friction loop, work and energy over time, the status over time."""

from __future__ import annotations

import numpy as np

from bemkit.errors import InputError
from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.drawing import (
    BLUE,
    CLEAR,
    GREEN,
    GREY,
    VERMILION,
    Axes,
    axes_or_new,
    ignore_round_off,
    legend_below,
    show_grid,
)
from bemkit.results.contact_table import STATUS_WORDS
from bemkit.results.load_history import LoadHistory
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import with_unit

_NO_FRICTION = 1e-9
"""Ratio of friction to pressing force that is round-off."""


def history_of(solution: Solution) -> LoadHistory:
    """Return the load history of a result; InputError without one."""
    if solution.loading is None:
        raise InputError(f"{solution.title!r} has no load history: give load factors or steps to the scene")
    return solution.loading


def draw_friction_loop(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw the friction force over the mean tangential displacement of the contact nodes, step by step.

    If all contacts lie on horizontal lines, both are positive along x, else along the boundary.

    Parameters
    ----------
    solution : Solution
        Of a load history.
    axes : optional
        As for `bemkit.pictures.contact_curves.draw_contact_displacement`.

    Raises
    ------
    InputError
        If there is no load history.
    """
    loading, units = history_of(solution), solution.units
    axes = axes_or_new(axes, 6.0, 4.2)
    direction = solution.contact.common_direction
    sign, over = direction or 1.0, " along $x$" if direction else ""
    places = sign * np.array([0.0, *(step.mean_displacement for step in loading.steps)])
    forces = sign * np.array([0.0, *(step.force_tangential for step in loading.steps)])
    axes.plot(places, forces, color=BLUE, linewidth=1.4, marker="o", markersize=3.0)
    axes.plot(places[:1], forces[:1], color=GREY, marker="o", markersize=6.0, linestyle="", label="begin")
    axes.plot(places[-1:], forces[-1:], color=VERMILION, marker="o", markersize=6.0, linestyle="", label="end")
    legend_below(axes)
    axes.set_xlabel(with_unit(f"mean tangential displacement{over}", "length", units))
    axes.set_ylabel(with_unit("friction force on the body", "force", units))
    axes.set_title(f"Friction over displacement\n{solution.title}", parse_math=False, fontsize=11)
    axes.margins(0.08)
    show_grid(axes)
    ignore_round_off(axes, max(float(np.abs(forces).max()), *(abs(step.force_normal) for step in loading.steps)))
    moved = max(float(np.abs([step.contact.u_n, step.contact.u_t]).max(initial=0.0)) for step in loading.steps)
    ignore_round_off(axes, moved, "x")
    return axes


def has_friction(loading: LoadHistory) -> bool:
    """Return whether friction forces are more than round-off in any step."""
    return any(abs(step.force_tangential) > _NO_FRICTION * abs(step.force_normal) for step in loading.steps)


def draw_work(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw the work of loads, the dissipation by friction and the elastic energy over time.

    The error of the increments is drawn where it is visible: the external work is the sum of the others.
    See `draw_friction_loop`.
    """
    loading, units = history_of(solution), solution.units
    axes = axes_or_new(axes, 6.0, 4.2)
    times = np.concatenate([[0.0], loading.times])
    external = np.cumsum([0.0, *(step.work.external_work for step in loading.steps)])
    taken = np.cumsum([0.0, *(step.work.dissipation for step in loading.steps)])
    energy = np.array([0.0, *(step.elastic_energy for step in loading.steps)])
    axes.plot(times, external, color=BLUE, label="external work")
    axes.plot(times, taken, color=VERMILION, linestyle="--", label="dissipation")
    axes.plot(times, energy, color=GREEN, linestyle="-.", label="elastic energy")
    if loading.has_coarse_increments:
        left = np.cumsum([0.0, *(step.work.increment_work for step in loading.steps)])
        axes.plot(times, left, color=GREY, linestyle=":", label="increment error")
    axes.set_xlabel("time $t$")
    axes.set_ylabel(with_unit("work and energy", "energy", units))
    axes.set_title(f"Work and energy\n{solution.title}", parse_math=False, fontsize=11)
    axes.legend(**CLEAR)
    show_grid(axes)
    ignore_round_off(axes, float(np.abs(np.concatenate([external, taken, energy])).max()))
    return axes


def draw_status_over_time(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw where the nodes of a contact are separated, slip or stick, for every step of a load history.

    The part is the name of a contact part, or of a contact of several bodies. See `draw_friction_loop`.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    loading = history_of(solution)
    names = list(STATUS_COLOURS)
    row_of = {int(status): names.index(name) for status, name in STATUS_WORDS.items()}
    table = loading.steps[-1].contact
    rows = np.flatnonzero(table.rows(part))
    rows = rows[np.argsort(table.s[rows])]
    statuses = np.array([[row_of[value] for value in step.contact.status[rows].tolist()] for step in loading.steps])
    abscissa = Abscissa.along(solution, part)
    s = table.s[rows]
    edges = abscissa.at(np.concatenate([s[:1], 0.5 * (s[1:] + s[:-1]), s[-1:]]))
    times = np.concatenate([[0.0], loading.times])
    axes = axes_or_new(axes)
    colours = ListedColormap([STATUS_COLOURS[name] for name in names])
    axes.pcolormesh(edges, times, statuses, cmap=colours, vmin=-0.5, vmax=len(names) - 0.5)
    abscissa.write_below(axes, solution.units)
    axes.set_ylabel("time $t$")
    axes.set_title(f"Status over time\n{solution.title}", parse_math=False, fontsize=11)
    handles = [Patch(color=STATUS_COLOURS[name], label=name) for name in names]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9)
    return axes
