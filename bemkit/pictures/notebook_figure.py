"""Figures that notebooks show without pyplot."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure


class NotebookFigure(Figure):
    """A figure with the image that a notebook shows."""

    def _repr_png_(self) -> bytes:
        """Return the image."""
        stream = BytesIO()
        self.savefig(stream, format="png", dpi=96)
        return stream.getvalue()
