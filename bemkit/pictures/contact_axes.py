"""Axes along a contact: a panel of values above a strip that shows the status."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise
from types import MappingProxyType
from typing import Any

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.pictures.abscissa import Abscissa
from bemkit.pictures.drawing import BLUE, GREY, ORANGE, VERMILION, Axes, axes_or_new
from bemkit.results.solution import Solution
from bemkit.scene.unit_names import UnitNames, amount

STATUS_COLOURS: Mapping[str, str] = MappingProxyType({"separated": "#D9D9D9", "slip": ORANGE, "stick": BLUE})
_STATUS_TEXT: Mapping[str, str] = MappingProxyType({"separated": "#333333", "slip": "#000000", "stick": "#FFFFFF"})
FIRST: Mapping[str, Any] = MappingProxyType({"color": BLUE, "linewidth": 1.6})
SECOND: Mapping[str, Any] = MappingProxyType({"color": VERMILION, "linestyle": "--", "linewidth": 1.6})
LIMIT: Mapping[str, Any] = MappingProxyType({"color": "black", "linestyle": ":", "linewidth": 1.2})
_MOST_LINES = 40
"""Largest number of transitions that lines mark; more would hide the strip of the status."""
_PEAKED, _SHORT = 2.5, 0.015
"""Peaks are cut if the range of tractions is larger by this factor than on all but this share of the length."""
_NAMED = 0.12
"""Least length of a zone that has room for its name, relative to the contact."""


def contact_axes(axes: Axes | None, solution: Solution, part: str, subject: str) -> Axes:
    """Return axes above a strip that shows the status along a contact.

    Parameters
    ----------
    axes : Axes or None
        Those of a new figure by default.
    solution : Solution
    part : str
        Name of the contact part, or of the contact of several bodies.
    subject : str
        First line of the title.
    """
    axes = axes_or_new(axes)
    strip = axes_with_strip(axes, f"{subject}\n{solution.title}")
    abscissa = Abscissa.along(solution, part)
    abscissa.write_below(strip, solution.units)
    _draw_status(strip, solution, part, abscissa)
    places = [abscissa.at(transition.s) for transition in solution.transitions if transition.part == part]
    for place in places if len(places) <= _MOST_LINES else ():
        axes.axvline(place, color=GREY, linestyle="-", linewidth=0.8, zorder=0)
    return axes


def axes_with_strip(axes: Axes, title: str) -> Axes:
    """Put a strip of the same abscissa below axes, which shows what lies along it, and return the strip."""
    strip = axes.inset_axes((0.0, -0.11, 1.0, 0.08), sharex=axes)
    axes.tick_params(labelbottom=False)
    axes.set_title(title, parse_math=False, fontsize=11)
    strip.set_ylim(0.0, 1.0)
    strip.set_yticks([])
    return strip


def _draw_status(strip: Axes, solution: Solution, part: str, abscissa: Abscissa) -> None:
    """Paint the status along a part; name it where there is room, and in a legend where there is none."""
    from matplotlib.patches import Patch

    chosen = solution.contact.rows(part)
    length = solution.part_length(part)
    transitions = [transition for transition in solution.transitions if transition.part == part]
    first = solution.contact.status_words()[int(np.flatnonzero(chosen)[0])]
    if transitions and part in solution.contact.circumferences:  # the last zone goes on beyond the seam
        first = transitions[-1].to_status
    words = [first, *(transition.to_status for transition in transitions)]
    edges = [0.0, *(transition.s for transition in transitions), length]
    named = set()
    for (first_s, last_s), word in zip(pairwise(edges), words, strict=True):
        begin, end = sorted((abscissa.at(first_s), abscissa.at(last_s)))
        strip.axvspan(begin, end, color=STATUS_COLOURS[word], linewidth=0)
        if end - begin > _NAMED * length:
            style: dict[str, Any] = {"ha": "center", "va": "center", "fontsize": 9, "color": _STATUS_TEXT[word]}
            strip.text((begin + end) / 2.0, 0.5, word, **style)
            named.add(word)
    handles = [Patch(color=colour, label=word) for word, colour in STATUS_COLOURS.items() if word in {*words} - named]
    if handles:
        place = (1.0, -1.8)  # below the name of the abscissa
        strip.legend(handles=handles, loc="upper right", bbox_to_anchor=place, ncols=3, frameon=False, fontsize=9)
    strip.set_xlim(*sorted((abscissa.at(0.0), abscissa.at(length))))


def cut_peaks(
    axes: Axes, s: FloatArray, curves: Sequence[FloatArray], units: UnitNames | None, *, note_on_top: bool = False
) -> None:
    """Cut off peaks that flatten all else, such as those at corners, where tractions are infinite, and say so.

    Parameters
    ----------
    axes : Axes
    s : (n,) array [m]
        Ascending or descending.
    curves : sequence of (n,) arrays [Pa]
        Tractions there.
    units : UnitNames or None
    note_on_top : bool
        Whether the note on the cut is at the upper end of the axes instead of the lower one.
    """
    weights = np.abs(np.gradient(s))
    low, high, least, largest = 0.0, 0.0, 0.0, 0.0
    for values in curves:
        order = np.argsort(values)
        share = np.cumsum(weights[order]) / weights.sum()
        first, last = np.minimum(np.searchsorted(share, [_SHORT, 1.0 - _SHORT]), values.size - 1).tolist()
        low, high = min(low, float(values[order[first]])), max(high, float(values[order[last]]))
        least, largest = min(least, float(values.min())), max(largest, float(values.max()))
    if largest - least <= _PEAKED * (high - low) or high == low:
        return
    margin = 0.25 * (high - low)
    bottom, top = low - margin, high + margin
    axes.set_ylim(bottom, top)
    cut = ((least < bottom, "down to", least), (largest > top, "up to", largest))
    words = [f"{way} {amount(peak, 'stress', units)}" for is_cut, way, peak in cut if is_cut]
    note = f"peaks {' and '.join(words)} are cut"
    height, anchor = (0.98, "top") if note_on_top else (0.02, "bottom")
    axes.text(0.5, height, note, transform=axes.transAxes, ha="center", va=anchor, fontsize=9)


def near(distance: FloatArray, solution: Solution, chosen: BoolArray) -> FloatArray:
    """Blank out distances to the obstacle that are much larger than the displacements and the smallest distance."""
    contact = solution.contact
    sizes = [np.abs(component[chosen]).max() for component in (contact.u_n, contact.u_t)]
    nearest = np.abs(distance).min()
    largest = 2.0 * max(*sizes, nearest if np.isfinite(nearest) else 0.0)
    return np.where(np.abs(distance) <= largest, distance, np.nan)


def displacement_scale(solution: Solution) -> float:
    """Return the largest relative displacement or finite gap of any contact node [m]."""
    contact = solution.contact
    columns = (contact.u_n, contact.u_t, np.where(np.isfinite(contact.gap), contact.gap, 0.0))
    return max(float(np.abs(column).max(initial=0.0)) for column in columns)


def traction_scale(solution: Solution) -> float:
    """Return the largest contact traction [Pa]."""
    contact = solution.contact
    return max(float(np.abs(column).max(initial=0.0)) for column in (contact.sigma_n, contact.sigma_t))
