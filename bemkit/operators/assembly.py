"""Assembly of bilinear forms: one sweep over the element pairs serves several matrices.

A matrix is T_test I T_trial^T, with the integrals I of the Legendre polynomials of all pairs of elements and the series
T of the functions (`bemkit.geometry.series`). The sweep returns I in chunks of rows. On a mesh with symmetry the test
elements are those of the mesh, and the trial elements are those of the whole body.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from threading import Lock
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray, IntArray, consecutive_runs
from bemkit.errors import GeometryError
from bemkit.geometry.local_values import element_degrees
from bemkit.geometry.series import columns_of, series
from bemkit.geometry.spaces import BoundarySpace
from bemkit.geometry.symmetry.images import antisymmetric_dofs
from bemkit.operators.forms import Functions, PairForm
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import FEW, PairSweep
from bemkit.stopwatch import assembling
from bemkit.threads import for_each_chunk

if TYPE_CHECKING:
    from scipy.sparse import csc_array, csr_array

_Key: TypeAlias = "tuple[Functions, bool, int | None]"
"""Functions, whether the kernel is the double layer, and the component."""


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
        If the forms are defined on different meshes.
    """
    mesh = forms[0].test.mesh
    if any(form.test.mesh is not mesh for form in forms):
        msg = "the operators are defined on different meshes: assemble those of one mesh at a time"
        raise GeometryError(msg)
    elements = np.arange(mesh.n_elements)
    targets = [_Target.zeros(form, elements, elements) for form in forms]
    n_pairs = _fill(targets, elements, elements)
    return [target.by_vector_dofs() for target in targets], n_pairs


