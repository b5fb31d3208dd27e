"""Boundary equations under supports, loads and conditions of contact, compressed and factored."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.geometry.proximity.cluster_tree import ClusterTree
from bemkit.operators.boundary_equations import BoundaryEquations, LinearConditions
from bemkit.operators.linear_solvers import SingularMatrixError

_PREFERRED = 0.1
"""One quantity of each direction is eliminated unless the determinant of another pair is ten times larger."""
_KNOWN = np.array(list(itertools.combinations(range(4), 2)))
"""(6, 2): the pairs of (t_1, t_2, u_1, u_2) for which two conditions can be solved."""
_UNKNOWN = np.array([sorted(set(range(4)) - set(pair), key=lambda k: k % 2) for pair in _KNOWN.tolist()])
"""(6, 2): the remaining quantities of each pair, those along the first direction first."""


@dataclass(frozen=True, eq=False)
class LocalConditions:
    """Conditions of each element, solved for two unknowns z: (t_x, t_y, u_x, u_y) = factors @ z + given.

    Parameters
    ----------
    factors : (n_elements, 4, 2) array
    given : (n_elements, 4) array
    """

    factors: FloatArray
    given: FloatArray

    def take(self, rows: IntArray) -> LocalConditions:
        """Return the conditions of some elements."""
        return LocalConditions(self.factors[rows], self.given[rows])


def _inverse(matrices: FloatArray) -> FloatArray:
    """Return the inverses of (n, 2, 2) matrices, exact where they are diagonal."""
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    determinant = a * d - b * c
    adjoint: FloatArray = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray(adjoint / determinant[:, None, None])


def solved(conditions: LinearConditions, displacement_unit: float) -> LocalConditions:
    """Solve the two conditions of each element for two of its four quantities, in its frame.

    The other two become the unknowns z.

    Parameters
    ----------
    conditions : LinearConditions
    displacement_unit : float [m/Pa]
        Typical displacement per traction; makes the determinants of different pairs comparable.

    Raises
    ------
    UndeterminedError
        If the two conditions at an element are not independent.
    """
    both = np.concatenate([conditions.on_traction, conditions.on_displacement], axis=2)
    scaled = both * np.array([1.0, 1.0, displacement_unit, displacement_unit])
    sizes = np.abs(scaled).max(axis=2, keepdims=True)
    scaled = scaled / np.where(sizes > 0.0, sizes, 1.0)
    determinants = np.stack(
        [np.abs(scaled[:, 0, i] * scaled[:, 1, j] - scaled[:, 0, j] * scaled[:, 1, i]) for i, j in _KNOWN], axis=1
    )
    best = determinants.max(axis=1)
    if not np.all(best > 0.0):
        raise UndeterminedError("the two conditions at a contact node are not independent")
    of_both_directions = np.where(_KNOWN[:, 0] % 2 != _KNOWN[:, 1] % 2, determinants, 0.0)
    is_preferred = of_both_directions.max(axis=1) >= _PREFERRED * best
    choice = np.where(is_preferred, of_both_directions.argmax(axis=1), determinants.argmax(axis=1))
    known, unknown = _KNOWN[choice], _UNKNOWN[choice]
    of_known, of_unknown = (np.take_along_axis(both, pair[:, None], axis=2) for pair in (known, unknown))
    inverse, n = _inverse(of_known), len(choice)
    factors, given, rows = np.zeros((n, 4, 2)), np.zeros((n, 4)), np.arange(n)[:, None]
    factors[rows, known], factors[rows, unknown, [0, 1]] = -inverse @ of_unknown, 1.0
    given[rows, known] = (inverse @ conditions.value[:, :, None])[:, :, 0]
    return LocalConditions(factors, given)


class UndeterminedError(SingularMatrixError):
    """The two conditions of an element are linearly dependent."""


class BodyFactor(Protocol):
    """Solves boundary equations over a tree under conditions that may change; see `Factor`."""

    @property
    def tree(self) -> ClusterTree:
        """The tree; all arrays of elements are in its order."""

    @property
    def equations(self) -> BoundaryEquations:
        """The equations."""

    @property
    def conditions(self) -> LocalConditions | None:
        """The latest conditions on all elements."""

    @property
    def n_updates(self) -> int:
        """Number of calls of `update`; `HierarchicalSystem.full_state` belongs to the last one."""

    def prepare(self, loads: Iterable[FloatArray]) -> None:
        """Announce, before the first `update`, given parts (n_elements, 4): responses to their sums are then cheap."""

    def update(self, conditions: LocalConditions) -> None:
        """Set the conditions on all elements."""

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves."""

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2, k) of the elements of some leaves under k loads that act on one leaf only."""

    def errors(self) -> FloatArray:
        """Return the border unknowns (n_border,)."""


class HierarchicalSystem:
    """Boundary equations over a tree, with two conditions on each element in the frame of the element.

    Parameters
    ----------
    factor : BodyFactor
    frame : (n_elements, 2, 2) array
        Rows are the two directions of each element.
    displacement_unit : float [m/Pa]
        Displacement per traction of a single element.
    """

    def __init__(self, factor: BodyFactor, frame: FloatArray, displacement_unit: float) -> None:
        self.factor, self._tree, self._order, self._unit = factor, factor.tree, factor.tree.order, displacement_unit
        self._position = np.empty_like(self._order)
        self._position[self._order] = np.arange(self._order.size)
        self._frame = frame

    def state(self, known: LocalConditions, elements: IntArray, conditions: LinearConditions) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements, (n, 4), in their frames.

        Parameters
        ----------
        known : LocalConditions
            Conditions of all other elements, from `local_conditions`.
        elements : (n,) array
        conditions : LinearConditions
            Conditions of these elements.

        Raises
        ------
        UndeterminedError
            If the conditions of an element are not independent.
        SingularMatrixError
            If the conditions do not determine the response.
        """
        factors, given = known.factors, known.given
        positions = self._position[elements]
        local = solved(conditions, self._unit)
        if elements.size:
            in_plane = rotated(local, self._frame[elements])
            factors, given = factors.copy(), given.copy()
            factors[positions], given[positions] = in_plane.factors, in_plane.given
        self.factor.update(LocalConditions(factors, given))
        leaves = self._tree.leaves_of(positions)
        unknowns = np.empty((self._order.size, 2))
        unknowns[self._positions_in(leaves)] = self.factor.unknowns(leaves)
        state: FloatArray = (local.factors @ unknowns[positions, :, None])[:, :, 0] + local.given
        return state

    def responses(self, known: LocalConditions, directions: IntArray, elements: IntArray) -> FloatArray:
        """Return the states of some elements under a unit displacement of each of some directions.

        Parameters
        ----------
        known : LocalConditions
            Conditions of all elements, from `local_conditions`; the given parts are ignored.
        directions : (n_directions,) array
            Directions 2 * element + component that `known` holds fast.
        elements : (n,) array

        Returns
        -------
        (n, 4, n_directions) array
            (t_1, t_2, u_1, u_2) in the frames of the elements.
        """
        self.factor.update(known)
        positions = self._position[elements]
        leaves = self._tree.leaves_of(positions)
        rows = np.searchsorted(self._positions_in(leaves), positions)
        result = np.empty((elements.size, 4, directions.size))
        moved, unit = self._position[directions // 2], self._frame[directions // 2, directions % 2]
        for leaf in self._tree.leaves_of(moved).tolist():
            in_leaf = self._tree.positions(0, leaf)
            columns = np.flatnonzero((moved >= in_leaf.start) & (moved < in_leaf.stop))
            given = np.zeros((in_leaf.stop - in_leaf.start, 4, columns.size))
            given[moved[columns] - in_leaf.start, 2:, np.arange(columns.size)] = unit[columns]
            unknowns = self.factor.responses(leaf, given, leaves)[rows]
            states = np.einsum("nqz,nzk->nqk", known.factors[positions], unknowns)
            is_in_leaf = np.flatnonzero((positions >= in_leaf.start) & (positions < in_leaf.stop))
            states[is_in_leaf] += given[positions[is_in_leaf] - in_leaf.start]
            result[:, :, columns] = states
        halves = result[:, :2], result[:, 2:]
        local: FloatArray = np.concatenate(
            [np.einsum("nkc,ncm->nkm", self._frame[elements], quantity) for quantity in halves], axis=1
        )
        return local

    def full_state(self) -> tuple[FloatArray, FloatArray]:
        """Return tractions and displacements (n_elements, 2) in x and y under the conditions of the last `state`."""
        conditions = self.factor.conditions
        assert conditions is not None  # `state` comes first
        unknowns = self.factor.unknowns(np.arange(self._tree.n_leaves))
        states = ((conditions.factors @ unknowns[:, :, None])[:, :, 0] + conditions.given)[self._position]
        return states[:, :2], states[:, 2:]

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the residual of the uncompressed equations of some elements.

        Parameters
        ----------
        elements : (n,) array
        traction, displacement : (n_elements, 2) arrays
            From `full_state`.

        Returns
        -------
        (n, 2) array [m]
        """
        positions, equations = self._position[elements], self.factor.equations
        in_tree_order = traction[self._order], displacement[self._order]
        errors = equations.border.errors.reshape(self._order.size, 2, -1)[positions] @ self.factor.errors()
        residual: FloatArray = equations.residual(positions, *in_tree_order) + errors
        return residual

    def local_conditions(self, conditions: LinearConditions) -> LocalConditions:
        """Solve conditions on all elements; return them in x and y, in the order of the tree."""
        return rotated(solved(conditions, self._unit), self._frame).take(self._order)

    def _positions_in(self, leaves: IntArray) -> IntArray:
        return np.concatenate(
            [np.zeros(0, np.intp), *(np.r_[self._tree.positions(0, leaf)] for leaf in leaves.tolist())]
        )


def rotated(local: LocalConditions, frame: FloatArray) -> LocalConditions:
    """Return conditions in frames, whose directions are the rows of (n, 2, 2), in x and y instead."""
    rotation = np.zeros((len(frame), 4, 4))
    rotation[:, :2, :2] = rotation[:, 2:, 2:] = frame.transpose(0, 2, 1)
    return LocalConditions(rotation @ local.factors, (rotation @ local.given[:, :, None])[:, :, 0])
