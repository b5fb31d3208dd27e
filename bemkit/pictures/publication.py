"""Figures of a given width for print: text of one size, no title, which belongs into the caption."""

from __future__ import annotations

from typing import TYPE_CHECKING

from bemkit.pictures.drawing import BELOW, CLEAR, legend_below

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.transforms import Bbox

_MILLIMETRES = 25.4
_TEXT = 7.0
"""Size of all text [points]."""
_THINNER = 0.75
"""Thickness of lines and size of markers, by those on screen."""
_COLUMN = 42.0
"""Width of a column of a legend [mm]."""
_EDGE = 0.03
"""Empty edge above and below [inch]."""


def fitted(figure: Figure, width: float) -> Bbox:
    """Change a figure to a width [mm] and return the part of it [inch] that holds all it shows, as wide as that."""
    from matplotlib.lines import Line2D
    from matplotlib.text import Text
    from matplotlib.transforms import Bbox

    inches = width / _MILLIMETRES
    old_width, old_height = figure.get_size_inches()
    figure.set_size_inches(inches, old_height * inches / old_width)
    for axes in figure.axes:
        for each in (axes, *axes.child_axes):
            each.set_title("")  # type: ignore[attr-defined]
            each.tick_params(labelsize=_TEXT)
        if (legend := axes.get_legend()) is None:
            continue
        if legend.get_gid() == BELOW:
            legend_below(axes, max(1, min(3, int(width / _COLUMN))), _TEXT)
        else:
            handles, labels = legend.legend_handles, [text.get_text() for text in legend.get_texts()]
            axes.legend(handles, labels, fontsize=_TEXT, **CLEAR)  # type: ignore[arg-type]
    for text in figure.findobj(Text):
        text.set_fontsize(_TEXT)
    for line in figure.findobj(Line2D):
        line.set_linewidth(_THINNER * line.get_linewidth())
        line.set_markersize(_THINNER * line.get_markersize())
    figure.draw_without_rendering()
    tight = figure.get_tightbbox()
    return Bbox([[0.0, tight.y0 - _EDGE], [inches, tight.y1 + _EDGE]])