@assembling()
def assemble_block(form: PairForm, rows: IntArray, columns: IntArray) -> FloatArray:
    """Return some rows and columns (vector dofs) of the matrix of a form, from the supporting elements only."""
    block = np.zeros((rows.size, columns.size))
    if not block.size:
        return block
    elements = [
        np.flatnonzero(np.isin(space.element_dofs, dofs // 2).any(axis=1))
        for space, dofs in ((form.test, rows), (form.trial, columns))
    ]
    target = _Target.zeros(form, *elements)
    _fill([target], *elements)
    positions = [
        np.searchsorted(nodes, dofs // 2) * 2 + dofs % 2
        for nodes, dofs in zip((target.test_nodes, target.trial_nodes), (rows, columns), strict=True)
    ]
    return np.asarray(target.by_vector_dofs()[np.ix_(*positions)])


@dataclass(frozen=True, eq=False)
class _Target:
    """The matrix (n_test, 2, n_trial, 2) of a form, for some ascending scalar dofs and both components."""

    form: PairForm
    test_nodes: IntArray
    trial_nodes: IntArray
    matrix: FloatArray

    @classmethod
    def zeros(cls, form: PairForm, test_elements: IntArray, trial_elements: IntArray) -> _Target:
        """Return the zero matrix for the dofs of some elements."""
        test, trial = _dofs_on(form.test, test_elements), _dofs_on(form.trial, trial_elements)
        return cls(form, test, trial, np.zeros((test.size, 2, trial.size, 2)))

    def by_vector_dofs(self) -> FloatArray:
        """Return the matrix for vector dofs; rows and columns of dofs that vanish by symmetry are zero."""
        if self.form.test.mesh.symmetry is not None:
            self.matrix[antisymmetric_dofs(self.form.test).reshape(-1, 2)[self.test_nodes]] = 0.0
            self.matrix[:, :, antisymmetric_dofs(self.form.trial).reshape(-1, 2)[self.trial_nodes]] = 0.0
        return self.matrix.reshape(2 * self.test_nodes.size, -1)


def _dofs_on(space: BoundarySpace, elements: IntArray) -> IntArray:
    """Return the scalar dofs of some elements, ascending."""
    if elements.size == space.mesh.n_elements:
        return np.arange(space.n_dofs // 2)
    return np.unique(space.element_dofs[elements])


def _fill(targets: Sequence[_Target], test_elements: IntArray, trial_elements: IntArray) -> int:
    """Add the integrals of all pairs of some elements; return the number of pairs.

    Each combination of degrees has its own sweep; few straight elements share one sweep, which is faster.
    """
    mesh = targets[0].form.test.mesh
    n_images = mesh.whole.n_elements // mesh.n_elements
    if trial_elements.size * n_images <= FEW and mesh.is_straight.all():
        return _Sweep(targets, test_elements, trial_elements, {}).add_pairs()
    spaces = list({space: None for target in targets for space in (target.form.test, target.form.trial)})
    groups = [_groups_of_one_degree(spaces, elements) for elements in (test_elements, trial_elements)]
    cache: dict[tuple[Functions, int | None], csc_array] = {}
    return sum(_Sweep(targets, test, trial, cache).add_pairs() for test, trial in itertools.product(*groups))


def _groups_of_one_degree(spaces: Sequence[BoundarySpace], elements: IntArray) -> list[IntArray]:
    """Group elements by their degrees in all spaces."""
    degrees = np.stack([element_degrees(space)[elements] for space in spaces])
    kinds, group = np.unique(degrees, axis=1, return_inverse=True)
    return [elements[group.ravel() == index] for index in range(kinds.shape[1])]


def _n_polynomials(functions: Functions, elements: IntArray) -> int:
    """Return the number of Legendre polynomials of functions on some elements."""
    highest = int(element_degrees(functions.space)[elements].max())
    return max(1, highest + 1 - int(functions.derivative))


class _Sweep:
    """One sweep over pairs of elements that adds their integrals to several matrices.

    Parameters
    ----------
    targets : list of _Target
    test, trial : (n_test,), (n_trial,) int arrays
        Elements of the mesh; trial elements act with their images.
    cache : dict
        Series of functions and components, shared by sweeps.
    """

    def __init__(
        self,
        targets: Sequence[_Target],
        test: IntArray,
        trial: IntArray,
        cache: dict[tuple[Functions, int | None], csc_array],
    ) -> None:
        self.targets, self.test, self.cache = targets, test, cache
        self.mesh = mesh = targets[0].form.test.mesh
        self.trial = (np.arange(0, mesh.whole.n_elements, mesh.n_elements)[:, None] + trial).ravel()
        self.components = (None,) if mesh.symmetry is None else (0, 1)
        self.degrees = Degrees()
        self.tested: dict[Functions, csc_array] = {}
        self.acting: dict[_Key, csr_array] = {}
        for target in targets:
            tested, n_test = target.form.tested, _n_polynomials(target.form.tested, test)
            if tested not in self.tested:
                self.tested[tested] = columns_of(self._series(tested, None), mesh.n_elements, test, n_test)
            for term in target.form.terms:
                n_trial = _n_polynomials(term.trial, trial)
                highest = n_test - 1, n_trial - 1
                self.degrees |= Degrees(double=highest) if term.is_double else Degrees(log=highest)
                for component in self.components:
                    key = term.trial, term.is_double, component
                    if key not in self.acting:
                        self.acting[key] = self._acting(target, term.trial, component, n_trial)

    def _acting(self, target: _Target, functions: Functions, component: int | None, n_trial: int) -> csr_array:
        """Return the series of trial functions, (n_nodes, n_trial_elements * n_polynomials)."""
        whole = self._series(functions, component)
        on_trial = columns_of(whole, self.mesh.whole.n_elements, self.trial, n_trial).tocsr()
        return on_trial if target.trial_nodes.size == on_trial.shape[0] else on_trial[target.trial_nodes]

    def _series(self, functions: Functions, component: int | None) -> csc_array:
        key = functions, component
        if key not in self.cache:
            self.cache[key] = series(functions.space, derivative=functions.derivative, component=component)
        return self.cache[key]

    def add_pairs(self) -> int:
        """Add the integrals of all pairs; return the number of pairs."""
        sweep = PairSweep(self.mesh.whole, self.degrees, self.test, self.trial)
        lock = Lock()

        def add(rows: slice) -> None:
            acted = self._acted(sweep.chunk(rows))
            tested = {functions: _chunk_of(whole, self.test.size, rows) for functions, whole in self.tested.items()}
            for target in self.targets:
                nodes, test_series = tested[target.form.tested]
                folded = self._folded(target, acted, rows).reshape(test_series.shape[1], -1)
                values = (test_series @ folded).reshape(-1, *target.matrix.shape[1:])
                with lock:  # neighbouring chunks share the rows of their common node
                    for positions, at in consecutive_runs(np.searchsorted(target.test_nodes, nodes)):
                        target.matrix[at] += values[positions]

        n_pairs = self.test.size * self.trial.size
        for_each_chunk(add, sweep.row_slices(), n_integrals=n_pairs * self.degrees.n_products)
        return n_pairs

    def _acted(self, integrals: PairIntegrals) -> dict[_Key, FloatArray]:
        """Return I T_trial^T for each kind of trial functions, (n_nodes, n_kernels, n_polynomials, n_test)."""
        log = _by_trial(integrals.log, integrals.quotient.real, integrals.quotient.imag)
        double = _by_trial(integrals.double)
        acted = {}
        for key, trial_series in self.acting.items():
            kernels = double if key[1] else log
            n_trial = trial_series.shape[1] // self.trial.size
            flat = kernels[:, :n_trial].reshape(trial_series.shape[1], -1)
            acted[key] = (trial_series @ flat).reshape(-1, *kernels.shape[2:])
        return acted

    def _folded(self, target: _Target, acted: dict[_Key, FloatArray], rows: slice) -> FloatArray:
        """Return the form applied to its trial functions, (n_test, n_polynomials, 2, n_nodes, 2)."""
        lengths = self.mesh.lengths[self.test[rows]]
        n_polynomials = self.tested[target.form.tested].shape[1] // self.test.size
        folded = np.zeros((lengths.size, n_polynomials, 2, target.trial_nodes.size, 2))
        for c, d in np.ndindex(2, 2):
            entries: FloatArray | None = None
            for term in target.form.terms:
                key = term.trial, term.is_double, self.components[d % len(self.components)]
                for kernel in np.flatnonzero(term.tensors[:, c, d]).tolist():
                    part = term.tensors[kernel, c, d] * acted[key][:, kernel, :n_polynomials]
                    entries = part if entries is None else np.add(entries, part, out=entries)
                if term.shift and entries is not None:  # a constant kernel multiplies the integrals of both functions
                    constant = term.tensors[0, c, d] * term.shift
                    entries[:, 0] += (constant * self._integrals(key))[:, None] * lengths
            if entries is not None:
                folded[:, :, c, :, d] = entries.transpose(2, 1, 0)
        return folded

    def _integrals(self, key: _Key) -> FloatArray:
        """Return the integrals (n_nodes,) of trial functions over the trial elements."""
        trial_series = self.acting[key]
        lengths = np.zeros((self.trial.size, trial_series.shape[1] // self.trial.size))
        lengths[:, 0] = self.mesh.whole.lengths[self.trial]
        return np.asarray(trial_series @ lengths.ravel())


def _by_trial(*kernels: FloatArray) -> FloatArray:
    """Transpose integrals (n_a, n_b, n_test, n_trial) of each kernel to (n_trial, n_b, n_kernels, n_a, n_test)."""
    n_a, n_b, n_test, n_trial = kernels[0].shape
    result = np.empty((n_trial, n_b, len(kernels), n_a, n_test))
    for index, kernel in enumerate(kernels):
        result[:, :, index] = kernel.transpose(3, 1, 0, 2)
    return result


def _chunk_of(whole: csc_array, n_elements: int, rows: slice) -> tuple[IntArray, csc_array]:
    """Return the dofs of some elements, ascending, and their series on these elements."""
    n_each = whole.shape[1] // n_elements
    part = whole[:, rows.start * n_each : rows.stop * n_each]
    nodes, positions = np.unique(part.indices, return_inverse=True)
    return nodes.astype(np.intp), type(part)((part.data, positions, part.indptr), shape=(nodes.size, part.shape[1]))
