"""The boundary operators of plane elasticity as scipy's linear operators: lazy, with separate blocks.

``operator @ x``, ``operator.T``, sums and multiples are those of `scipy.sparse.linalg.LinearOperator`; they build the
matrix on first use. ``operator.block(rows, columns)`` computes no other entries. Bodies are solved without this module,
from the forms (`bemkit.operators.forms`) themselves.
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
    DoubleLayerForm,
    HypersingularForm,
    SingleLayerForm,
    definite,
    mass_matrix,
)
from bemkit.operators.material import Material
from bemkit.operators.pair_form import PairForm, Tag, require_one_mesh

Matrix: TypeAlias = "FloatArray | csr_array[np.float64]"

if TYPE_CHECKING:
    _LinearOperator: TypeAlias = LinearOperator[np.float64]
else:
    _LinearOperator = LinearOperator


class BoundaryOperator(_LinearOperator, ABC):
    """A weak form <A trial, test> on two boundary spaces; an operator of your own writes `_build`.

    Parameters
    ----------
    trial, test : BoundarySpace
        The space of the argument, and the one that the result is tested with.
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
        """Whether the matrix exists already."""
        return self._matrix is not None

    def matrix(self) -> Any:
        """Return the (test.n_dofs, trial.n_dofs) matrix, a read-only array, or sparse; built on first use."""
        if self._matrix is None:
            self.keep(self._build())
        return self._matrix

    def keep(self, matrix: Matrix) -> None:
        """Take a finished matrix as that of the operator; it becomes read-only."""
        read_only(matrix if isinstance(matrix, np.ndarray) else matrix.data)
        self._matrix = matrix

    def block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Return the entries of some rows and columns, and compute no others unless the matrix exists.

        Parameters
        ----------
        rows : (m,) int array
            Vector dofs of the test space.
        columns : (n,) int array
            Vector dofs of the trial space.

        Returns
        -------
        (m, n) array
            As in the matrix, to round-off: the number of Gauss points of far pairs follows from what is asked for.

        Raises
        ------
        InputError
            If there is no such row or column.
        """
        rows, columns = (
            _checked(*each) for each in ((rows, self.shape[0], "rows"), (columns, self.shape[1], "columns"))
        )
        if not self.is_assembled:
            return self._build_block(rows, columns)
        matrix = self.matrix()
        return np.array(
            matrix[np.ix_(rows, columns)] if isinstance(matrix, np.ndarray) else matrix[rows][:, columns].todense()
        )

    def _build_block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        """Compute a block; by default from the whole matrix."""
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
    """An operator whose form is assembled from integrals over pairs of elements."""

    def __init__(self, form: PairForm) -> None:
        super().__init__(form.trial, form.test, form.tags)
        self.form = form
        self.material = form.material

    def _build(self) -> FloatArray:
        return assemble_together([self.form])[0][0]

    def _build_block(self, rows: IntArray, columns: IntArray) -> FloatArray:
        return assemble_block(self.form, rows, columns)


class Transposed(BoundaryOperator):
    """The transpose of another operator, on the same spaces the other way round."""

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


def single_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return V, the single layer operator: <V t, q> ([Paper], equation 27).

    Parameters
    ----------
    trial, test : BoundarySpace
        Traction spaces on one mesh.
    material : Material

    Returns
    -------
    PairOperator
        Matrix entries [m^2/Pa]: traction dofs [Pa] to tested displacements [m^2].

    Notes
    -----
    The logarithm is log(|r| / r0) with r0 the diameter of the mesh, which makes V positive definite at every size of
    the body. For tractions in equilibrium r0 changes V t by a translation only.
    """
    return PairOperator(SingleLayerForm(trial, test, material))


def double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return K, the double layer operator: <K u, q> ([Paper], equation 27).

    Parameters
    ----------
    trial : BoundarySpace
        Of the displacements u; it must be continuous.
    test : BoundarySpace
        Of the tractions q, on the same mesh.
    material : Material

    Returns
    -------
    PairOperator
        Matrix entries [m]: displacement dofs [m] to tested displacements [m^2].

    Raises
    ------
    GeometryError
        If the trial space is not continuous.

    Notes
    -----
    On the boundary of a body (1/2 M + K) r = 0 for its rigid motions r, on that of an exterior (1/2 M + K) r = M r.
    """
    return PairOperator(DoubleLayerForm(trial, test, material))


def adjoint_double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> Transposed:
    """Return K', the adjoint double layer operator: <K' t, v> ([Paper], equation 27).

    Parameters
    ----------
    trial : BoundarySpace
        Of the tractions t.
    test : BoundarySpace
        Of the displacements v, on the same mesh; it must be continuous.
    material : Material

    Returns
    -------
    Transposed
        The transpose of ``double_layer(test, trial, material)``.

    Raises
    ------
    GeometryError
        If the test space is not continuous.
    """
    return Transposed(double_layer(test, trial, material))


def hypersingular(trial: BoundarySpace, test: BoundarySpace, material: Material) -> PairOperator:
    """Return W, the hypersingular operator: <W u, v> ([Paper], equation 27), integrated by parts.

    Parameters
    ----------
    trial, test : BoundarySpace
        Displacement spaces on one mesh; both must be continuous.
    material : Material

    Returns
    -------
    PairOperator
        Matrix entries [Pa]: displacement dofs [m] to nodal forces [N/m].

    Raises
    ------
    GeometryError
        If a space is not continuous.
    """
    return PairOperator(HypersingularForm(trial, test, material))


def mass(trial: BoundarySpace, test: BoundarySpace) -> Mass:
    """Return M, the identity in weak form: <u, q>, with a sparse matrix [m].

    Parameters
    ----------
    trial, test : BoundarySpace
        On one mesh.
    """
    return Mass(trial, test)


def assemble(*operators: PairOperator) -> int:
    """Build the matrices of several operators in one sweep, so that shared integrals are computed once.

    Parameters
    ----------
    *operators : PairOperator
        On the same mesh; those that are assembled already are skipped.

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
