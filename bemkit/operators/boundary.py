"""The boundary operators of plane elasticity as scipy linear operators.

``operator @ x``, ``operator.T``, sums and multiples are those of `scipy.sparse.linalg.LinearOperator`. The matrix is
built on first use. ``operator.block(rows, columns)`` computes only the entries of a block. Trial and test space of an
operator are defined on one mesh. Scenes are solved without this module, directly from the forms
(`bemkit.operators.forms`).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.linalg import LinearOperator

from bemkit.arrays import FloatArray, IntArray, read_only
from bemkit.errors import InputError
from bemkit.geometry.spaces import BoundarySpace
from bemkit.operators.assembly import assemble_block, assemble_together
from bemkit.operators.forms import (
    PairForm,
    definite,
    double_layer_form,
    hypersingular_form,
    mass_matrix,
    require_one_mesh,
    single_layer_form,
)
from bemkit.operators.linear_solvers import Tag
from bemkit.operators.material import Material
from bemkit.operators.steklov_poincare.nodal_conditions import TractionField, integrate_traction

Matrix: TypeAlias = "FloatArray | csr_array[np.float64]"

if TYPE_CHECKING:
    from bemkit.operators.steklov_poincare.collocation import CollocationElasticity
    from bemkit.operators.steklov_poincare.galerkin import GalerkinElasticity

    _LinearOperator: TypeAlias = LinearOperator[np.float64]
else:
    _LinearOperator = LinearOperator


class BoundaryOperator(_LinearOperator, ABC):
    """A weak form <A trial, test> on two boundary spaces; subclasses implement `_build`.

    Parameters
    ----------
    trial, test : BoundarySpace
        Spaces of the argument and of the test functions.
    tags : frozenset of Tag
        Properties of the matrix; `bemkit.testing.check_operator` checks them.
    """

    def __init__(self, trial: BoundarySpace, test: BoundarySpace, tags: frozenset[Tag]) -> None:
        super().__init__(np.dtype(float), (test.n_dofs, trial.n_dofs))  # type: ignore[call-arg]  # the stubs lack it
        self.trial, self.test, self.tags = trial, test, tags
        self._matrix: Matrix | None = None

    @abstractmethod
    def _build(self) -> Matrix:
        """Compute the matrix (test.n_dofs, trial.n_dofs)."""

    @property
    def is_assembled(self) -> bool:
        """Whether the matrix has been built."""
        return self._matrix is not None

    def matrix(self) -> Any:
        """Return the (test.n_dofs, trial.n_dofs) matrix, a read-only or sparse array, built on first use."""
        if self._matrix is None:
            self.keep(self._build())
        return self._matrix

    def keep(self, matrix: Matrix) -> None:
        """Set the matrix of the operator; it becomes read-only."""
        read_only(matrix if isinstance(matrix, np.ndarray) else matrix.data)
        self._matrix = matrix

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return the entries of some rows and columns, without building the matrix.

        Parameters
        ----------
        rows : (m,) int array
            Vector dofs of the test space.
        columns : (n,) int array
            Vector dofs of the trial space.

        Returns
        -------
        (m, n) array
            Entries of the matrix up to round-off; the number of Gauss points of far pairs depends on the block.

        Raises
        ------
        InputError
            If a row or column does not exist.
        """
        rows, columns = _checked(rows, self.shape[0], "rows"), _checked(columns, self.shape[1], "columns")
        if not self.is_assembled:
            return self._build_block(rows, columns)
        matrix = self.matrix()
        return np.array(
            matrix[np.ix_(rows, columns)] if isinstance(matrix, np.ndarray) else matrix[rows][:, columns].todense()
        )

    def _build_block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return a block; by default from the whole matrix."""
        self.matrix()
        return self.block(rows, columns)

    def _matvec(self, x: FloatArray) -> FloatArray:
        return np.asarray(self.matrix() @ x)

    _matmat = _matvec

    def _rmatvec(self, x: FloatArray) -> FloatArray:
        return np.asarray(self.matrix().T @ x)

    _rmatmat = _rmatvec

    def _transpose(self) -> BoundaryOperator:
        return Transposed(self)

    _adjoint = _transpose


def _checked(numbers: IntArray, n_dofs: int, name: str) -> IntArray:
    checked = np.asarray(numbers)
    if checked.ndim != 1 or checked.dtype.kind not in "iu" or not np.all((checked >= 0) & (checked < n_dofs)):
        raise InputError(f"block: {name} is {numbers!r}: give a list of whole numbers from 0 to {n_dofs - 1}")
    return checked.astype(np.intp)


class PairOperator(BoundaryOperator):
    """An operator assembled from integrals over pairs of elements."""

    def __init__(self, form: PairForm) -> None:
        super().__init__(form.trial, form.test, form.tags)
        self.form = form
        self.material = form.material

    def _build(self) -> FloatArray:
        return assemble_together([self.form])[0][0]

    def _build_block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        return assemble_block(self.form, rows, columns)


class Transposed(BoundaryOperator):
    """The transpose of another operator, with trial and test space exchanged."""

    def __init__(self, operator: BoundaryOperator) -> None:
        is_symmetric = Tag.SYMMETRIC in operator.tags
        super().__init__(operator.test, operator.trial, operator.tags if is_symmetric else frozenset())
        self.operator = operator

    def _build(self) -> Matrix:
        matrix: Matrix = self.operator.matrix().T
        return matrix

    def _build_block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        return self.operator.block(columns, rows).T

    def _transpose(self) -> BoundaryOperator:
        return self.operator

    _adjoint = _transpose


class Mass(BoundaryOperator):
    """The identity in weak form, <u, q>; its matrix is sparse."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace) -> None:
        require_one_mesh(trial, test)
        super().__init__(trial, test, definite(trial) if trial is test else frozenset())

    def _build(self) -> Matrix:
        return mass_matrix(self.trial, self.test)


