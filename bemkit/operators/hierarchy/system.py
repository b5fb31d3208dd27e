"""Boundary equations under supports, loads and conditions of contact, compressed and factored."""

from __future__ import annotations

import itertools
from collections.abc import Iterable
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.hierarchy.equations import BoundaryEquations
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.dense import SingularMatrixError

_PREFERRED = 0.1
"""A condition is solved for a quantity of its own direction as long as the best choice is not ten times better."""
_KNOWN = np.array(list(itertools.combinations(range(4), 2)))
"""(6, 2): the pairs of (t_1, t_2, u_1, u_2) for which two conditions can be solved."""
_UNKNOWN = np.array([sorted(set(range(4)) - set(pair), key=lambda k: k % 2) for pair in _KNOWN.tolist()])
"""(6, 2): the others, those along the first direction before those along the second one."""


@dataclass(frozen=True, eq=False)
class ElementLaws:
    """Local conditions of each element: (t_x, t_y, u_x, u_y) = factors @ z + given.

    Parameters
    ----------
    factors : (n_elements, 4, 2) array
    given : (n_elements, 4) array
    """

    factors: FloatArray
    given: FloatArray

    def take(self, rows: IntArray) -> ElementLaws:
        """Return those of some elements."""
        return ElementLaws(self.factors[rows], self.given[rows])


def solve_for_two(
    on_traction: FloatArray, on_displacement: FloatArray, value: FloatArray, displacement_unit: float
) -> tuple[ElementLaws, BoolArray]:
    """Solve two conditions a node for two of its four quantities; the other two remain unknown.

    Parameters
    ----------
    on_traction, on_displacement : (n, 2, 2) arrays
        Axes node, condition, component.
    value : (n, 2) array
    displacement_unit : float [m/Pa]
        Typical displacement per traction, by which the choice compares the two.

    Returns
    -------
    laws : ElementLaws
        What the conditions were solved for follows exactly, the others are z.
    is_determined : (n,) bool array
        Whether the conditions are two; the laws of other nodes are zero.
    """
    conditions = np.concatenate([on_traction, on_displacement], axis=2)
    scaled = conditions * np.array([1.0, 1.0, displacement_unit, displacement_unit])
    sizes = np.abs(scaled).max(axis=2, keepdims=True)
    scaled = scaled / np.where(sizes > 0.0, sizes, 1.0)
    determinants = np.stack(
        [np.abs(scaled[:, 0, i] * scaled[:, 1, j] - scaled[:, 0, j] * scaled[:, 1, i]) for i, j in _KNOWN], axis=1
    )
    best = determinants.max(axis=1)
    own = np.where(_KNOWN[:, 0] % 2 != _KNOWN[:, 1] % 2, determinants, 0.0)
    choice = np.where(own.max(axis=1) >= _PREFERRED * best, own.argmax(axis=1), determinants.argmax(axis=1))
    nodes = np.flatnonzero(best > 0.0)
    of_known, of_unknown = (
        np.take_along_axis(conditions[nodes], pairs[choice[nodes], None, :], axis=2) for pairs in (_KNOWN, _UNKNOWN)
    )
    inverse, rows = _inverse(of_known), nodes[:, None]
    known, unknown = _KNOWN[choice[nodes]], _UNKNOWN[choice[nodes]]
    factors, given = np.zeros((len(value), 4, 2)), np.zeros((len(value), 4))
    factors[rows, known], factors[rows, unknown, [0, 1]] = -inverse @ of_unknown, 1.0
    given[rows, known] = (inverse @ value[nodes, :, None])[:, :, 0]
    return ElementLaws(factors, given), best > 0.0


def _inverse(matrices: FloatArray) -> FloatArray:
    """Return the inverses of (n, 2, 2) matrices, exact where they are diagonal."""
    (a, b), (c, d) = matrices.transpose(1, 2, 0)
    determinant = a * d - b * c
    adjoint: FloatArray = np.stack([np.stack([d, -b], axis=-1), np.stack([-c, a], axis=-1)], axis=-2)
    return np.asarray(adjoint / determinant[:, None, None])


