"""Boundary equations as a direct solver sees them: entries between nodes, and what they cause and feel far away."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

from bemkit.arrays import ComplexArray, FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Border:
    """Unknowns c and equations of the boundary as a whole.

    Parameters
    ----------
    errors : (2 n_nodes, n_border) array
        Columns of the additional unknowns in the equations.
    balances : (n_border, 4 n_nodes) array
        Additional equations: balances @ (t_x, t_y, u_x, u_y of all nodes) + own @ c = 0.
    own : (n_border, n_border) array
    """

    errors: FloatArray
    balances: FloatArray
    own: FloatArray


class BoundaryEquations(Protocol):
    """Linear equations E (t, u) + R c = 0 and B (t, u) + D c = 0, before supports, loads or contact are known.

    Nodes are numbered in the order of a tree. Rows are 2 * node + component, columns 4 * node + 2 * kind + component,
    kind 0 for the tractions t and 1 for the displacements u of the node. All arrays of rows or columns are ascending.
    """

    @property
    def points(self) -> ComplexArray:
        """(n,) array [m]: where the equations of each node hold."""

    @property
    def supports(self) -> ComplexArray:
        """(m, n) array [m]: points whose hull holds all that the unknowns of each node act on, the point among them."""

    @property
    def lengths(self) -> FloatArray:
        """(n,) array [m]: the part of the boundary that each node represents."""

    @property
    def border(self) -> Border:
        """R, B and D."""

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return entries (n_rows, n_columns) of E."""

    def fields(self, x: ComplexArray, columns: IntArray) -> FloatArray:
        """Return displacements (2 n_points, n_columns) that columns cause away from the nodes, as on a proxy circle."""

    def under_forces(self, x: ComplexArray, rows: IntArray) -> FloatArray:
        """Return what rows feel of unit forces along x and y at some points, (2 n_points, n_rows), up to one factor."""

    def residual(self, nodes: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return E (t, u) at some nodes, (n, 2), without any compression; tractions, displacements: (n_nodes, 2)."""
