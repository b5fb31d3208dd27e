"""Operation counts, which do not depend on the computer.

The code that does the work returns the count with its result; there are no global counters.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Any


class FactorKind(enum.Enum):
    """Kind of a matrix factorisation."""

    CHOLESKY = "Cholesky"
    LU = "LU"


@dataclass(frozen=True)
class Factorisation:
    """One factorisation of a dense matrix.

    Parameters
    ----------
    kind : FactorKind
    order : int
        Number of rows of the matrix.
    """

    kind: FactorKind
    order: int


@dataclass(frozen=True)
class Entries:
    """Number of entries of the matrix of one boundary operator.

    Parameters
    ----------
    computed : int
        Entries that were evaluated or assembled.
    stored : int
        Entries that were stored, in their own matrix or as columns of a larger one.
    """

    computed: int = 0
    stored: int = 0

    @classmethod
    def full(cls, n_rows: int, n_columns: int) -> Entries:
        """Return the count of a matrix that is completely computed and stored."""
        return cls(n_rows * n_columns, n_rows * n_columns)

    def __add__(self, other: Entries) -> Entries:
        """Return the sum of both counts."""
        return Entries(self.computed + other.computed, self.stored + other.stored)


@dataclass(frozen=True)
class OperationCounts:
    """Operation counts of the computation of a body.

    Parameters
    ----------
    element_pairs : int
        Pairs of a test element (a collocation point) and a trial element whose integrals were evaluated.
    single_layer, double_layer, hypersingular : Entries
        Entries of V, K and W.
    factorisations : tuple of Factorisation
        Factorisations of the body, in order; ``Solution.linear_solves`` counts those of the contact system.
    right_hand_sides : int
        Right-hand sides of these factorisations, without recovered fields.
    contact_unknowns : int
        Order of the system of a contact step.
    """

    element_pairs: int = 0
    single_layer: Entries = Entries()
    double_layer: Entries = Entries()
    hypersingular: Entries = Entries()
    factorisations: tuple[Factorisation, ...] = ()
    right_hand_sides: int = 0
    contact_unknowns: int = 0

    def __add__(self, other: OperationCounts) -> OperationCounts:
        """Return the sum of both counts."""
        pairs = zip(vars(self).values(), vars(other).values(), strict=True)
        return OperationCounts(*(one + two for one, two in pairs))

    def as_dict(self) -> dict[str, Any]:
        """Return the counts as a JSON object."""
        factorisations = [{"kind": factor.kind.value, "order": factor.order} for factor in self.factorisations]
        operators = {name: dict(vars(value)) for name, value in vars(self).items() if isinstance(value, Entries)}
        return {**vars(self), **operators, "factorisations": factorisations}
