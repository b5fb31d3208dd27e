"""Contact pressure and clearance: which of the two there is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bemkit.pictures.contact_axes import FIRST, SECOND, contact_axes, displacement_scale, near, traction_scale
from bemkit.pictures.shown import Result
from bemkit.pictures.traction_curves import traction_curve
from bemkit.results.drawing import ignore_round_off
from bemkit.scene.unit_names import UnitNames, with_unit

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_contact_clearance(
    solution: Result, part: str, axes: Axes | None = None, *, units: UnitNames | None = None
) -> Axes:
    """Draw contact pressure and clearance along one contact part; see `draw_contact_displacement`."""
    axes, units = contact_axes(axes, solution, part, units, "Contact pressure and clearance")
    contact, chosen = solution.contact, solution.contact.rows(part)
    curve = traction_curve(solution, part)
    pressure = axes.plot(curve.s, -curve.normal, label=r"pressure $-\sigma_n$ (left)", **FIRST)
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)
    axes.set_ylabel(with_unit("pressure", "stress", units))
    right = axes.twinx()
    clearance = near(contact.clearance[chosen], solution, chosen)
    opening = right.plot(contact.s[chosen], clearance, label="clearance $g - u_n$ (right)", **SECOND)
    right.set_ylabel(with_unit("clearance", "length", units))
    for each, scale in ((axes, traction_scale(solution)), (right, displacement_scale(solution))):
        ignore_round_off(each, scale)
        bottom, top = each.get_ylim()
        each.set_ylim(bottom, top + 0.15 * (top - bottom))  # room for the legend
    axes.legend(handles=[*pressure, *opening], frameon=False, loc="upper center", ncols=2)
    return axes