@dataclass(frozen=True, eq=False)
class NodeConditions:
    """Two linear conditions ``A_t t + A_u u = c`` at some elements, in the frames of these.

    Parameters
    ----------
    on_traction, on_displacement : (n, 2, 2) arrays
        Axes element, condition, component.
    value : (n, 2) array
    """

    on_traction: FloatArray
    on_displacement: FloatArray
    value: FloatArray

    @classmethod
    def given(cls, is_displacement: BoolArray, traction: FloatArray, displacement: FloatArray) -> NodeConditions:
        """Return conditions that prescribe one of the two along each direction; all arrays are (n, 2)."""
        unit = np.eye(2)
        return cls(
            np.where(is_displacement, 0.0, 1.0)[:, :, None] * unit,
            np.where(is_displacement, 1.0, 0.0)[:, :, None] * unit,
            np.where(is_displacement, displacement, traction),
        )

    def beside(self, traction: FloatArray, displacement: FloatArray) -> NodeConditions:
        """Return the right-hand sides after known tractions and displacements, (n, 2) in the frames."""
        known = np.einsum("nrk,nk->nr", self.on_traction, traction)
        known += np.einsum("nrk,nk->nr", self.on_displacement, displacement)
        return replace(self, value=self.value - known)

    def take(self, elements: IntArray) -> NodeConditions:
        """Return those at some of the elements."""
        return NodeConditions(self.on_traction[elements], self.on_displacement[elements], self.value[elements])

    def solved(self, displacement_unit: float) -> ElementLaws:
        """Return tractions and displacements under these conditions, in the frames of elements; see `solve_for_two`.

        Raises
        ------
        UndeterminedError
            If the two conditions at an element are not independent.
        """
        laws, is_determined = solve_for_two(self.on_traction, self.on_displacement, self.value, displacement_unit)
        if not is_determined.all():
            raise UndeterminedError("the two conditions at a contact node are not independent")
        return laws


class UndeterminedError(SingularMatrixError):
    """Two conditions at an element that are only one."""


class BodyFactor(Protocol):
    """Solves boundary equations over a tree under conditions that may change; see `Factor`."""

    @property
    def tree(self) -> ClusterTree:
        """Its order numbers everything else."""

    @property
    def equations(self) -> BoundaryEquations:
        """The equations."""

    @property
    def laws(self) -> ElementLaws | None:
        """The conditions on all elements."""

    @property
    def n_updates(self) -> int:
        """How often conditions were taken over."""

    def expect(self, given: Iterable[FloatArray]) -> None:
        """Announce, before the first `update`, the loads of the laws."""

    def update(self, laws: ElementLaws) -> None:
        """Take over the conditions on all elements."""

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves."""

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2, k) of the elements of some leaves if nothing is given but in one leaf."""

    def errors(self) -> FloatArray:
        """Return the unknowns (n_border,) of the boundary as a whole."""


