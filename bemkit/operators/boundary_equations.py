"""Boundary equations as a direct solver sees them, and the linear conditions that complete them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bemkit.arrays import BoolArray, ComplexArray, FloatArray, IntArray
from bemkit.errors import InputError
from bemkit.operators.rigid_modes import NULL_TOLERANCE, RigidMotions, orthonormal

if TYPE_CHECKING:
    from scipy.sparse import csr_array


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


@dataclass(frozen=True, eq=False)
class LinearConditions:
    """Two linear conditions ``A_u u + A_t t = c`` at every contact node, or on every element in its frame.

    Parameters
    ----------
    on_displacement : (n_contact, 2, 2) array
        A_u, axes (node, condition, component).
    on_traction : (n_contact, 2, 2) array
        A_t, axes (node, condition, component).
    value : (n_contact, 2) array
        c.

    Raises
    ------
    ValueError
        If the shapes do not fit each other.
    """

    on_displacement: FloatArray
    on_traction: FloatArray
    value: FloatArray

    def __post_init__(self) -> None:
        n_contact = len(self.value)
        if self.value.shape != (n_contact, 2):
            raise InputError(f"value has the shape {self.value.shape}; give (n_contact, 2)")
        for name in ("on_displacement", "on_traction"):
            shape = getattr(self, name).shape
            if shape != (n_contact, 2, 2):
                raise InputError(f"{name} has the shape {shape}; value has {n_contact} nodes, give {(n_contact, 2, 2)}")

    @property
    def n_contact(self) -> int:
        """Number of contact nodes."""
        return len(self.value)

    @classmethod
    def given(cls, is_displacement: BoolArray, traction: FloatArray, displacement: FloatArray) -> LinearConditions:
        """Return conditions that prescribe traction or displacement along each direction; all arrays are (n, 2)."""
        factors = np.where(is_displacement, 1.0, 0.0)[:, :, None] * np.eye(2)
        return cls(factors, np.eye(2) - factors, np.where(is_displacement, displacement, traction))

    def relative_to(self, traction: FloatArray, displacement: FloatArray) -> LinearConditions:
        """Return the conditions for the differences from known tractions and displacements, (n, 2)."""
        fulfilled = np.einsum("nrk,nk->nr", self.on_traction, traction)
        fulfilled += np.einsum("nrk,nk->nr", self.on_displacement, displacement)
        return replace(self, value=self.value - fulfilled)

    def take(self, rows: IntArray) -> LinearConditions:
        """Return the conditions of some nodes or elements."""
        return LinearConditions(self.on_displacement[rows], self.on_traction[rows], self.value[rows])

    def replaced(self, rows: BoolArray, other: LinearConditions) -> LinearConditions:
        """Return these conditions with the marked ones replaced by those of `other`.

        Parameters
        ----------
        rows : (n_contact, 2) bool array
            Marks conditions (normal, tangential) of nodes.
        other : LinearConditions
        """
        return LinearConditions(
            np.where(rows[:, :, None], other.on_displacement, self.on_displacement),
            np.where(rows[:, :, None], other.on_traction, self.on_traction),
            np.where(rows, other.value, self.value),
        )

    def with_given_displacements(self, displacement: FloatArray) -> FloatArray:
        """Return displacements (n_contact, 2) [m] with the exact values of prescribed ones."""
        corrected = displacement.copy()
        for row in (0, 1):
            factor, other = self.on_displacement[:, row, row], self.on_displacement[:, row, 1 - row]
            is_given = (factor != 0.0) & (other == 0.0) & ~self.on_traction[:, row].any(axis=1)
            np.divide(self.value[:, row], factor, out=corrected[:, row], where=is_given)
        return corrected

    def with_given_tractions(self, traction: FloatArray) -> FloatArray:
        """Return tractions (n_contact, 2) [Pa] with the exact values of prescribed ones.

        This includes a component that follows from the other one. Ties such as ``|sigma_t| = s |sigma_n|`` are then
        decided in the same way in all units.
        """
        corrected = traction.copy()
        for row in (0, 1):
            factor = self.on_traction[:, row, row]
            is_given = (factor != 0.0) & ~self.on_displacement[:, row].any(axis=1)
            right_side = self.value[:, row] - self.on_traction[:, row, 1 - row] * corrected[:, 1 - row]
            np.divide(right_side, factor, out=corrected[:, row], where=is_given)
        return corrected

    def free_motions(self, motions: RigidMotions) -> RigidMotions:
        """Return the rigid motions that the conditions do not hold: only tractions are prescribed along them.

        Parameters
        ----------
        motions : (n_motions, n_contact, 2) array, or sparse (n_motions, 2 n_contact) array
            Rigid motions; linearly independent.

        Returns
        -------
        (n_free, n_contact, 2) array, or sparse (n_free, 2 n_contact) array
            A basis, orthonormal if it is dense.
        """
        if not motions.shape[0]:
            return motions
        if not isinstance(motions, np.ndarray):
            return self._sparse_free_motions(motions)
        basis = orthonormal(motions)
        return np.tensordot(self._free_combinations(basis), basis, axes=1)

    def hold(self, basis: FloatArray) -> bool:
        """Whether the conditions hold every combination of orthonormal motions (n_motions, n_contact, 2)."""
        return not len(basis) or bool((np.linalg.svd(self._changes(basis), compute_uv=False) > NULL_TOLERANCE).all())

    def _free_combinations(self, basis: FloatArray) -> FloatArray:
        """Return the combinations (n_free, n_motions) of orthonormal motions that no condition holds."""
        _, singular, directions = np.linalg.svd(np.linalg.qr(self._changes(basis), mode="r"))
        return np.asarray(directions[np.count_nonzero(singular > NULL_TOLERANCE) :])

    def _changes(self, basis: FloatArray) -> FloatArray:
        """Return the changes (2 n_contact, n_motions) of the scaled conditions under orthonormal motions."""
        return np.asarray(self._scaled_on_displacement @ basis.transpose(1, 2, 0)).reshape(-1, len(basis))

    @property
    def _scaled_on_displacement(self) -> FloatArray:
        """(n_contact, 2, 2) array: A_u with the largest factor of each condition scaled to one."""
        largest = np.abs(self.on_displacement).max(axis=2, keepdims=True)
        return np.asarray(self.on_displacement / np.where(largest > 0.0, largest, 1.0))

    def _sparse_free_motions(self, motions: csr_array) -> csr_array:
        from scipy import sparse

        from bemkit.operators.null_space import null_space

        nodes = np.arange(self.n_contact)
        blocks = np.ascontiguousarray(self._scaled_on_displacement)
        conditions = sparse.bsr_array((blocks, nodes, np.arange(self.n_contact + 1)))
        norms = np.sqrt((motions**2).sum(axis=1))
        unit = sparse.csr_array(sparse.diags_array(1.0 / norms) @ motions)
        return sparse.csr_array(null_space(sparse.csr_array(sparse.csr_array(conditions) @ unit.T)) @ unit)

    def regularised(self, displacement: FloatArray, stiffness: float) -> LinearConditions:
        """Return the conditions with weak springs added to those that prescribe only tractions.

        The springs hold a free body near `displacement`. A sequence of such proximal steps [Rockafellar1976] converges
        to a solution without forces in the springs.

        Parameters
        ----------
        displacement : (n_contact, 2) array [m]
            Displacement at which the springs carry no force.
        stiffness : float [Pa/m]
        """
        spring = np.where(np.any(self.on_displacement != 0.0, axis=2), 0.0, stiffness)
        return LinearConditions(
            self.on_displacement + spring[:, :, None] * np.eye(2),
            self.on_traction,
            self.value + spring * displacement,
        )

    def softened(self, stiffness: float) -> LinearConditions:
        """Return the conditions with springs between nodes and the displacements that conditions prescribe.

        Parameters
        ----------
        stiffness : float [Pa/m]
        """
        yields = ~np.any(self.on_traction != 0.0, axis=2)
        springs = np.abs(self.on_displacement).max(axis=2) / stiffness
        return LinearConditions(
            self.on_displacement,
            self.on_traction + np.where(yields, springs, 0.0)[:, :, None] * np.eye(2),
            self.value,
        )