class SteklovPoincareOperator(BoundaryOperator):
    """The Steklov-Poincare operator S: displacement dofs [m] -> nodal forces [N/m], both (n_dofs,).

    Parameters
    ----------
    elastic : GalerkinElasticity or CollocationElasticity
        Map whose stiffness is the matrix. Rigid motions of a bounded body are its kernel. S contains an inverse, so
        that each block requires the whole matrix.
    """

    def __init__(self, elastic: GalerkinElasticity | CollocationElasticity) -> None:
        super().__init__(elastic.displacement_space, elastic.displacement_space, elastic.tags)
        self.elastic = elastic

    def _build(self) -> FloatArray:
        return self.elastic.stiffness()

    def nodal_forces(self, elements: IntArray, traction: TractionField) -> FloatArray:
        """Return the consistent nodal forces (n_nodes, 2) [N/m] of a traction field [Pa] on some elements."""
        return integrate_traction(self.trial, elements, traction)


def single_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return V, the single layer operator of two traction spaces: <V t, q> ([Paper], equation 27) [m^2/Pa].

    Notes
    -----
    The logarithm is log(|r| / r0) with the diameter r0 of the mesh. V is then positive definite for a body of any size.
    For tractions in equilibrium, r0 changes V t only by a translation.
    """
    return PairOperator(single_layer_form(trial, test, material))


def double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return K, the double layer operator: <K u, q> for displacements u and tractions q ([Paper], equation 27) [m].

    Raises
    ------
    GeometryError
        If the trial space is not continuous.

    Notes
    -----
    Rigid motions r of a body fulfil (1/2 M + K) r = 0; on the boundary of an exterior, (1/2 M + K) r = M r.
    """
    return PairOperator(double_layer_form(trial, test, material))


def adjoint_double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> Transposed:
    """Return K', the adjoint double layer operator: <K' t, v> ([Paper], equation 27) [m].

    It is the transpose of ``double_layer(test, trial, material)``.

    Raises
    ------
    GeometryError
        If the test space is not continuous.
    """
    return Transposed(double_layer(test, trial, material))


def hypersingular(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return W, the hypersingular operator of two displacement spaces: <W u, v> ([Paper], equation 27) [Pa].

    Raises
    ------
    GeometryError
        If a space is not continuous, because W is integrated by parts.
    """
    return PairOperator(hypersingular_form(trial, test, material))


def mass(trial: BoundarySpace, test: BoundarySpace) -> Mass:
    """Return M, the identity in weak form: <u, q>, with a sparse matrix [m]."""
    return Mass(trial, test)


def assemble(*operators: PairOperator) -> int:
    """Build the matrices of several operators in one sweep, which computes common integrals once.

    Parameters
    ----------
    *operators : PairOperator
        Operators on one mesh; operators that are already assembled are skipped.

    Returns
    -------
    int
        Number of element pairs whose integrals were evaluated.
    """
    waiting = [operator for operator in operators if not operator.is_assembled]
    if not waiting:
        return 0
    matrices, n_pairs = assemble_together([operator.form for operator in waiting])
    for operator, matrix in zip(waiting, matrices, strict=True):
        operator.keep(matrix)
    return n_pairs
