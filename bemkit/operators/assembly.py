"""Assembly of bilinear forms: one sweep over the element pairs serves all matrices that are wanted.

A form is a sum of 2 x 2 tensors of scalar integrals, one for each pair (a, b) of Legendre polynomials of the local
coordinates, weighted by the Legendre coefficients of the local test and trial functions. Its columns are gathered
first, in a buffer of a few rows of elements, so that the large matrix is written once.

On a mesh with a symmetry the rows are those of the mesh, the trial elements those of the whole body, and the columns of
all images of an element are gathered into its own, with the signs that the components have there.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import product
from threading import Lock
from typing import TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray, consecutive_runs
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.local_values import of_one_degree
from bemkit.geometry.reflection import antisymmetric_dofs, element_images
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import PairSweep
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.operators.stopwatch import assembling

Tensor: TypeAlias = tuple[FloatArray, FloatArray | None, FloatArray | None, FloatArray]
"""The xx, xy, yx, yy entries, each (n_test_polynomials, n_trial_polynomials, n_rows, n_trial); None is zero."""


class Block:
    """The integrals of some rows of elements, with what turns them into operator entries."""

    def __init__(
        self, integrals: PairIntegrals, test_half: FloatArray, trial_half: FloatArray, log_scale: float
    ) -> None:
        self.integrals = integrals
        self.test_half = test_half[:, None]
        self.trial_half = trial_half[None, :]
        self.log_scale = log_scale

    @property
    def measure(self) -> FloatArray:
        """The products of the lengths, (n_rows, n_trial): the integrals of P_0(xi) P_0(t) themselves."""
        return (4.0 * self.test_half) * self.trial_half


@dataclass(frozen=True, eq=False)
class TrialTerm:
    """One part of an operator.

    Parameters
    ----------
    coefficients : (n_local, n_polynomials) array
        Legendre coefficients of what the kernel acts on: the trial functions or their derivatives.
    tensor : callable
        (block, a, b) -> the 2 x 2 tensor of integrals of some P_a (test) and P_b (trial), slices of the degrees.
    """

    coefficients: FloatArray
    tensor: Callable[[Block, slice, slice], Tensor]


class Tag(enum.Enum):
    """Promises about an operator; `bemkit.testing.check_operator` proves each one."""

    SYMMETRIC = "symmetric"
    POSITIVE_DEFINITE = "positive definite"
    POSITIVE_SEMIDEFINITE = "positive semidefinite"
    KILLS_RIGID_MOTIONS = "zero on rigid motions"
    KILLS_TRANSLATIONS = "zero on translations"


@dataclass(frozen=True, eq=False)
class PairForm(ABC):
    """A bilinear form <A trial, test> made of integrals over pairs of elements.

    Parameters
    ----------
    trial, test : BoundarySpace
        The space of the argument, and the one that the result is tested with.
    material : Material

    Raises
    ------
    GeometryError
        If the spaces live on different meshes.
    """

    trial: BoundarySpace
    test: BoundarySpace
    material: Material

    def __post_init__(self) -> None:
        require_one_mesh(self.trial, self.test)

    @property
    def tags(self) -> frozenset[Tag]:
        """What is promised of its matrix."""
        return frozenset()

    @property
    @abstractmethod
    def degrees(self) -> Degrees:
        """The integrals it needs."""

    @property
    @abstractmethod
    def test_coefficients(self) -> FloatArray:
        """(n_local, n_polynomials) Legendre coefficients on the test element."""

    @abstractmethod
    def trial_terms(self) -> list[TrialTerm]:
        """Return the parts that share the test coefficients."""


def require_one_mesh(trial: BoundarySpace, test: BoundarySpace) -> None:
    """Raise GeometryError unless two spaces live on one mesh."""
    if trial.mesh is not test.mesh:
        msg = "trial and test space live on different meshes: build both on the same BoundaryMesh object"
        raise GeometryError(msg)


@assembling()
def assemble_together(forms: Sequence[PairForm]) -> tuple[list[FloatArray], int]:
    """Sweep over all element pairs once for all forms.

    Returns
    -------
    matrices : list of (test.n_dofs, trial.n_dofs) arrays
    n_pairs : int
        Element pairs whose integrals were evaluated.

    Raises
    ------
    GeometryError
        If the forms live on different meshes.
    """
    mesh = forms[0].test.mesh
    if any(form.test.mesh is not mesh for form in forms):
        msg = "the operators live on different meshes: assemble those of one mesh at a time"
        raise GeometryError(msg)
    everything = np.arange(mesh.n_elements)
    found = list(_filled_by_degree(forms, everything, everything))
    n_pairs = sum(n_own for _, n_own in found)
    if len(found) == 1:
        return [target.dofs_matrix() for target in found[0][0]], n_pairs
    matrices = [np.zeros((form.test.n_dofs, form.trial.n_dofs)) for form in forms]
    for targets, _ in found:
        for matrix, target in zip(matrices, targets, strict=True):
            target.add_to(matrix)
    return matrices, n_pairs


@assembling()
def assemble_block(form: PairForm, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return some rows and columns (vector dofs) of the matrix of a form, from the elements that they belong to."""
    block = np.zeros((rows.size, columns.size))
    if not block.size:
        return block
    elements = [
        np.flatnonzero(np.isin(space.element_dofs, dofs // 2).any(axis=1))
        for space, dofs in ((form.test, rows), (form.trial, columns))
    ]
    for (target,), _ in _filled_by_degree([form], elements[0], elements[1]):
        wanted, places = [], []
        for dofs, own in zip((rows, columns), target.vector_dofs, strict=True):
            wanted.append(np.flatnonzero(np.isin(dofs, own)))
            places.append(np.searchsorted(own, dofs[wanted[-1]]))
        block[np.ix_(*wanted)] += target.dofs_matrix()[np.ix_(*places)]
    return block


def _filled_by_degree(
    forms: Sequence[PairForm], test_elements: IntArray, trial_elements: IntArray
) -> Iterator[tuple[list[_Target], int]]:
    """Sweep over the pairs of elements of any two degrees; see `_filled`."""
    spaces = [space for form in forms for space in (form.test, form.trial)]
    kinds = [list(of_one_degree(spaces, elements)) for elements in (test_elements, trial_elements)]
    for (tests, seen_by_test), (trials, seen_by_trial) in product(*kinds):
        seen = zip(forms, seen_by_test[::2], seen_by_trial[1::2], strict=True)
        yield _filled([replace(form, test=test, trial=trial) for form, test, trial in seen], tests, trials)


def _filled(forms: Sequence[PairForm], test_elements: IntArray, trial_elements: IntArray) -> tuple[list[_Target], int]:
    """Sweep over the pairs of some elements; return the matrices of their dofs and the number of pairs."""
    mesh = forms[0].test.mesh
    degrees = Degrees()
    for form in forms:
        degrees |= form.degrees
    targets = [_Target(form, test_elements, trial_elements) for form in forms]
    n_images = mesh.whole.n_elements // mesh.n_elements
    trial = np.concatenate([image * mesh.n_elements + trial_elements for image in range(n_images)])
    sweep = PairSweep(mesh.whole, degrees, test_elements, trial)
    half = 0.5 * mesh.whole.lengths
    test_half, trial_half = half[test_elements], half[trial]
    log_scale = float(np.log(mesh.diameter))
    lock = Lock()

    def fill(rows: slice) -> int:
        block = Block(sweep.chunk(rows), test_half[rows], trial_half, log_scale)
        for target in targets:
            gathered = target.gather(block)
            with lock:  # two chunks share the rows of the node between them
                target.add(rows, gathered)
        return block.test_half.size * block.trial_half.size

    n_integrals = sweep.test.size * sweep.trial.size * degrees.n_products
    n_pairs = for_each_chunk(fill, sweep.row_slices(), n_integrals=n_integrals)
    return targets, sum(n_pairs)


class _Target:
    """A matrix being filled, indexed (test node, component, trial node, component); nodes are scalar dofs.

    Only the nodes of some elements have a place in it: `test_nodes` and `trial_nodes`, in increasing order.
    """

    def __init__(self, form: PairForm, test_elements: IntArray, trial_elements: IntArray) -> None:
        self._form = form
        self.test_nodes, test_dofs = np.unique(form.test.element_dofs[test_elements], return_inverse=True)
        self.trial_nodes = np.unique(form.trial.element_dofs[trial_elements])
        self.test_dofs = test_dofs.reshape(test_elements.size, -1)
        self.test_coefficients = form.test_coefficients
        self.terms = form.trial_terms()
        self.images = [
            (
                slice(image * trial_elements.size, (image + 1) * trial_elements.size),
                signs.tolist(),
                [consecutive_runs(own) for own in np.searchsorted(self.trial_nodes, dofs[trial_elements]).T],
            )
            for image, (_, signs, dofs) in enumerate(element_images(form.trial))
        ]
        self.matrix = np.zeros((self.test_nodes.size, 2, self.trial_nodes.size, 2))

    @property
    def vector_dofs(self) -> tuple[IntArray, IntArray]:
        """Return what rows and columns of `dofs_matrix` stand for."""
        components = np.arange(2)
        return (2 * self.test_nodes[:, None] + components).ravel(), (2 * self.trial_nodes[:, None] + components).ravel()

    def add_to(self, matrix: FloatArray) -> None:
        """Add the matrix to its places in the one of all dofs."""
        own = self.dofs_matrix()
        rows, columns = (_end_and_inner(dofs) for dofs in self.vector_dofs)
        for (own_rows, to_rows), (own_columns, to_columns) in product(rows, columns):
            if isinstance(to_rows, np.ndarray) and isinstance(to_columns, np.ndarray):
                matrix[np.ix_(to_rows, to_columns)] += own[own_rows, own_columns]
            else:
                matrix[to_rows, to_columns] += own[own_rows, own_columns]

    def dofs_matrix(self) -> FloatArray:
        """Return the matrix by vector dofs; rows and columns of dofs that are zero by symmetry are set to zero."""
        if self._form.test.mesh.symmetry is not None:
            self.matrix[antisymmetric_dofs(self._form.test).reshape(-1, 2)[self.test_nodes]] = 0.0
            self.matrix[:, :, antisymmetric_dofs(self._form.trial).reshape(-1, 2)[self.trial_nodes]] = 0.0
        return self.matrix.reshape(2 * self.test_nodes.size, -1)

    def gather(self, block: Block) -> FloatArray:
        """Return the rows of the elements, (n_local, n_rows, 2, n_trial_nodes, 2), by their own dofs."""
        n_rows, test = block.test_half.shape[0], self.test_coefficients
        gathered = np.zeros((test.shape[1], n_rows, 2, self.trial_nodes.size, 2))
        for term in self.terms:
            degrees = slice(test.shape[1]), slice(term.coefficients.shape[1])
            for index, values in enumerate(term.tensor(block, *degrees)):
                if values is not None:
                    component = index % 2
                    self._add_columns(gathered[:, :, index // 2, :, component], values, term.coefficients, component)
        return _combined(test, gathered)

    def _add_columns(self, target: FloatArray, values: FloatArray, coefficients: FloatArray, component: int) -> None:
        """Add (n_test_polynomials, n_polynomials, n_rows, n_trial) values to the columns of the trial dofs."""
        local = _combined(coefficients, values.swapaxes(0, 1))
        for elements, signs, columns in self.images:
            for own, runs in zip(local, columns, strict=True):
                for positions, dofs in runs:
                    added = own[..., elements][..., positions]
                    target[..., dofs] += added if signs[component] == 1.0 else signs[component] * added

    def add(self, rows: slice, gathered: FloatArray) -> None:
        """Add the gathered rows to the matrix."""
        for values, dofs in zip(gathered, self.test_dofs[rows].T, strict=True):
            for positions, nodes in consecutive_runs(dofs):
                self.matrix[nodes] += values[positions]


def _end_and_inner(dofs: IntArray) -> list[tuple[slice, slice | IntArray]]:
    """Split ascending dofs into some and the last ones, which follow each other: positions and dofs.

    In a space of several degrees the inner dofs of elements of one degree do, and slices need no index for each entry.
    """
    first = int(np.max(np.flatnonzero(np.diff(dofs) != 1), initial=-1)) + 1
    return [(slice(first), dofs[:first]), (slice(first, None), slice(int(dofs[first]), int(dofs[-1]) + 1))]


def _combined(coefficients: FloatArray, values: FloatArray) -> FloatArray:
    """Return the sums (n_local, ...) of (n_polynomials, ...) values with the coefficients (n_local, n_polynomials)."""
    if np.array_equal(coefficients, np.eye(*coefficients.shape)):
        return values
    return np.asarray(coefficients @ values.reshape(len(values), -1)).reshape(-1, *values.shape[1:])
