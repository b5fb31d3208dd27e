"""The choice between the loops of numpy and compiled ones for the pairs of a dense matrix.

The compiled loops are those of compressed equations (`bemkit.operators.hierarchy.element_pairs`), for linear and for
quadratic elements. They are taken where that saves more than loading numba costs, and never before they are compiled.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from bemkit.arrays import IntArray
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.hierarchy import compiled
from bemkit.operators.hierarchy.element_pairs import ElementPairs
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import PairSweep, row_slices, rows_per_chunk

MANY_INTEGRALS = 4_000_000
"""Integrals of one kind of all pairs from which loading numba pays, which takes about a second (measured)."""
LARGEST_DEGREE = 2


def why(degrees: Degrees, n_pairs: int) -> tuple[bool, str]:
    """Return whether the compiled loops are taken for a number of pairs, and the reason in one line."""
    p = degrees.n_trial[0]
    if p > LARGEST_DEGREE or degrees != _galerkin(p):
        return False, "for linear and quadratic elements of one degree"
    if n_pairs * p * p < MANY_INTEGRALS:
        return False, "loading numba takes longer than these elements in numpy"
    if not compiled.is_installed():
        return False, compiled.why()
    if not compiled.is_cached("bemkit.operators.hierarchy.compiled_pairs"):
        return False, "not compiled yet: bemkit warm-up does it"
    return True, "the integrals of so many elements are worth loading numba"


def sweep_over(mesh: BoundaryMesh, degrees: Degrees, test: IntArray, trial: IntArray) -> PairSweep | CompiledSweep:
    """Return the faster sweep over the pairs of test elements of a mesh and trial elements of the whole boundary."""
    is_ascending = bool((np.diff(test) > 0).all() and (np.diff(trial) > 0).all())
    if is_ascending and why(degrees, test.size * trial.size)[0] and compiled.functions() is not None:
        return CompiledSweep(ElementPairs.of(mesh, degrees.n_trial[0]), test, trial)
    return PairSweep(mesh.whole, degrees, test, trial)


def _galerkin(p: int) -> Degrees:
    """Return what V, K and W need together for displacements of degree p."""
    return Degrees(log=(p - 1, p - 1), double=(p - 1, p))


@dataclass(frozen=True, eq=False)
class CompiledSweep:
    """What `PairSweep` delivers, from compiled loops.

    Parameters
    ----------
    pairs : ElementPairs
    test, trial : (n_test,), (n_trial,) arrays
        Element numbers of the rows and the columns, ascending.
    """

    pairs: ElementPairs
    test: IntArray
    trial: IntArray

    def row_slices(self, edges: Sequence[int] = ()) -> Iterator[slice]:
        """Yield the chunks as slices of the test elements, cut at some edges, too."""
        return row_slices(self.test.size, rows_per_chunk(_galerkin(self.pairs.degree), self.trial.size, 1), edges)

    def chunk(self, rows: slice) -> PairIntegrals:
        """Return the integrals of some rows, of shape (..., n_rows, n_trial)."""
        p, values = self.pairs.degree, self.pairs.integrals(self.test[rows], self.trial)
        log, real, imaginary, double = np.split(values[: 3 * p * p + p * (p + 1)], p * p * np.arange(1, 4))
        quotient = real + 1j * imaginary
        shape = values.shape[1:]
        return PairIntegrals(
            log.reshape(p, p, *shape), quotient.reshape(p, p, *shape), double.reshape(p, p + 1, *shape)
        )
