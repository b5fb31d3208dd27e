"""Assembly of dense operators: one sweep over the element pairs serves all matrices that are wanted.

An operator is a sum of 2 x 2 tensors of scalar integrals, one for each pair (a, b) of Legendre polynomials of the local
coordinates, weighted by the Legendre coefficients of the local test and trial functions. Its columns are gathered
first, in a buffer of a few rows of elements, so that the large matrix is written once.

On a mesh with a symmetry the rows are those of the mesh, the trial elements those of the whole body, and the columns of
all images of an element are gathered into its own, with the signs that the components have there.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from threading import Lock
from typing import Protocol, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, consecutive_runs
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.reflection import element_images, vanishing_dofs
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators import kernels
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import PairSweep
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.stopwatch import assembling

Tensor: TypeAlias = tuple[FloatArray, FloatArray | None, FloatArray | None, FloatArray]
"""The xx, xy, yx, yy entries, each (n_rows, n_trial); None is zero."""


class Block:
    """The integrals of some rows of elements, with what turns them into operator entries."""

    def __init__(
        self, integrals: PairIntegrals, test_half: FloatArray, trial_half: FloatArray, log_scale: float
    ) -> None:
        self.integrals = integrals
        self.test_half = test_half[:, None]
        self.trial_half = trial_half[None, :]
        self.log_scale = log_scale

    def mass(self, a: int, b: int) -> FloatArray:
        """Return the integrals of P_a(xi) P_b(t) themselves, (n_rows, n_trial)."""
        constant = kernels.interval_moment(a) * kernels.interval_moment(b)
        return constant * (self.test_half * self.trial_half)


@dataclass(frozen=True, eq=False)
class TrialTerm:
    """One part of an operator.

    Parameters
    ----------
    coefficients : (n_local, n_polynomials) array
        Legendre coefficients of what the kernel acts on: the trial functions or their derivatives.
    tensor : callable
        (block, a, b) -> the 2 x 2 tensor of integrals of P_a (test) and P_b (trial).
    """

    coefficients: FloatArray
    tensor: Callable[[Block, int, int], Tensor]


class Assemblable(Protocol):
    """What assembly needs to know of an operator."""

    @property
    def trial(self) -> BoundarySpace:
        """The space of the argument."""

    @property
    def test(self) -> BoundarySpace:
        """The space the result is tested with."""

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""

    @property
    def test_coefficients(self) -> FloatArray:
        """(n_local, n_polynomials) Legendre coefficients on the test element."""

    def trial_terms(self) -> list[TrialTerm]:
        """Return the parts that share the test coefficients."""


@assembling()
def assemble_together(operators: Sequence[Assemblable]) -> tuple[list[FloatArray], int]:
    """Sweep over all element pairs once for all operators.

    Returns
    -------
    matrices : list of (test.n_dofs, trial.n_dofs) arrays
    n_pairs : int
        Element pairs whose integrals were evaluated.

    Raises
    ------
    GeometryError
        If the operators live on different meshes.
    """
    mesh = operators[0].test.mesh
    if any(operator.test.mesh is not mesh for operator in operators):
        msg = "the operators live on different meshes: assemble those of one mesh at a time"
        raise GeometryError(msg)
    degrees = Degrees()
    for operator in operators:
        degrees |= operator.degrees
    targets = [_Target(operator) for operator in operators]
    sweep = PairSweep(mesh.whole, degrees, test_elements=np.arange(mesh.n_elements))
    half = 0.5 * mesh.whole.lengths
    log_scale = float(np.log(mesh.diameter))
    lock = Lock()

    def fill(rows: slice) -> int:
        block = Block(sweep.chunk(rows), half[rows], half, log_scale)
        for target in targets:
            for a, gathered in target.gather(block):
                with lock:  # two chunks share the rows of the node between them
                    target.add(rows, a, gathered)
        return block.test_half.size * block.trial_half.size

    n_pairs = for_each_chunk(fill, sweep.row_slices(), n_pairs=sweep.test.size * sweep.trial.size)
    matrices = [target.matrix.reshape(target.test_dofs_total, -1) for target in targets]
    for operator, matrix in zip(operators, matrices, strict=True):
        clear_vanishing(matrix, operator.test, operator.trial)
    return matrices, sum(n_pairs)


def clear_vanishing(matrix: FloatArray, test: BoundarySpace, trial: BoundarySpace) -> None:
    """Set the rows and columns to zero of dofs that are zero by symmetry."""
    if test.mesh.symmetry is not None:
        matrix[vanishing_dofs(test)] = 0.0
        matrix[:, vanishing_dofs(trial)] = 0.0


class _Target:
    """A matrix being filled, indexed (test dof, component, trial dof, component)."""

    def __init__(self, operator: Assemblable) -> None:
        self.test_dofs = operator.test.element_dofs
        self.test_dofs_total = operator.test.n_dofs
        self.n_trial = operator.trial.n_dofs // 2
        self.test_coefficients = operator.test_coefficients
        self.terms = operator.trial_terms()
        self.images = [
            (elements, signs.tolist(), [consecutive_runs(own) for own in dofs.T])
            for elements, signs, dofs in element_images(operator.trial)
        ]
        self.matrix = np.zeros((self.test_dofs_total // 2, 2, self.n_trial, 2))

    def gather(self, block: Block) -> list[tuple[int, list[FloatArray]]]:
        """Return, for each degree a on the test elements, the four components by element row and trial dof."""
        n_rows = block.test_half.shape[0]
        result = []
        for a in range(self.test_coefficients.shape[1]):
            buffers = [np.zeros((n_rows, self.n_trial)) for _ in range(4)]
            for term in self.terms:
                for b in np.flatnonzero(np.any(term.coefficients != 0.0, axis=0)).tolist():
                    for index, values in enumerate(term.tensor(block, a, b)):
                        if values is not None:
                            self._add_columns(buffers[index], values, term.coefficients[:, b], index % 2)
            result.append((a, buffers))
        return result

    def _add_columns(self, buffer: FloatArray, values: FloatArray, coefficients: FloatArray, component: int) -> None:
        for elements, signs, columns in self.images:
            own = values[:, elements]
            for coefficient, runs in zip((signs[component] * coefficients).tolist(), columns, strict=True):
                if coefficient:
                    scaled = own if coefficient == 1.0 else coefficient * own
                    for positions, dofs in runs:
                        buffer[:, dofs] += scaled[:, positions]

    def add(self, rows: slice, a: int, gathered: list[FloatArray]) -> None:
        """Add the gathered rows to the matrix."""
        for p, coefficient in enumerate(self.test_coefficients[:, a].tolist()):
            if not coefficient:
                continue
            for positions, dofs in consecutive_runs(self.test_dofs[rows, p]):
                for index, buffer in enumerate(gathered):
                    values = buffer[positions]
                    view = self.matrix[:, index // 2, :, index % 2]
                    view[dofs] += values if coefficient == 1.0 else coefficient * values
