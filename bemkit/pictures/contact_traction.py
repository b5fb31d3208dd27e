"""Tractions and the friction bound along a contact."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bemkit.pictures.contact_axes import FIRST, LIMIT, SECOND, contact_axes, cut_peaks, traction_scale
from bemkit.pictures.shown import Result
from bemkit.pictures.traction_curves import traction_curve
from bemkit.results.drawing import BLUE, VERMILION, label_values
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_contact_traction(
    solution: Result, part: str, axes: Axes | None = None, *, units: UnitNames | None = None
) -> Axes:
    """Draw normal and tangential traction and the friction bound; see `draw_contact_displacement`.

    Lines are the tractions of the discretisation: steps where they are constant on each element, straight or curved
    where they are of higher degree. Dots are the values at contact nodes, where the conditions of contact hold. Peaks
    that would flatten all else are cut, and the picture says so.
    """
    axes, units = contact_axes(axes, solution, part, units, "Tractions on the contact boundary")
    contact, chosen = solution.contact, solution.contact.rows(part)
    s, curve = contact.s[chosen], traction_curve(solution, part)
    axes.plot(curve.s, curve.normal, label=r"normal $\sigma_n$", **FIRST)
    axes.plot(curve.s, curve.tangential, label=r"tangential $\sigma_t$", **SECOND)
    axes.plot(s, contact.sigma_n[chosen], linestyle="", marker="o", markersize=2.5, color=BLUE)
    axes.plot(s, contact.sigma_t[chosen], linestyle="", marker="o", markersize=2.0, color=VERMILION)
    if solution.friction_bound is not None:
        axes.plot(s, solution.friction_bound[chosen], label="friction bound", **LIMIT)
        axes.plot(s, -solution.friction_bound[chosen], **LIMIT)
    label_values(axes, with_unit("traction", "stress", units), traction_scale(solution))
    cut_peaks(axes, curve.s, (curve.normal, curve.tangential), units)
    return axes
