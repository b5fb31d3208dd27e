"""Rows of matrices from the integrals of element pairs.

A form is a sum of 2 x 2 tensors of scalar integrals, one for each pair (a, b) of Legendre polynomials of the local
coordinates, weighted by the Legendre coefficients of the local test and trial functions. Its columns are gathered
first, in a buffer of a few rows of elements, so that the large matrix is written once.

On a mesh with a symmetry the rows are those of the mesh, the trial elements those of the whole body, and the columns of
all images of an element are gathered into its own, with the signs that the components have there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from bemkit.arrays import ComplexArray, FloatArray, IntArray, consecutive_runs
from bemkit.geometry.reflection import antisymmetric_dofs, element_images
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.integrals.pairs import PairIntegrals
from bemkit.operators.pair_form import PairForm, TrialTerm

_Numbers: TypeAlias = npt.NDArray[np.inexact]
"""Real or complex ones."""

Kind: TypeAlias = tuple[IntArray, tuple[BoundarySpace, ...]]
"""Elements of one degree, and the spaces as they see them."""


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


@dataclass(frozen=True, eq=False)
class Target:
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
    def zeros(cls, form: PairForm, test_elements: IntArray, trial_elements: IntArray) -> Target:
        """Return one for the pairs of some elements."""
        test, trial = _dofs_on(form.test, test_elements), _dofs_on(form.trial, trial_elements)
        return cls(form, test, trial, np.zeros((test.size, 2, trial.size), complex))

    def dofs_matrix(self) -> FloatArray:
        """Return the matrix by vector dofs; rows and columns of dofs that are zero by symmetry are set to zero."""
        matrix = self.matrix.view(float).reshape(2 * self.test_nodes.size, -1)
        if self.form.test.mesh.symmetry is not None:
            matrix[antisymmetric_dofs(self.form.test).reshape(-1, 2)[self.test_nodes].ravel()] = 0.0
            matrix[:, antisymmetric_dofs(self.form.trial).reshape(-1, 2)[self.trial_nodes].ravel()] = 0.0
        return matrix


def _dofs_on(space: BoundarySpace, elements: IntArray) -> IntArray:
    """Return the scalar dofs of some elements, in increasing order."""
    if elements.size == space.mesh.n_elements:
        return np.arange(space.n_dofs // 2)
    return np.unique(space.element_dofs[elements])


class Columns:
    """What trial elements of some degrees add to the columns of a matrix.

    Parameters
    ----------
    target : Target
    trials : list of Kind
        In the order of the columns, each with all images of its elements.
    space : int
        The place of the trial space in them.
    """

    def __init__(self, target: Target, trials: Sequence[Kind], space: int) -> None:
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


class Rows:
    """What test elements of one degree add to a matrix."""

    def __init__(self, target: Target, elements: IntArray, test: BoundarySpace, columns: Columns) -> None:
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
