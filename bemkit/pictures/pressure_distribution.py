"""The distribution of pressures on a contact."""

from __future__ import annotations

from bemkit.pictures.contact_axes import FIRST
from bemkit.pictures.drawing import Axes, axes_or_new, show_grid
from bemkit.results.pressure_distribution import pressure_shares
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import unit_of, with_unit


def draw_pressure_distribution(solution: Solution, part: str, axes: Axes | None = None) -> Axes:
    """Draw the probability density of the pressures on one contact that are not zero.

    The area below is the share of the contact that touches, which the title states. See
    `bemkit.pictures.contact_curves.draw_contact_displacement` for the parameters.
    """
    from bemkit.pictures.number_axis import PlainNumbers

    units, axes = solution.units, axes_or_new(axes, 5.6, 4.0)
    shares = list(pressure_shares(solution.contact, part))
    edges = [0.0, *(each.pressure_to for each in shares)]
    axes.stairs([each.density for each in shares], edges, fill=True, alpha=0.3, color=FIRST["color"])
    axes.stairs([each.density for each in shares], edges, **FIRST)
    touching = 100.0 * sum(each.share for each in shares)
    axes.set_title(
        f"Pressures on '{part}', {touching:.3g} % in contact\n{solution.title}", parse_math=False, fontsize=11
    )
    axes.set_xlabel(with_unit("pressure", "stress", units))
    unit = unit_of("stress", units)
    axes.set_ylabel(f"probability density [1/{unit}]" if unit else "probability density")
    for axis in (axes.xaxis, axes.yaxis):
        axis.set_major_formatter(PlainNumbers())
    axes.set_xlim(left=0.0)
    axes.set_ylim(bottom=0.0)
    show_grid(axes)
    return axes
