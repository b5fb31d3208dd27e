"""Two linear conditions at each contact node, and the rigid motions that they do not hold.

Components are (n, t): index 0 along the outward normal, index 1 along the tangent. The first condition of a node is the
normal one, the second the tangential one.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import BoolArray, FloatArray
from bemkit.errors import InputError
from bemkit.operators.rigid_modes import NULL_TOLERANCE

if TYPE_CHECKING:
    from scipy.sparse import csr_array

    RigidMotions: TypeAlias = FloatArray | csr_array
else:
    RigidMotions = "FloatArray | csr_array"


def as_rows(motions: RigidMotions) -> RigidMotions:
    """Return motions, dense or sparse, with one row (2 n_contact,) for each motion."""
    if isinstance(motions, np.ndarray) and motions.ndim == 3:
        return motions.reshape(len(motions), 2 * motions.shape[1])
    return motions


def as_dense(motions: RigidMotions, n_contact: int) -> FloatArray:
    """Return motions as a dense array (n_motions, n_contact, 2)."""
    return motions if isinstance(motions, np.ndarray) else np.asarray(motions.toarray()).reshape(-1, n_contact, 2)


def largest_components(motions: RigidMotions) -> FloatArray:
    """Return the largest component (n_motions,) of each motion."""
    rows = as_rows(motions)
    if isinstance(rows, np.ndarray):
        return np.asarray(np.abs(rows).max(axis=1, initial=0.0))
    return np.asarray(abs(rows).max(axis=1).toarray(), dtype=float).ravel()


def of_unit_size(motions: RigidMotions) -> tuple[RigidMotions, FloatArray]:
    """Return motions, one in each row, of largest component one, and the sizes (n_motions,) that divide them."""
    sizes = largest_components(motions)
    sizes = np.where(sizes > 0.0, sizes, 1.0)  # motions of bodies that touch nothing stay zero
    return motions / sizes[:, None] if isinstance(motions, np.ndarray) else (motions.T / sizes).T.tocsr(), sizes


def orthonormal(motions: FloatArray) -> FloatArray:
    """Return orthonormal motions (n_motions, n_contact, 2) with the span of linearly independent ones."""
    return np.asarray(np.linalg.qr(motions.reshape(len(motions), 2 * motions.shape[1]).T)[0]).T.reshape(motions.shape)


@dataclass(frozen=True, eq=False)
class LinearConditions:
    """Two linear conditions ``A_u u + A_t t = c`` at every contact node.

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


def separated(n_contact: int) -> LinearConditions:
    """Return the conditions of open nodes: ``t = 0``."""
    return LinearConditions(np.zeros((n_contact, 2, 2)), _unit_blocks(n_contact), np.zeros((n_contact, 2)))


def stick(gap: FloatArray, reference_slip: FloatArray) -> LinearConditions:
    """Return the conditions of sticking nodes: ``u_n = g``, ``u_t = reference_slip``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    reference_slip : (n_contact,) array [m]
        Tangential displacement without slip (zero for the static law).
    """
    n_contact = len(gap)
    value = np.stack([gap, reference_slip], axis=1)
    return LinearConditions(_unit_blocks(n_contact), np.zeros((n_contact, 2, 2)), value)


def slip(
    gap: FloatArray, direction: FloatArray, bound_slope: FloatArray, bound_intercept: FloatArray
) -> LinearConditions:
    """Return the conditions of slipping nodes: ``u_n = g``, ``t_t = -direction * bound(t_n)``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
    direction : (n_contact,) array
        +1 for slip along the tangent (``u_t > 0``), -1 against it.
    bound_slope : (n_contact,) array [-]
        Derivative of the friction bound, ``-s`` for Coulomb's law.
    bound_intercept : (n_contact,) array [Pa]
        The linearised bound is ``bound_slope * t_n + bound_intercept``.

    Notes
    -----
    Algorithm 2 of the paper prints the slip traction with the opposite sign; the sign here follows from equation (16).
    """
    n_contact = len(gap)
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, 0, 0] = 1.0
    on_traction = np.zeros((n_contact, 2, 2))
    on_traction[:, 1, 0] = direction * bound_slope
    on_traction[:, 1, 1] = 1.0
    return LinearConditions(on_displacement, on_traction, np.stack([gap, -direction * bound_intercept], axis=1))


def of_statuses(
    is_closed: BoolArray, slips: BoolArray, sticking: LinearConditions, sliding: LinearConditions
) -> LinearConditions:
    """Return the conditions of nodes in different statuses.

    Parameters
    ----------
    is_closed, slips : (n_contact,) bool arrays
        Closed nodes have the normal condition of `sticking`, open nodes ``t_n = 0``. Slipping nodes have the tangential
        condition of `sliding`, the others that of `sticking`.
    sticking, sliding : LinearConditions
    """
    conditions = separated(len(is_closed)).replaced(np.stack([is_closed, ~slips], axis=1), sticking)
    return conditions.replaced(np.stack([np.zeros_like(slips), slips], axis=1), sliding)


def augmented(
    gap: FloatArray, reference_slip: FloatArray, multiplier: FloatArray, rho_n: float, rho_t: float
) -> LinearConditions:
    """Return the augmented conditions of closed, sticking nodes: ``t + rho (u - u_0) = multiplier``.

    Parameters
    ----------
    gap : (n_contact,) array [m]
        Normal part of u_0.
    reference_slip : (n_contact,) array [m]
        Tangential part of u_0.
    multiplier : (n_contact, 2) array [Pa]
        sigma^(k) of Algorithm 1, constant in an inner loop.
    rho_n, rho_t : float [Pa/m]
    """
    n_contact = len(gap)
    rho = np.array([rho_n, rho_t])
    on_displacement = np.zeros((n_contact, 2, 2))
    on_displacement[:, [0, 1], [0, 1]] = rho
    value = multiplier + rho * np.stack([gap, reference_slip], axis=1)
    return LinearConditions(on_displacement, _unit_blocks(n_contact), value)


def _unit_blocks(n_contact: int) -> FloatArray:
    return np.full((n_contact, 2, 2), np.eye(2))
