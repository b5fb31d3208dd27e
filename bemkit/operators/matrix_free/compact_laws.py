"""Tractions and displacements of all elements under their conditions, in a few bytes for each element.

On most elements each condition gives one quantity of its own: which, and its value, is all there is to keep. Only where
one quantity follows from others, as friction from pressure, its coefficients are kept as well.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bemkit.arrays import BoolArray, FloatArray, IntArray
from bemkit.operators.hierarchy.element_laws import KNOWN, UNKNOWN, ElementLaws, SolvedConditions


@dataclass(frozen=True, eq=False)
class CompactLaws:
    """Two of (t_1, t_2, u_1, u_2) on each element, along its own directions, that follow from the other two.

    Parameters
    ----------
    choice : (n_elements,) int8 array
        Which two; see `SolvedConditions`.
    given : (n_elements, 2) array
    coupled : (n_coupled,) array
        Elements whose quantities depend on each other, ascending.
    coupling : (n_coupled, 2, 2) array
    """

    choice: IntArray
    given: FloatArray
    coupled: IntArray
    coupling: FloatArray

    @classmethod
    def of(cls, solved: SolvedConditions) -> CompactLaws:
        """Return the laws of all elements."""
        coupled = np.flatnonzero(solved.coupling.any(axis=(1, 2)))
        return cls(solved.choice, solved.given, coupled, solved.coupling[coupled])

    @classmethod
    def joined(cls, parts: list[CompactLaws]) -> CompactLaws:
        """Return the laws of elements that follow each other."""
        begins = np.cumsum([0, *(each.choice.size for each in parts)])[:-1]
        return cls(
            np.concatenate([each.choice for each in parts]),
            np.concatenate([each.given for each in parts]),
            np.concatenate([begin + each.coupled for begin, each in zip(begins, parts, strict=True)]),
            np.concatenate([each.coupling for each in parts]),
        )

    def replaced(self, elements: IntArray, solved: SolvedConditions) -> CompactLaws:
        """Return the same laws but for some elements, ascending."""
        choice, given = self.choice.copy(), self.given.copy()
        choice[elements], given[elements] = solved.choice, solved.given
        kept = ~np.isin(self.coupled, elements)
        is_coupled = solved.coupling.any(axis=(1, 2))
        coupled = np.concatenate([self.coupled[kept], elements[is_coupled]])
        coupling = np.concatenate([self.coupling[kept], solved.coupling[is_coupled]])
        order = np.argsort(coupled, kind="stable")
        return CompactLaws(choice, given, coupled[order], coupling[order])

    def has_factors_of(self, other: CompactLaws) -> bool:
        """Whether the same quantities follow in the same way, but for what is given."""
        return (
            np.array_equal(self.choice, other.choice)
            and np.array_equal(self.coupled, other.coupled)
            and np.array_equal(self.coupling, other.coupling)
        )

    def is_traction(self, elements: IntArray) -> BoolArray:
        """Return (n, 2) which unknowns of some elements are tractions."""
        return np.asarray(UNKNOWN < 2)[self.choice[elements]]

    def unknowns(self, elements: IntArray, state: FloatArray) -> FloatArray:
        """Return the two of (t_1, t_2, u_1, u_2), (n, 4), that are unknown on some elements."""
        return np.asarray(np.take_along_axis(state, UNKNOWN[self.choice[elements]], axis=1))

    def state(self, elements: IntArray, unknowns: FloatArray, *, is_change: bool = False) -> FloatArray:
        """Return (t_1, t_2, u_1, u_2), (n, 4), of some elements from their unknowns (n, 2).

        Parameters
        ----------
        elements : (n,) array
        unknowns : (n, 2) array
        is_change : bool
            Whether nothing is given.
        """
        choice, rows = self.choice[elements], np.arange(elements.size)[:, None]
        known = np.zeros((elements.size, 2)) if is_change else self.given[elements]
        row, number = self._coupled_among(elements)
        known[row] += np.einsum("nij,nj->ni", self.coupling[number], unknowns[row])
        state = np.empty((elements.size, 4))
        state[rows, KNOWN[choice]], state[rows, UNKNOWN[choice]] = known, unknowns
        return state

    def take(self, elements: IntArray) -> ElementLaws:
        """Return what some elements follow from in full."""
        units = np.broadcast_to(np.eye(2)[:, None], (2, elements.size, 2))
        factors = np.stack([self.state(elements, unit, is_change=True) for unit in units], axis=2)
        return ElementLaws(factors, self.state(elements, np.zeros((elements.size, 2))))

    def _coupled_among(self, elements: IntArray) -> tuple[IntArray, IntArray]:
        """Return which of some elements are coupled, and their numbers among all that are."""
        number = np.searchsorted(self.coupled, elements)
        row = np.flatnonzero(np.append(self.coupled, -1)[number] == elements)
        return row, number[row]
