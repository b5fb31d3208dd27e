"""Pictures of a load history: the friction loop, work and energy, and the contact status over time.

Each function draws into axes of matplotlib and returns them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.results.contact_table import STATUS_WORDS
from bemkit.results.drawing import BLUE, GREEN, GREY, VERMILION, new_figure, show_grid
from bemkit.results.figures import STATUS_COLOURS
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from bemkit.results.assembly_solution import AssemblySolution
    from bemkit.results.load_history import LoadHistory
    from bemkit.results.solution import Solution


def history_figures(solution: Solution | AssemblySolution, *, units: UnitNames | None = None) -> dict[str, Figure]:
    """Draw what there is to show of a load history.

    Returns
    -------
    dict of str to matplotlib.figure.Figure
        By file names without ``.png``: ``friction-loop``, ``work`` and, for each contact, ``status-over-time``; none
        without a load history or without contact.
    """
    loading, units = solution.loading, units or solution.units
    if loading is None or not solution.contact.n_contact:
        return {}
    loop, work = new_figure(6.0, 4.2), new_figure(6.0, 4.2)
    draw_friction_loop(loop.add_subplot(), loading, units=units)
    draw_work(work.add_subplot(), loading, units=units)
    figures = {"friction-loop": loop, "work": work}
    parts = solution.contact.parts
    for number, part in enumerate(parts, start=1):
        figure = new_figure(6.0, 4.2)
        draw_status_over_time(figure.add_subplot(), loading, part, units=units)
        figures["status-over-time" + (f"-{number}" if len(parts) > 1 else "")] = figure
    return figures


def draw_friction_loop(axes: Axes, loading: LoadHistory, *, units: UnitNames | None = None) -> Axes:
    """Draw the friction force against the mean tangential displacement of the contact nodes, step by step."""
    places = np.array([0.0, *(step.mean_displacement for step in loading.steps)])
    forces = np.array([0.0, *(step.force_tangential for step in loading.steps)])
    axes.plot(places, forces, color=BLUE, linewidth=1.4, marker="o", markersize=3.0)
    axes.plot(places[:1], forces[:1], color=GREY, marker="o", markersize=6.0)
    axes.plot(places[-1:], forces[-1:], color=VERMILION, marker="o", markersize=6.0)
    axes.annotate("begin", (places[0], forces[0]), textcoords="offset points", xytext=(8, 6), color=GREY)
    axes.annotate("end", (places[-1], forces[-1]), textcoords="offset points", xytext=(-34, 8), color=VERMILION)
    axes.set_xlabel(with_unit("mean tangential displacement", "length", units))
    axes.set_ylabel(with_unit("friction force on the body", "force", units))
    axes.margins(0.08)
    show_grid(axes)
    return axes


def draw_work(axes: Axes, loading: LoadHistory, *, units: UnitNames | None = None) -> Axes:
    """Draw over time what loads have put in, what friction has taken, and the elastic energy."""
    times = np.concatenate([[0.0], loading.times])
    external = np.cumsum([0.0, *(step.work.external_work for step in loading.steps)])
    taken = np.cumsum([0.0, *(step.work.dissipation for step in loading.steps)])
    energy = np.array([0.0, *(step.elastic_energy for step in loading.steps)])
    axes.plot(times, external, color=BLUE, label="external work")
    axes.plot(times, taken, color=VERMILION, linestyle="--", label="taken by friction")
    axes.plot(times, energy, color=GREEN, linestyle="-.", label="elastic energy")
    axes.set_xlabel("time $t$")
    axes.set_ylabel(with_unit("work and energy", "energy", units))
    axes.legend(frameon=False)
    show_grid(axes)
    return axes


def draw_status_over_time(axes: Axes, loading: LoadHistory, part: str, *, units: UnitNames | None = None) -> Axes:
    """Draw where the nodes of a contact are separated, slip or stick, for every step."""
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    words = list(STATUS_COLOURS)
    number_of = {int(status): words.index(word) for status, word in STATUS_WORDS.items()}
    table = loading.steps[-1].contact
    own = np.flatnonzero(table.rows(part))
    own = own[np.argsort(table.s[own])]
    numbers = np.array([[number_of[value] for value in step.contact.status[own].tolist()] for step in loading.steps])
    s = table.s[own]
    edges = np.concatenate([s[:1], 0.5 * (s[1:] + s[:-1]), s[-1:]])
    colours = ListedColormap([STATUS_COLOURS[word] for word in words])
    times = np.concatenate([[0.0], loading.times])
    axes.pcolormesh(times, edges, numbers.T, cmap=colours, vmin=-0.5, vmax=len(words) - 0.5)
    handles = [Patch(color=STATUS_COLOURS[word], label=word) for word in words]
    axes.legend(handles=handles, loc="lower center", bbox_to_anchor=(0.5, 1.0), ncols=len(words), frameon=False)
    axes.set_xlabel("time $t$")
    axes.set_ylabel(with_unit("arc length $s$", "length", units))
    axes.spines[["top", "right"]].set_visible(False)
    return axes
