"""Displacements, tractions and clearance along a contact, each a panel above the status; and its friction cone."""

from __future__ import annotations

import numpy as np

from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.contact_axes import (
    FIRST,
    LIMIT,
    SECOND,
    STATUS_COLOURS,
    contact_axes,
    cut_peaks,
    displacement_scale,
    near,
    traction_scale,
)
from bemkit.pictures.crowds import MANY, marked
from bemkit.pictures.drawing import BLUE, VERMILION, Axes, axes_or_new, ignore_round_off, label_values, show_grid
from bemkit.pictures.traction_curves import traction_curve
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import with_unit


def draw_contact_displacement(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw normal and tangential displacement and the gap along one contact part, above its status.

    Contacts on horizontal lines are drawn over x, with slip and friction positive along x; others over the arc length
    of the boundary, positive along it.

    Parameters
    ----------
    solution : Solution
    part : str
        Name of a contact part, or of a contact of several bodies.
    axes : Axes, optional
        Of matplotlib; those of a new figure by default.

    Returns
    -------
    Axes
        The panel; the strip of the status is its child.
    """
    axes, units = contact_axes(axes, solution, part, "Displacements on the contact boundary"), solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    abscissa = Abscissa.along(solution, part)
    s, gap = abscissa.at(contact.s[chosen]), contact.gap[chosen]
    marker = "o" if s.size <= MANY else ""
    axes.plot(s, contact.u_n[chosen], label="normal $u_n$", marker=marker, markersize=2.0, **FIRST)
    axes.plot(s, abscissa.sign * contact.u_t[chosen], label="tangential $u_t$", **SECOND)
    if np.any(np.isfinite(gap) & (gap != 0.0)):
        axes.plot(s, near(gap, solution, chosen), label="gap $g$", **LIMIT)
    label_values(axes, with_unit("displacement", "length", units), displacement_scale(solution))
    return axes


def draw_contact_traction(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw normal and tangential traction and the friction bound; see `draw_contact_displacement`.

    Lines are the tractions of the discretisation: steps where they are constant on each element, straight or curved
    where they are of higher degree. Dots are the values at contact nodes, where the conditions of contact hold, if
    there are no more than `bemkit.pictures.crowds.MANY`. Peaks that would flatten all else are cut, and the picture
    says so.
    """
    axes, units = contact_axes(axes, solution, part, "Tractions on the contact boundary"), solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    abscissa, curve = Abscissa.along(solution, part), traction_curve(solution, part)
    s, along = abscissa.at(contact.s[chosen]), abscissa.at(curve.s)
    axes.plot(along, curve.normal, label=r"normal $\sigma_n$", **FIRST)
    axes.plot(along, abscissa.sign * curve.tangential, label=r"tangential $\sigma_t$", **SECOND)
    if s.size <= MANY:
        axes.plot(s, contact.sigma_n[chosen], linestyle="", marker="o", markersize=2.5, color=BLUE)
        axes.plot(s, abscissa.sign * contact.sigma_t[chosen], linestyle="", marker="o", markersize=2.0, color=VERMILION)
    if solution.friction_bound is not None:
        axes.plot(s, solution.friction_bound[chosen], label="friction bound", **LIMIT)
        axes.plot(s, -solution.friction_bound[chosen], **LIMIT)
    label_values(axes, with_unit("traction", "stress", units), traction_scale(solution))
    # below is the legend
    cut_peaks(axes, along, (curve.normal, abscissa.sign * curve.tangential), units, note_on_top=True)
    return axes


def draw_contact_clearance(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw contact pressure and clearance along one contact part; see `draw_contact_displacement`.

    Peaks of the pressure are cut as those of tractions in `draw_contact_traction`.
    """
    axes, units = contact_axes(axes, solution, part, "Contact pressure and clearance"), solution.units
    contact, chosen = solution.contact, solution.contact.rows(part)
    abscissa, curve = Abscissa.along(solution, part), traction_curve(solution, part)
    along = abscissa.at(curve.s)
    pressure = axes.plot(along, -curve.normal, label=r"pressure $-\sigma_n$ (left)", **FIRST)
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)
    axes.set_ylabel(with_unit("pressure", "stress", units))
    right = axes.twinx()
    clearance = near(contact.clearance[chosen], solution, chosen)
    opening = right.plot(abscissa.at(contact.s[chosen]), clearance, label="clearance $g - u_n$ (right)", **SECOND)
    right.set_ylabel(with_unit("clearance", "length", units))
    for each, scale in ((axes, traction_scale(solution)), (right, displacement_scale(solution))):
        ignore_round_off(each, scale)
    cut_peaks(axes, along, (-curve.normal,), units)
    for each in (axes, right):
        bottom, top = each.get_ylim()
        each.set_ylim(bottom, top + 0.15 * (top - bottom))  # room for the legend
    axes.legend(handles=[*pressure, *opening], frameon=False, loc="upper center", ncols=2)
    return axes


def draw_friction_cone(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw the tractions of the nodes of one contact over its pressures, within the friction bound.

    Nodes that stick lie between the bounds, nodes that slip on one of them. Where the coefficient varies along the
    contact, each node has a bound of its own.

    See `draw_contact_displacement`.
    """
    axes, units = axes_or_new(axes, 5.6, 4.6), solution.units
    table, rows = solution.contact, solution.contact.rows(part)
    pressure, scale = -table.sigma_n, traction_scale(solution)
    friction = Abscissa.along(solution, part).sign * table.sigma_t
    if solution.friction_bound is not None:
        nodes = np.flatnonzero(rows)[np.argsort(pressure[rows])]
        bound = solution.friction_bound[nodes]
        is_line = bool(np.all(np.diff(bound) >= -1e-9 * scale))
        style = LIMIT if is_line else {**LIMIT, "linestyle": "", "marker": "_", "markersize": 4.0}
        axes.plot(pressure[nodes], bound, label="friction bound", **style)
        axes.plot(pressure[nodes], -bound, **style)
    words = np.array(table.status_words())
    for word, colour in STATUS_COLOURS.items():
        chosen = np.stack([pressure, friction], axis=1)[rows & (words == word)]
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
