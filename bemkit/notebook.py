"""HTML representation of values in notebooks, and the ways to explore a result from Python.

What is shown and written comes from modules that import the results: they are loaded by name on first use.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

_MAKER = "bemkit.report.notebook"
"""Imported by all that it shows, and loaded when a notebook first asks, by its name as `bemkit` loads its parts."""


class ShownInNotebooks:
    """A value that `bemkit.report.notebook` knows to show."""

    def _repr_html_(self) -> str:
        """Return a piece of HTML."""
        html: str = import_module(_MAKER).notebook_html(self)
        return html


class Explorable(ShownInNotebooks):
    """A result that is printed as its summary, drawn, written and tabulated."""

    def __str__(self) -> str:
        """Return the summary that the command line prints."""
        text: str = import_module("bemkit.results.summary_rows").summary_text(self)
        return text

    def plot(self, what: str = "deformation", part: str | None = None) -> Any:
        """Draw a picture.

        Parameters
        ----------
        what : str
            Name of a picture, such as ``"von-mises"``; see `bemkit.pictures.catalogue`.
        part : str, optional
            Contact of a picture along contacts, required if there are several.

        Returns
        -------
        matplotlib.figure.Figure
            Notebooks show it.

        Raises
        ------
        InputError
            If the name is unknown, the result does not have what the picture shows, or the contact is not named.
        """
        return import_module("bemkit.pictures.catalogue").plot(self, what, part)

    def save(self, path: str | Path, *, inside: int = 0) -> None:
        """Write the result in the format of the ending; see `bemkit.results.export.export_result`."""
        import_module("bemkit.results.export").export_result(path, self, inside=inside)

    def to_pandas(self, table: str = "contact") -> Any:
        """Return a table as a pandas data frame: ``contact``, ``boundary``, ``history``, ``steps``, ``forces``."""
        return import_module("bemkit.results.tables").table_of(self, table).to_pandas()

    def to_pyvista(self, inside: int = 40) -> Any:
        """Return boundaries, contact nodes and fields inside as a grid of pyvista, to draw and explore.

        Parameters
        ----------
        inside : int
            Points across each body at which there are fields inside; 0 for none.

        Returns
        -------
        pyvista.UnstructuredGrid
            With the data of a ``.vtu`` file; see `bemkit.results.vtk.write_vtk`.

        Raises
        ------
        InputError
            If pyvista is not installed, or `inside` is neither 0 nor from 2 to 1000.
        """
        return import_module("bemkit.results.export").to_pyvista(self, inside)

    @property
    def forces(self) -> Any:
        """Table of the resultants on the parts of all bodies."""
        return import_module("bemkit.results.tables").table_of(self, "forces")
