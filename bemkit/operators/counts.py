"""Operation counts, which are the same on every computer.

The code that does the work counts it and returns the count with its result; nothing is collected behind the scenes.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any


class FactorKind(enum.Enum):
    """How a matrix is factored."""

    CHOLESKY = "Cholesky"
    LU = "LU"


@dataclass(frozen=True)
class Factorisation:
    """One factorisation of a dense matrix.

    Parameters
    ----------
    kind : FactorKind
    order : int
        Rows of the matrix.
    """

    kind: FactorKind
    order: int


@dataclass(frozen=True)
class Entries:
    """Entries of the matrix of one boundary operator.

    Parameters
    ----------
    computed : int
        Real numbers that were evaluated, or assembled, from integrals of the kernel.
    stored : int
        Real numbers that were kept of it, in a matrix of its own or as columns of a larger one.
    """

    computed: int = 0
    stored: int = 0

    @classmethod
    def full(cls, n_rows: int, n_columns: int) -> Entries:
        """Return the count of a matrix that is computed and stored as a whole."""
        return cls(n_rows * n_columns, n_rows * n_columns)

    def __add__(self, other: Entries) -> Entries:
        """Return both counts together."""
        return Entries(self.computed + other.computed, self.stored + other.stored)


@dataclass(frozen=True)
class OperationCounts:
    """Counts of what a body took to compute.

    Parameters
    ----------
    element_pairs : int
        Pairs of a test element (a collocation point) and a trial element whose integrals were evaluated.
    single_layer, double_layer, hypersingular : Entries
        Of V, K and W.
    factorisations : tuple of Factorisation
        Of the body, in their order; those of the contact system are counted by ``Solution.linear_solves``.
    right_hand_sides : int
        Columns for which these factorisations were solved, fields recovered from a solution aside.
    contact_unknowns : int
        Order of the system that every contact step solves.
    """

    element_pairs: int = 0
    single_layer: Entries = Entries()
    double_layer: Entries = Entries()
    hypersingular: Entries = Entries()
    factorisations: tuple[Factorisation, ...] = ()
    right_hand_sides: int = 0
    contact_unknowns: int = 0

    def __add__(self, other: OperationCounts) -> OperationCounts:
        """Return the work of both, one after the other."""
        return OperationCounts(
            self.element_pairs + other.element_pairs,
            self.single_layer + other.single_layer,
            self.double_layer + other.double_layer,
            self.hypersingular + other.hypersingular,
            self.factorisations + other.factorisations,
            self.right_hand_sides + other.right_hand_sides,
            self.contact_unknowns + other.contact_unknowns,
        )

    def as_dict(self) -> dict[str, Any]:
        """Return the counts as JSON can hold them."""
        factorisations = [{"kind": one.kind.value, "order": one.order} for one in self.factorisations]
        operators = {name: dict(vars(value)) for name, value in vars(self).items() if isinstance(value, Entries)}
        return {**vars(self), **operators, "factorisations": factorisations}
