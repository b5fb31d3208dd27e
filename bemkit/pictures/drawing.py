"""Common style of all figures: colours, plain frames, and axes that ignore round-off.

Drawn with matplotlib's object interface, so that no display and no global state is involved.
"""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from matplotlib.axes import Axes as Axes
    from matplotlib.figure import Figure as Figure
else:
    Axes = Figure = Any  # matplotlib is loaded when something is drawn

# the colours of Okabe and Ito, which people with colour-vision deficiencies can distinguish
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
GREY = "#9A9A9A"
COLOURS = (BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY)
LINES: tuple[Any, ...] = ("-", (0, (5, 2)), (0, (1, 1.5)), (0, (5, 1, 1, 1)))
"""Styles of series, in their order."""
CLEAR: Mapping[str, Any] = MappingProxyType({"framealpha": 0.85, "edgecolor": "none", "borderpad": 0.2})
"""Style of legends that stay readable over curves."""

_NOISE = 1e-6
"""Variation that is drawn as none, relative to the scale of a quantity: round-off may grow to 1e-10."""
_FLAT = 0.05
"""Half the range of an axis for a constant, relative to the scale of the quantity."""


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure whose parts keep clear of each other; sizes in inches."""
    from bemkit.pictures.notebook_figure import NotebookFigure

    return NotebookFigure(figsize=(width, height), layout="constrained")


def axes_or_new(axes: Axes | None, width: float = 7.0, height: float = 4.6) -> Axes:
    """Return the axes that are given, or those of a new figure; sizes in inches."""
    return new_figure(width, height).add_subplot() if axes is None else axes


def label_values(axes: Axes, name: str, scale: float = 0.0) -> None:
    """Name what is drawn, with a legend and a line at zero; see `ignore_round_off`."""
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)
    axes.set_ylabel(name)
    ignore_round_off(axes, scale)
    axes.legend(**CLEAR)


def ignore_round_off(axes: Axes, scale: float, axis: Literal["x", "y"] = "y") -> None:
    """Widen the range of values where they do not vary but by round-off, so that these lines are flat.

    Parameters
    ----------
    axes : Axes
    scale : float
        Size of the quantity where it matters: the largest value of the whole result, say.
    axis : {"x", "y"}
        Position of the values.
    """
    from bemkit.pictures.number_axis import PlainNumbers

    low, high = axes.dataLim.intervaly if axis == "y" else axes.dataLim.intervalx
    if 0.0 <= high - low < _NOISE * scale:  # of the values: axes of a single one are widened by matplotlib
        middle = 0.5 * (low + high)
        flat = middle - _FLAT * scale, middle + _FLAT * scale
        _ = axes.set_ylim(flat) if axis == "y" else axes.set_xlim(flat)
    (axes.yaxis if axis == "y" else axes.xaxis).set_major_formatter(PlainNumbers())


BELOW = "below"
"""Mark of legends below axes, which take fewer columns where the figure is narrow."""


def legend_below(axes: Axes, n_columns: int = 3, size: float = 9.0) -> None:
    """Put the legend below the axes, clear of the label of the abscissa; the size of its text is in points.

    Of artists with equal labels the first has the entry.
    """
    from matplotlib.transforms import ScaledTranslation

    scale = axes.get_figure(root=True).dpi_scale_trans  # type: ignore[union-attr]
    below = axes.transAxes + ScaledTranslation(0.0, -0.5, scale)
    place: dict[str, Any] = {"loc": "upper center", "bbox_to_anchor": (0.5, 0.0), "bbox_transform": below}
    handles, labels = axes.get_legend_handles_labels()
    shown = [handles[labels.index(label)] for label in dict.fromkeys(labels)]
    axes.legend(handles=shown, **place, ncols=n_columns, frameon=False, fontsize=size).set_gid(BELOW)


def show_grid(axes: Axes) -> None:
    """Draw thin lines at the main ticks instead of a frame."""
    axes.grid(visible=True, which="major", color="#E5E5E5", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