class HierarchicalSystem:
    """Boundary equations over a tree, with two conditions on each element along its own directions.

    Parameters
    ----------
    factor : BodyFactor
    frame : (n_elements, 2, 2) array
        Rows are the directions of the conditions of each element.
    displacement_unit : float [m/Pa]
        Displacement by traction of a single element.
    """

    def __init__(self, factor: BodyFactor, frame: FloatArray, displacement_unit: float) -> None:
        self.factor, self._tree, self._order, self._unit = factor, factor.tree, factor.tree.order, displacement_unit
        self._place = np.empty_like(self._order)
        self._place[self._order] = np.arange(self._order.size)
        self._frame = frame

    @property
    def n_answers(self) -> int:
        """How often conditions were asked for; what is known everywhere belongs to the last ones."""
        return self.factor.n_updates

    def expect(self, given: Iterable[FloatArray]) -> None:
        """Announce, before the first `state`, the loads of `laws`, (n_elements, 4) each: their sums are then cheap."""
        self.factor.expect(given)

    def state(self, known: ElementLaws, elements: IntArray, conditions: NodeConditions) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements, (n, 4), in their frames.

        Parameters
        ----------
        known : ElementLaws
            Of all other elements, by `laws`.
        elements : (n,) array
        conditions : NodeConditions
            Of these elements.

        Raises
        ------
        UndeterminedError
            If conditions of an element are not independent.
        SingularMatrixError
            If the conditions do not determine the response.
        """
        factors, given = known.factors, known.given
        places = self._place[elements]
        local = conditions.solved(self._unit)
        if elements.size:
            own = turned(local, self._frame[elements])
            factors, given = factors.copy(), given.copy()
            factors[places], given[places] = own.factors, own.given
        self.factor.update(ElementLaws(factors, given))
        leaves = self._tree.leaves_of(places)
        unknowns = np.empty((self._order.size, 2))
        unknowns[self._places_in(leaves)] = self.factor.unknowns(leaves)
        state: FloatArray = (local.factors @ unknowns[places, :, None])[:, :, 0] + local.given
        return state

    def responses(self, known: ElementLaws, moved: IntArray, elements: IntArray) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2) of some elements, (n, 4, n_moved), under unit displacements of others one by one.

        Parameters
        ----------
        known : ElementLaws
            Of all elements, by `laws`; values there are ignored.
        moved : (n_moved,) array
            Directions 2 * element + direction that `known` holds fast.
        elements : (n,) array
        """
        self.factor.update(known)
        places = self._place[elements]
        leaves = self._tree.leaves_of(places)
        at = np.searchsorted(self._places_in(leaves), places)
        result = np.empty((elements.size, 4, moved.size))
        moved_place, unit = self._place[moved // 2], self._frame[moved // 2, moved % 2]
        for leaf in self._tree.leaves_of(moved_place).tolist():
            own = self._tree.places(0, leaf)
            columns = np.flatnonzero((moved_place >= own.start) & (moved_place < own.stop))
            given = np.zeros((own.stop - own.start, 4, columns.size))
            given[moved_place[columns] - own.start, 2:, np.arange(columns.size)] = unit[columns]
            unknowns = self.factor.responses(leaf, given, leaves)[at]
            states = np.einsum("nqz,nzk->nqk", known.factors[places], unknowns)
            is_own = np.flatnonzero((places >= own.start) & (places < own.stop))
            states[is_own] += given[places[is_own] - own.start]
            result[:, :, columns] = states
        local: FloatArray = np.concatenate(
            [np.einsum("nkc,ncm->nkm", self._frame[elements], each) for each in (result[:, :2], result[:, 2:])], axis=1
        )
        return local

    def everywhere(self) -> tuple[FloatArray, FloatArray]:
        """Return tractions and displacements (n_elements, 2) in x and y under the conditions of the last `state`."""
        laws = self.factor.laws
        assert laws is not None  # `state` comes first
        unknowns = self.factor.unknowns(np.arange(self._tree.n_leaves))
        states = ((laws.factors @ unknowns[:, :, None])[:, :, 0] + laws.given)[self._place]
        return states[:, :2], states[:, 2:]

    def residual(self, elements: IntArray, traction: FloatArray, displacement: FloatArray) -> FloatArray:
        """Return the residual (n, 2) of the equations of some elements, without any compression, as displacements.

        Parameters
        ----------
        elements : (n,) array
        traction, displacement : (n_elements, 2) arrays
            As `everywhere` has returned them.
        """
        places, equations = self._place[elements], self.factor.equations
        by_place = traction[self._order], displacement[self._order]
        errors = equations.border.errors.reshape(self._order.size, 2, -1)[places] @ self.factor.errors()
        residual: FloatArray = equations.residual(places, *by_place) + errors
        return residual

    def laws(self, conditions: NodeConditions) -> ElementLaws:
        """Return what conditions on all elements make of their tractions and displacements, by place, in x and y."""
        return turned(conditions.solved(self._unit), self._frame).take(self._order)

    def _places_in(self, leaves: IntArray) -> IntArray:
        return np.concatenate([np.zeros(0, np.intp), *(np.r_[self._tree.places(0, leaf)] for leaf in leaves.tolist())])


def turned(laws: ElementLaws, frame: FloatArray) -> ElementLaws:
    """Return laws along directions, the rows of (n, 2, 2), in x and y."""
    turn = np.zeros((len(frame), 4, 4))
    turn[:, :2, :2] = turn[:, 2:, 2:] = frame.transpose(0, 2, 1)
    return ElementLaws(turn @ laws.factors, (turn @ laws.given[:, :, None])[:, :, 0])
