"""The boundary operators of plane elasticity as lazy weak forms on boundary spaces.

With r = y - x, Q = r r^T / |r|^2, J = [[0, 1], [-1, 0]], mu the shear modulus, nu the (effective) Poisson ratio, d/ds
the tangential derivative and k the Laplace double layer kernel, for continuous u on closed curves:

    <V t, q> = 1 / (8 pi mu (1 - nu)) int int q^T (-(3 - 4 nu) log(|r| / r0) I + Q) t
    <K u, q> = int int k q^T u + 1 / (4 pi (1 - nu)) int int q^T ((1 - 2 nu) J log|r| + J Q) du/ds
    <W u, v> = mu / (2 pi (1 - nu)) int int dv/ds^T (-log|r| I + Q) du/ds

so that all of them are combinations of the scalar integrals of `integrals`.
"""

from __future__ import annotations

import enum
from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Protocol

import numpy as np

from bemkit.arrays import FloatArray, read_only
from bemkit.geometry.errors import GeometryError
from bemkit.geometry.reflection import vanishing_dofs
from bemkit.geometry.spaces import BoundarySpace, local_coefficients
from bemkit.operators.assembly import Block, Tensor, TrialTerm, assemble_together, clear_vanishing
from bemkit.operators.integrals.pairs import Degrees
from bemkit.operators.material import Material

if TYPE_CHECKING:
    from scipy.sparse.linalg import LinearOperator


class Tag(enum.Enum):
    """Promises about an operator; `bemkit.testing.check_operator` proves each one."""

    SYMMETRIC = "symmetric"
    POSITIVE_DEFINITE = "positive definite"
    POSITIVE_SEMIDEFINITE = "positive semidefinite"
    KILLS_RIGID_MOTIONS = "zero on rigid motions"
    KILLS_TRANSLATIONS = "zero on translations"


class BoundaryOperator(Protocol):
    """A weak form <A trial, test> on two boundary spaces."""

    @property
    def trial(self) -> BoundarySpace:
        """The space of the argument."""

    @property
    def test(self) -> BoundarySpace:
        """The space the result is tested with."""

    @property
    def tags(self) -> frozenset[Tag]:
        """What is promised of the matrix."""

    def matrix(self) -> FloatArray:
        """Return the dense (test.n_dofs, trial.n_dofs) matrix, read-only; built on first use."""

    def as_linear_operator(self) -> LinearOperator:
        """Return the operator in the form that scipy's and pyamg's iterative solvers take."""


