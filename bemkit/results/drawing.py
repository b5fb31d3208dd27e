"""What all figures share: colours, frames without ornament, and panels along the boundary.

Drawn with matplotlib's object interface, so that no display and no global state is involved.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# the colours of Okabe and Ito, which people with colour-vision deficiencies can tell apart
BLUE, VERMILION, GREEN, PURPLE, ORANGE, SKY = "#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"
GREY = "#9A9A9A"


def new_figure(width: float, height: float) -> Figure:
    """Return an empty figure whose parts keep clear of each other; sizes in inches."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width, height), layout="constrained")


def panel_above_strip(title: str, abscissa: str, *, parse_math: bool = True) -> tuple[Figure, Axes, Axes]:
    """Return a figure with a large panel above a strip of the same abscissa, which shows what lies along it."""
    figure = new_figure(7.0, 4.6)
    axes, strip = figure.subplots(2, 1, sharex=True, height_ratios=[9, 1])
    axes.ticklabel_format(axis="y", scilimits=(-2, 3), useMathText=True)
    axes.tick_params(labelbottom=False)
    axes.set_title(title, parse_math=False, fontsize=11)
    strip.set_ylim(0.0, 1.0)
    strip.set_yticks([])
    strip.set_xlabel(abscissa, parse_math=parse_math)
    return figure, axes, strip


def label_values(axes: Axes, name: str) -> None:
    """Name what is drawn, with a legend and a line at zero."""
    axes.axhline(0.0, color="black", linewidth=0.6, zorder=0)
    axes.set_ylabel(name)
    axes.legend(frameon=False)


def show_grid(axes: Axes) -> None:
    """Draw thin lines at the main ticks instead of a frame."""
    axes.grid(visible=True, which="major", color="#E5E5E5", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
