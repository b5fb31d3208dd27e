"""The status along a contact over the time of a load history."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.pictures.contact_axes import STATUS_COLOURS
from bemkit.pictures.load_history import history_of
from bemkit.pictures.shown import Result
from bemkit.results.contact_table import STATUS_WORDS
from bemkit.results.drawing import axes_or_new
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_status_over_time(
    solution: Result, part: str, axes: Axes | None = None, *, units: UnitNames | None = None
) -> Axes:
    """Draw where the nodes of a contact are separated, slip or stick, for every step of a load history.

    Parameters
    ----------
    solution : Solution or AssemblySolution
        Of a load history.
    part : str
        Name of a contact part, or of a contact of several bodies.
    axes, units : optional
        As for `bemkit.pictures.contact_curves.draw_contact_displacement`.

    Raises
    ------
    InputError
        If there is no load history.
    """
    from matplotlib.colors import ListedColormap
    from matplotlib.patches import Patch

    loading = history_of(solution)
    words = list(STATUS_COLOURS)
    number_of = {int(status): words.index(word) for status, word in STATUS_WORDS.items()}
    table = loading.steps[-1].contact
    own = np.flatnonzero(table.rows(part))
    own = own[np.argsort(table.s[own])]
    numbers = np.array([[number_of[value] for value in step.contact.status[own].tolist()] for step in loading.steps])
    s = table.s[own]
    edges = np.concatenate([s[:1], 0.5 * (s[1:] + s[:-1]), s[-1:]])
    times = np.concatenate([[0.0], loading.times])
    axes = axes_or_new(axes)
    colours = ListedColormap([STATUS_COLOURS[word] for word in words])
    axes.pcolormesh(edges, times, numbers, cmap=colours, vmin=-0.5, vmax=len(words) - 0.5)
    axes.set_xlabel(with_unit(f"arc length $s$ along '{part}'", "length", units or solution.units))
    axes.set_ylabel("time $t$")
    axes.set_title(f"Status over time\n{solution.title}", parse_math=False, fontsize=11)
    handles = [Patch(color=STATUS_COLOURS[word], label=word) for word in words]
    axes.legend(handles=handles, loc="upper left", bbox_to_anchor=(1.0, 1.0), frameon=False, fontsize=9)
    return axes
