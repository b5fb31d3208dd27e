"""What a tree asks of boundary equations, whatever their method is."""

from __future__ import annotations

from typing import Protocol

from bemkit.arrays import ComplexArray, FloatArray, IntArray


class Columns(Protocol):
    """Boundary equations by place, in the order of a tree; two for each place.

    Rows are numbered 2 * place + component, unknowns 4 * place + 2 * kind + component, kind 0 for tractions and 1 for
    displacements.
    """

    @property
    def is_symmetric(self) -> bool:
        """Whether the rows of a skeleton belong to its columns, and the entries between two are symmetric."""

    @property
    def n_elements(self) -> int:
        """Number of places."""

    @property
    def order(self) -> IntArray:
        """(n_places,) array: the number of the element or dof at each place."""

    @property
    def start(self) -> ComplexArray:
        """(n_places,) complex array [m]: where each element, or the function of each dof, begins."""

    @property
    def centre(self) -> ComplexArray:
        """(n_places,) complex array [m]."""

    @property
    def end(self) -> ComplexArray:
        """(n_places,) complex array [m]."""

    @property
    def lengths(self) -> FloatArray:
        """(n_places,) array [m]: of the elements."""

    @property
    def reach(self) -> IntArray:
        """(k, n_places) places on which each element acts."""

    @property
    def sizes(self) -> FloatArray:
        """(n_places,) array by which the equations become displacements."""

    def felt(self, columns: IntArray) -> IntArray:
        """Return those of some columns that equations of other places feel."""

    def beside(self, places: IntArray) -> IntArray:
        """Return the places whose equations are examined with those of some places."""

    def entries(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of the equations."""

    def applied(self, places: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return what is left (n, 2) of the equations of some places, nothing compressed.

        Parameters
        ----------
        places : (n,) array
        traction, displacement : (n_places, 2) arrays
            By place.
        """