class _DenseOperator(ABC):
    """Shared by all operators: the lazily built dense matrix."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace, tags: frozenset[Tag]) -> None:
        if trial.mesh is not test.mesh:
            msg = "trial and test space live on different meshes: build both on the same BoundaryMesh object"
            raise GeometryError(msg)
        self.trial = trial
        self.test = test
        self.tags = tags
        self._matrix: FloatArray | None = None

    @property
    def is_assembled(self) -> bool:
        """Whether the dense matrix exists already."""
        return self._matrix is not None

    def keep(self, matrix: FloatArray) -> None:
        """Take over a finished matrix."""
        read_only(matrix)
        self._matrix = matrix

    def as_linear_operator(self) -> LinearOperator:
        """Return the operator in the form that scipy's and pyamg's iterative solvers take."""
        from scipy.sparse.linalg import aslinearoperator

        return aslinearoperator(self.matrix())

    def matrix(self) -> FloatArray:
        """Return the dense (test.n_dofs, trial.n_dofs) matrix, read-only; built on first use."""
        if self._matrix is None:
            matrix = self._build()
            read_only(matrix)
            self._matrix = matrix
        return self._matrix

    @abstractmethod
    def _build(self) -> FloatArray:
        """Compute the dense matrix."""


class PairOperator(_DenseOperator):
    """An operator assembled from element-pair integrals; subclasses say which, and how they combine."""

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
        """Return the parts of the operator that share the test coefficients."""

    def _build(self) -> FloatArray:
        return assemble_together([self])[0][0]


def _derivative(coefficients: FloatArray) -> FloatArray:
    """Return the Legendre coefficients of d/dxi of each row; a constant keeps one zero coefficient."""
    return np.asarray(np.polynomial.legendre.legder(coefficients, axis=1), np.float64)


class SingleLayer(PairOperator):
    """V: traction -> displacement."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace, material: Material) -> None:
        # uniform pressure does not deform an incompressible body: V n = 0
        tags = _definite(trial, material.effective_poisson_ratio < 0.5) if trial is test else frozenset[Tag]()
        super().__init__(trial, test, tags)
        self.material = material

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        return Degrees(log=(self.test.degree, self.trial.degree))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the basis."""
        return local_coefficients(self.test)

    def trial_terms(self) -> list[TrialTerm]:
        """Return the one term of V."""
        return [TrialTerm(local_coefficients(self.trial), self._tensor)]

    def _tensor(self, block: Block, a: int, b: int) -> Tensor:
        nu = self.material.effective_poisson_ratio
        factor = 1.0 / (8.0 * np.pi * self.material.shear_modulus * (1.0 - nu))
        quotient = block.integrals.quotient[a, b]
        diagonal = (-factor * (3.0 - 4.0 * nu)) * block.integrals.log[a, b]
        diagonal += (factor * ((3.0 - 4.0 * nu) * block.log_scale + 0.5)) * block.mass(a, b)
        half_difference, off = (0.5 * factor) * quotient.real, (0.5 * factor) * quotient.imag
        return diagonal + half_difference, off, off, diagonal - half_difference


class DoubleLayer(PairOperator):
    """K: displacement -> displacement, for continuous displacements."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace, material: Material) -> None:
        _require_continuous(trial, "double_layer", "trial")
        super().__init__(trial, test, frozenset())
        self.material = material

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        test, trial = self.test.degree, self.trial.degree
        return Degrees(log=(test, trial - 1), double=(test, trial))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the basis."""
        return local_coefficients(self.test)

    def trial_terms(self) -> list[TrialTerm]:
        """Return the scalar double layer of u, and the kernels that act on du/ds."""
        coefficients = local_coefficients(self.trial)
        return [TrialTerm(coefficients, self._scalar), TrialTerm(_derivative(coefficients), self._slope)]

    def _scalar(self, block: Block, a: int, b: int) -> Tensor:
        diagonal = block.integrals.double[a, b]
        return diagonal, None, None, diagonal

    def _slope(self, block: Block, a: int, b: int) -> Tensor:
        nu = self.material.effective_poisson_ratio
        factor = 1.0 / (4.0 * np.pi * (1.0 - nu)) / block.trial_half
        log = (factor * (1.0 - 2.0 * nu)) * block.integrals.log[a, b]
        half_quotient = (0.5 * factor) * block.integrals.quotient[a, b]
        real, imaginary = half_quotient.real, half_quotient.imag
        return imaginary, log - real, -(log + real), -imaginary


class Hypersingular(PairOperator):
    """W: displacement -> traction, for continuous displacements."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace, material: Material) -> None:
        _require_continuous(trial, "hypersingular", "trial")
        _require_continuous(test, "hypersingular", "test")
        tags = {Tag.SYMMETRIC, Tag.POSITIVE_SEMIDEFINITE} if trial is test else set[Tag]()
        # the rotation of a curved element is not a polynomial, hence not in the space
        kernel = Tag.KILLS_RIGID_MOTIONS if bool(trial.mesh.is_straight.all()) else Tag.KILLS_TRANSLATIONS
        super().__init__(trial, test, frozenset(tags | {kernel}))
        self.material = material

    @property
    def degrees(self) -> Degrees:
        """The integrals it needs."""
        return Degrees(log=(self.test.degree - 1, self.trial.degree - 1))

    @property
    def test_coefficients(self) -> FloatArray:
        """Those of the derivative of the basis."""
        return _derivative(local_coefficients(self.test))

    def trial_terms(self) -> list[TrialTerm]:
        """Return the one term of W, on du/ds and dv/ds."""
        return [TrialTerm(_derivative(local_coefficients(self.trial)), self._tensor)]

    def _tensor(self, block: Block, a: int, b: int) -> Tensor:
        nu = self.material.effective_poisson_ratio
        factor = self.material.shear_modulus / (2.0 * np.pi * (1.0 - nu)) / (block.test_half * block.trial_half)
        log = -factor * block.integrals.log[a, b]
        half_quotient = (0.5 * factor) * block.integrals.quotient[a, b]
        real, imaginary = half_quotient.real, half_quotient.imag
        return log + real, imaginary, imaginary, log - real


