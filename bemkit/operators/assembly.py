"""Assembly of bilinear forms: one sweep over the element pairs serves all matrices that are wanted.

A form is a sum of 2 x 2 tensors of scalar integrals, one for each pair (a, b) of Legendre polynomials of the local
coordinates, weighted by the Legendre coefficients of the local test and trial functions. Its columns are gathered
first, in a buffer of a few rows of elements, so that the large matrix is written once.

On a mesh with a symmetry the rows are those of the mesh, the trial elements those of the whole body, and the columns of
all images of an element are gathered into its own, with the signs that the components have there.
"""

from __future__ import annotations

import bisect
import enum
import itertools
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from threading import Lock
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from bemkit.arrays import ComplexArray, FloatArray, IntArray, consecutive_runs
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.local_values import of_one_degree
from bemkit.geometry.reflection import antisymmetric_dofs, element_images
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.compiled_sweep import sweep_over
from bemkit.operators.integrals.pairs import Degrees, PairIntegrals
from bemkit.operators.integrals.sweep import FEW
from bemkit.operators.linear.threads import for_each_chunk
from bemkit.operators.material import Material
from bemkit.operators.stopwatch import assembling

_Numbers: TypeAlias = npt.NDArray[np.inexact]
"""Real or complex ones."""

_Kind: TypeAlias = tuple[IntArray, tuple[BoundarySpace, ...]]
"""Elements of one degree, and the spaces as they see them."""


@dataclass(frozen=True, eq=False)
class TrialTerm:
    """One part of an operator: a 2 x 2 tensor of combinations of the scalar integrals of P_a (test) and P_b (trial).

    Parameters
    ----------
    coefficients : (n_local, n_polynomials) array
        Legendre coefficients of what the kernel acts on: the trial functions or their derivatives.
    tensor : (2, 3) complex array
        By the components of the test function, and by the integrals of the quotient, the logarithm and the double
        layer. What acts on the components of the trial function is one complex number, its real part on x and its
        imaginary part on y.
    of_slopes : (bool, bool)
        Whether it acts on tangential derivatives of the test and of the trial functions.
    shift : float
        What is added to the logarithm.
    """

    coefficients: FloatArray
    tensor: ComplexArray
    of_slopes: tuple[bool, bool] = (False, False)
    shift: float = 0.0


class Block:
    """The integrals of some rows of elements, with what turns them into operator entries."""

    def __init__(self, integrals: PairIntegrals, test_half: FloatArray, trial_half: FloatArray) -> None:
        self.integrals = integrals
        self.test_half = test_half[:, None]
        self.trial_half = trial_half[None, :]

    def columns(self, chosen: slice) -> Block:
        """Return those of some trial elements, not copied."""
        return Block(self.integrals.take(chosen), self.test_half[:, 0], self.trial_half[0, chosen])

    def entries(self, terms: Sequence[TrialTerm], n_test: int) -> ComplexArray:
        """Return the sums of some terms, (2, n_test, n_local, n_rows, n_trial), as complex as their tensors."""
        result: ComplexArray | None = None
        for term in terms:
            for factors, integrals, shift in zip(term.tensor.T, self._kinds, (0.0, term.shift, 0.0), strict=True):
                if factors.any():
                    values = self._local(term, integrals[:n_test, : term.coefficients.shape[1]], shift)
                    if result is None:
                        result = np.multiply.outer(factors, values)
                    else:
                        _add_products(result, factors.tolist(), values)
        assert result is not None
        return result

    @property
    def _kinds(self) -> tuple[ComplexArray, FloatArray, FloatArray]:
        return self.integrals.quotient, self.integrals.log, self.integrals.double

    def _local(self, term: TrialTerm, values: _Numbers, shift: float) -> _Numbers:
        """Return integrals of what the kernel of a term acts on, at both ends, for the local trial functions."""
        of_test, of_trial = term.of_slopes
        if shift:
            values = values.copy()
            values[0, 0] += 4.0 * shift * self.test_half * self.trial_half
        if of_test or of_trial:
            values = values * (1.0 / ((self.test_half if of_test else 1.0) * (self.trial_half if of_trial else 1.0)))
        return _combined(term.coefficients, values)


