"""How the solver came to its result: the worst violation of all conditions over its steps."""

from __future__ import annotations

import numpy as np

from bemkit.pictures.drawing import BLUE, VERMILION, Axes, axes_or_new, show_grid
from bemkit.results.solution import Solution


def draw_convergence(solution: Solution, axes: Axes | None = None) -> Axes:
    """Draw the largest violation in the certificate, and how many nodes changed their status, over the linear solves.

    Parameters
    ----------
    solution : Solution
    axes : Axes, optional
        Of matplotlib; those of a new figure by default.
    """
    axes = axes_or_new(axes, 6.4, 3.6)
    solves = np.array([record.linear_solves for record in solution.history])
    worst = np.array([record.certificate.worst for record in solution.history])
    changed = np.array([record.n_changed for record in solution.history])
    axes.semilogy(solves, np.maximum(worst, np.finfo(float).tiny), color=BLUE, marker="o", markersize=3.5)
    axes.set_xlabel("linear solves")
    axes.set_ylabel("largest violation of a condition", color=BLUE)
    axes.set_ylim(bottom=max(1e-18, 0.1 * float(worst[worst > 0.0].min(initial=1.0))))
    show_grid(axes)
    right = axes.twinx()
    right.plot(solves, changed, color=VERMILION, linestyle="--", marker="s", markersize=3.0)
    right.set_ylabel("nodes that changed their status", color=VERMILION)
    right.set_ylim(0.0, 1.05 * max(1, int(changed.max(initial=0))))
    for place in (axes.xaxis, right.yaxis):
        place.get_major_locator().set_params(integer=True)  # type: ignore[call-arg]
    axes.set_title(f"Convergence\n{solution.title}", parse_math=False, fontsize=11)
    return axes
