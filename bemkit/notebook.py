"""HTML representation of values in notebooks: a table, and a picture if matplotlib is installed."""

from __future__ import annotations

from importlib import import_module

_MAKER = "bemkit.report.notebook"
"""Imported by all that it shows, and loaded when a notebook first asks, by its name as `bemkit` loads its parts."""


class ShownInNotebooks:
    """A value that `bemkit.report.notebook` knows to show."""

    def _repr_html_(self) -> str:
        """Return a piece of HTML."""
        html: str = import_module(_MAKER).notebook_html(self)
        return html