def _add_products(sums: ComplexArray, factors: Sequence[complex], values: _Numbers) -> None:
    """Add the products of values with some factors to sums."""
    for own, factor in zip(sums, factors, strict=True):
        if np.iscomplexobj(values):
            own += factor * values
        else:  # what is zero takes no time
            for part, real in ((own.real, factor.real), (own.imag, factor.imag)):
                if real:
                    part += real * values


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
    matrices = [_Target.zeros(form, everything, everything) for form in forms]
    n_pairs = _fill(matrices, everything, everything)
    return [matrix.dofs_matrix() for matrix in matrices], n_pairs


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
    target = _Target.zeros(form, *elements)
    _fill([target], *elements)
    places = [
        np.searchsorted(nodes, dofs // 2) * 2 + dofs % 2
        for nodes, dofs in zip((target.test_nodes, target.trial_nodes), (rows, columns), strict=True)
    ]
    return np.asarray(target.dofs_matrix()[np.ix_(*places)])


def _fill(targets: Sequence[_Target], test_elements: IntArray, trial_elements: IntArray) -> int:
    """Add the pairs of some elements, of any degrees; return how many there are.

    Each two degrees have a sweep of their own, but few straight elements, whose pairs share more if they are in one.
    """
    mesh, forms = targets[0].form.test.mesh, [target.form for target in targets]
    spaces = [space for form in forms for space in (form.test, form.trial)]
    tests, trials = (list(of_one_degree(spaces, elements)) for elements in (test_elements, trial_elements))
    n_trial = trial_elements.size * (mesh.whole.n_elements // mesh.n_elements)
    if n_trial <= FEW and mesh.is_straight.all():
        return _fill_kinds(targets, tests, trials)
    return sum(_fill_kinds(targets, [test], [trial]) for test, trial in itertools.product(tests, trials))


def _fill_kinds(targets: Sequence[_Target], tests: Sequence[_Kind], trials: Sequence[_Kind]) -> int:
    """Sweep over the pairs of elements of some degrees; return their number."""
    mesh = targets[0].form.test.mesh
    columns = [_Columns(target, trials, 2 * k + 1) for k, target in enumerate(targets)]
    blocks = [
        [_Rows(target, elements, seen[2 * k], columns[k]) for k, target in enumerate(targets)]
        for elements, seen in tests
    ]
    degrees = Degrees()
    for target, k in zip(targets, range(0, 2 * len(targets), 2), strict=True):
        degrees |= replace(target.form, test=_highest(tests, k), trial=_highest(trials, k + 1)).degrees
    images = range(0, mesh.whole.n_elements, mesh.n_elements)
    test = np.concatenate([elements for elements, _ in tests])
    trial = np.concatenate([image + elements for elements, _ in trials for image in images])
    sweep = sweep_over(mesh, degrees, test, trial)
    edges: list[int] = np.cumsum([0, *(elements.size for elements, _ in tests)]).tolist()
    half = 0.5 * mesh.whole.lengths
    lock = Lock()

    def fill(rows: slice) -> int:
        pairs = Block(sweep.chunk(rows), half[test[rows]], half[trial])
        kind = bisect.bisect_right(edges, rows.start) - 1
        for block in blocks[kind]:
            gathered = block.gathered(pairs)
            with lock:  # two chunks share the rows of the node between them
                block.add(slice(rows.start - edges[kind], rows.stop - edges[kind]), gathered)
        return pairs.test_half.size * trial.size

    n_integrals = test.size * trial.size * degrees.n_products
    return sum(for_each_chunk(fill, sweep.row_slices(edges), n_integrals=n_integrals))


@dataclass(frozen=True, eq=False)
class _Target:
    """A matrix being filled.

    Parameters
    ----------
    form : PairForm
    test_nodes, trial_nodes : (n,) int arrays
        The scalar dofs that have a place in it, in increasing order.
    matrix : (n_test, 2, n_trial) complex array
        By test node, component and trial node; real parts act on the component x there, imaginary parts on y.
    """

    form: PairForm
    test_nodes: IntArray
    trial_nodes: IntArray
    matrix: ComplexArray

    @classmethod
    def zeros(cls, form: PairForm, test_elements: IntArray, trial_elements: IntArray) -> _Target:
        """Return one for the pairs of some elements."""
        test = np.unique(form.test.element_dofs[test_elements])
        trial = np.unique(form.trial.element_dofs[trial_elements])
        return cls(form, test, trial, np.zeros((test.size, 2, trial.size), complex))

    def dofs_matrix(self) -> FloatArray:
        """Return the matrix by vector dofs; rows and columns of dofs that are zero by symmetry are set to zero."""
        matrix = self.matrix.view(float).reshape(2 * self.test_nodes.size, -1)
        if self.form.test.mesh.symmetry is not None:
            matrix[antisymmetric_dofs(self.form.test).reshape(-1, 2)[self.test_nodes].ravel()] = 0.0
            matrix[:, antisymmetric_dofs(self.form.trial).reshape(-1, 2)[self.trial_nodes].ravel()] = 0.0
        return matrix


def _highest(kinds: Sequence[_Kind], space: int) -> BoundarySpace:
    """Return one of their spaces as the elements of the highest degree see it."""
    return max((seen[space] for _, seen in kinds), key=lambda each: each.degree)


class _Columns:
    """What trial elements of some degrees add to the columns of a matrix.

    Parameters
    ----------
    target : _Target
    trials : list of _Kind
        In the order of the columns, each with all images of its elements.
    space : int
        The place of the trial space in them.
    """

    def __init__(self, target: _Target, trials: Sequence[_Kind], space: int) -> None:
        self.n_nodes = target.trial_nodes.size
        self._parts, first = [], 0
        for own, seen in trials:
            images = []
            for _, signs, dofs in element_images(seen[space]):
                elements = slice(first, first + own.size)
                images.append((elements, signs.tolist(), _Scatter(target.trial_nodes, dofs[own])))
                first = elements.stop
            self._parts.append((replace(target.form, trial=seen[space]).trial_terms(), images))

    def gathered(self, block: Block, n_test: int) -> ComplexArray:
        """Return the sums (n_test, n_rows, 2, n_nodes) for rows of test polynomials."""
        result = np.zeros((n_test, block.test_half.size, 2, self.n_nodes), complex)
        for terms, images in self._parts:
            for elements, (sign, sign_of_y), scatter in images:
                values = block.columns(elements).entries(terms, n_test)
                if sign != sign_of_y:
                    np.conjugate(values, out=values)
                scatter.add(result.transpose(2, 0, 1, 3), values if sign > 0.0 else -values)
        return result


class _Rows:
    """What test elements of one degree add to a matrix."""

    def __init__(self, target: _Target, elements: IntArray, test: BoundarySpace, columns: _Columns) -> None:
        self._matrix, self._columns = target.matrix, columns
        self._dofs = np.searchsorted(target.test_nodes, test.element_dofs[elements])
        self._coefficients = replace(target.form, test=test).test_coefficients

    def gathered(self, block: Block) -> ComplexArray:
        """Return the rows of the elements, (n_local, n_rows, 2, n_trial_nodes), by their own dofs."""
        gathered = self._columns.gathered(block, self._coefficients.shape[1])
        return np.asarray(_combined(self._coefficients, gathered[None])[0], complex)

    def add(self, rows: slice, gathered: ComplexArray) -> None:
        """Add the gathered rows to the matrix."""
        for values, dofs in zip(gathered, self._dofs[rows].T, strict=True):
            for positions, nodes in consecutive_runs(dofs):
                self._matrix[nodes] += values[positions]


class _Scatter:
    """Adds values of the local dofs of elements, `element_dofs` (n_elements, n_local), to those of some nodes."""

    def __init__(self, nodes: IntArray, element_dofs: IntArray) -> None:
        dofs, n_local = np.searchsorted(nodes, element_dofs), element_dofs.shape[1]
        ranges = [range(first, last) for first in (0, 1) for last in (n_local, n_local - 1) if first < last]
        # inner dofs are numbered element by element, all of them in one go
        self._inner = next((each for each in ranges if (np.diff(dofs[:, each].ravel()) == 1).all()), range(0))
        self._first = int(dofs[0, self._inner[0]]) if self._inner else 0
        self._others = [(k, consecutive_runs(dofs[:, k])) for k in range(n_local) if k not in self._inner]

    def add(self, target: ComplexArray, values: ComplexArray) -> None:
        """Add (2, m, n_local, n_rows, n_elements) values to the columns of (2, m, n_rows, n_dofs)."""
        if self._inner:
            n_inner, n_elements = len(self._inner), values.shape[-1]
            inner = target[..., self._first : self._first + n_elements * n_inner]
            inner = inner.reshape(*target.shape[:3], n_elements, n_inner)
            inner += values[:, :, self._inner.start : self._inner.stop].transpose(0, 1, 3, 4, 2)
        for k, runs in self._others:
            for positions, dofs in runs:
                target[..., dofs] += values[:, :, k, :, positions]


def _combined(coefficients: FloatArray, values: _Numbers) -> _Numbers:
    """Return sums (m, n_local, ...) of (m, n_polynomials, ...) values by coefficients (n_local, n_polynomials)."""
    if coefficients.shape == (1, 1) and coefficients[0, 0] == 1.0:  # of constants
        return values
    m, n_polynomials, *shape = values.shape
    real = np.ascontiguousarray(values).view(float).reshape(m, n_polynomials, -1)
    return np.asarray(np.matmul(coefficients, real).view(values.dtype).reshape(m, -1, *shape))
