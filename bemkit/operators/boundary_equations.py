"""Boundary equations as a direct solver sees them: entries between nodes, and far fields of rows and columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from bemkit.arrays import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Border:
    """Additional unknowns c and equations that belong to the boundary as a whole.

    Parameters
    ----------
    errors : (2 n_nodes, n_border) array
        Columns of the additional unknowns in the equations.
    balances : (n_border, 4 n_nodes) array
        Additional equations: balances @ (t_x, t_y, u_x, u_y of all nodes) = 0.
    """

    errors: FloatArray
    balances: FloatArray


class BoundaryEquations(Protocol):
    """Linear equations E (t, u) + R c = 0 and B (t, u) = 0, independent of supports, loads and contact.

    Nodes are numbered in the order of a tree. Rows are 2 * node + component, columns 4 * node + 2 * kind + component,
    kind 0 for the tractions t and 1 for the displacements u of the node. All arrays of rows or columns are ascending.
    """

    @property
    def points(self) -> ComplexArray:
        """(n,) array [m]: the collocation point of each node."""

    @property
    def supports(self) -> ComplexArray:
        """(m, n) array [m]: points whose convex hull contains the support of each node's unknowns and its point."""

    @property
    def lengths(self) -> FloatArray:
        """(n,) array [m]: the length of boundary that each node represents."""

    @property
    def border(self) -> Border:
        """R and B."""

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of E."""

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_columns) of columns at points away from the nodes."""

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return the displacements (2 n_points, n_rows) at rows under unit forces along x and y at some points.

        They are scaled by a common factor.
        """

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the uncompressed E (t, u) at some nodes, (n, 2), for fields (n_nodes, 2)."""