class AdjointDoubleLayer(_DenseOperator):
    """K': traction -> traction, exactly the transpose of the double layer."""

    def __init__(self, double_layer: DoubleLayer) -> None:
        super().__init__(double_layer.test, double_layer.trial, frozenset())
        self.double_layer = double_layer

    def _build(self) -> FloatArray:
        return self.double_layer.matrix().T


class Mass(_DenseOperator):
    """The identity in weak form: <u, q>."""

    def __init__(self, trial: BoundarySpace, test: BoundarySpace) -> None:
        super().__init__(trial, test, _definite(trial) if trial is test else frozenset())

    def _build(self) -> FloatArray:
        from bemkit.geometry.quadrature import gauss_legendre

        points, weights = gauss_legendre(self.test.degree + self.trial.degree + 1)
        local = (self.test.basis(points) * weights) @ self.trial.basis(points).T
        half = 0.5 * self.test.mesh.lengths
        matrix = np.zeros((self.test.n_dofs // 2, 2, self.trial.n_dofs // 2, 2))
        for p, q in np.ndindex(*local.shape):
            for c in range(2):
                rows, columns = self.test.element_dofs[:, p], self.trial.element_dofs[:, q]
                matrix[rows, c, columns, c] += local[p, q] * half
        result = matrix.reshape(self.test.n_dofs, self.trial.n_dofs)
        clear_vanishing(result, self.test, self.trial)
        return result


def _definite(space: BoundarySpace, is_positive: bool = True) -> frozenset[Tag]:
    """Return the tags of a symmetric operator that is positive but on dofs that are zero by symmetry."""
    is_definite = is_positive and not vanishing_dofs(space).any()
    return frozenset({Tag.SYMMETRIC, Tag.POSITIVE_DEFINITE if is_definite else Tag.POSITIVE_SEMIDEFINITE})


def _require_continuous(space: BoundarySpace, operator: str, role: str) -> None:
    if not space.is_continuous:
        msg = (
            f"{operator} needs a continuous {role} space, but {type(space).__name__} may jump: "
            "take LinearSpace(mesh) or QuadraticSpace(mesh) without broken nodes"
        )
        raise GeometryError(msg)


def single_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> SingleLayer:
    """Return V, the single layer operator (paper, eq. 27).

    Parameters
    ----------
    trial, test : BoundarySpace
        Traction spaces.
    material : Material

    Returns
    -------
    SingleLayer
        Matrix entries [m^3/Pa]: traction dofs [Pa] to tested displacements.

    Notes
    -----
    The logarithm is log(|r| / r0) with r0 the diameter of the mesh, which makes V positive definite at every size of
    the body; the constant matters nowhere where the tractions are in equilibrium.
    """
    return SingleLayer(trial, test, material)


def double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> DoubleLayer:
    """Return K, the double layer operator (paper, eq. 27); the trial space must be continuous.

    On the boundary of a body (1/2 M + K) r = 0 for its rigid motions r, on that of an exterior (1/2 M + K) r = M r.
    """
    return DoubleLayer(trial, test, material)


def adjoint_double_layer(trial: BoundarySpace, test: BoundarySpace, material: Material) -> AdjointDoubleLayer:
    """Return K' (paper, eq. 27), the transpose of `double_layer(test, trial, material)`."""
    return AdjointDoubleLayer(DoubleLayer(test, trial, material))


def hypersingular(trial: BoundarySpace, test: BoundarySpace, material: Material) -> Hypersingular:
    """Return W, the hypersingular operator (paper, eq. 27), integrated by parts; both spaces must be continuous."""
    return Hypersingular(trial, test, material)


def mass(trial: BoundarySpace, test: BoundarySpace) -> Mass:
    """Return the identity in weak form, <u, q>."""
    return Mass(trial, test)


def assemble(*operators: PairOperator) -> int:
    """Build the matrices of several operators in one sweep, so that shared integrals are computed once.

    Parameters
    ----------
    *operators : PairOperator
        On the same mesh; those that are assembled already are left alone.

    Returns
    -------
    int
        Element pairs whose integrals were evaluated.
    """
    waiting = [operator for operator in operators if not operator.is_assembled]
    if not waiting:
        return 0
    matrices, n_pairs = assemble_together(waiting)
    for operator, matrix in zip(waiting, matrices, strict=True):
        operator.keep(matrix)
    return n_pairs
