"""Displacements and the gap along a contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from bemkit.pictures.contact_axes import FIRST, LIMIT, SECOND, contact_axes, displacement_scale, near
from bemkit.pictures.shown import Result
from bemkit.results.drawing import label_values
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_contact_displacement(
    solution: Result, part: str, axes: Axes | None = None, *, units: UnitNames | None = None
) -> Axes:
    """Draw normal and tangential displacement and the gap along one contact part, above its status.

    Parameters
    ----------
    solution : Solution or AssemblySolution
    part : str
        Name of a contact part, or of a contact of several bodies.
    axes : Axes, optional
        Of matplotlib; those of a new figure by default.
    units : UnitNames, optional
        Those of the scene by default.

    Returns
    -------
    Axes
        The panel; the strip of the status is its child.
    """
    axes, units = contact_axes(axes, solution, part, units, "Displacements on the contact boundary")
    contact, chosen = solution.contact, solution.contact.rows(part)
    s, gap = contact.s[chosen], contact.gap[chosen]
    axes.plot(s, contact.u_n[chosen], label="normal $u_n$", marker="o", markersize=2.0, **FIRST)
    axes.plot(s, contact.u_t[chosen], label="tangential $u_t$", **SECOND)
    if np.any(np.isfinite(gap) & (gap != 0.0)):
        axes.plot(s, near(gap, solution, chosen), label="gap $g$", **LIMIT)
    label_values(axes, with_unit("displacement", "length", units), displacement_scale(solution))
    return axes
