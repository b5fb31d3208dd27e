"""Linear solvers for the free displacements of a body: by factorisation or by iteration, and which to take.

Both solve S_ff x = b with the symmetric positive definite block of the Steklov-Poincare map that belongs to the
directions of known force. Factorisation forms S and factors it, with n^3 work. Iteration needs products with S alone,
which the boundary operators and the factor of the single layer give, with n^2 work for each right-hand side and step;
there is one right-hand side for each direction that is retained for contact.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, ClassVar, Protocol, TypeAlias

import numpy as np

from bemkit.arrays import FloatArray
from bemkit.errors import InputError
from bemkit.operators.counts import Factorisation
from bemkit.operators.linear.block_cg import Iterations, block_cg
from bemkit.operators.linear.dense import Cholesky, multiply
from bemkit.operators.material import Material

if TYPE_CHECKING:
    from scipy.sparse import csr_matrix

    from bemkit.operators.linear.multigrid import Multigrid


class DefiniteOperator(Protocol):
    """A symmetric positive definite operator that a linear solver inverts."""

    @property
    def order(self) -> int:
        """Number of unknowns."""

    def matrix(self) -> FloatArray:
        """Return the dense (order, order) matrix; may be expensive."""

    def apply(self, x: FloatArray) -> FloatArray:
        """Return A x of the columns of an (order, m) array."""

    def equivalent(self) -> FloatArray:
        """Return a dense matrix (order, order), row-major and the caller's own, with nearly the same energies."""

    def neighbours(self) -> csr_matrix:
        """Return a sparse positive definite matrix that couples neighbouring unknowns, to be coarsened."""


class Factor(Protocol):
    """A linear operator made ready to solve with."""

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """The factorisations of the operator itself."""

    @property
    def iterations(self) -> tuple[Iterations, ...]:
        """One entry for each solution so far that was found by iteration."""

    def solve(self, right: FloatArray) -> FloatArray:
        """Return A^-1 right for (order,) or (order, m) arrays."""


class LinearSolver(Protocol):
    """A way to solve for the free displacements of a body."""

    @property
    def forms_matrix(self) -> bool:
        """Whether `factor` asks for the matrix of the operator."""

    def factor(self, operator: DefiniteOperator, name: str) -> Factor:
        """Make an operator ready to solve with.

        Parameters
        ----------
        operator : DefiniteOperator
        name : str
            What it stands for, for messages.

        Raises
        ------
        SingularMatrixError
            If it turns out not to be positive definite, at the latest when it is solved with.
        """


@dataclass(frozen=True)
class DenseCholesky:
    """Form the matrix and factor it."""

    forms_matrix: ClassVar[bool] = True

    def factor(self, operator: DefiniteOperator, name: str) -> Cholesky:
        """Return the Cholesky factor."""
        return Cholesky(operator.matrix(), name)


@dataclass(frozen=True)
class Krylov:
    """Conjugate gradients for all right-hand sides at once, preconditioned by a factored matrix or a multigrid cycle.

    Parameters
    ----------
    rtol : float
        Allowed error of the free displacements in the energy norm, relative to each solution. The stiffness of the
        contact boundary and the loads on it err by its square only, which at 1e-9 is below round-off.
    max_steps : int
        Steps allowed.
    coarsest : int
        Order from which on the preconditioner factors instead of coarsening further.

    Raises
    ------
    ValueError
        If `rtol` is not between 0 and 1, or there is no step, or no unknown on the coarsest level.
    """

    forms_matrix: ClassVar[bool] = False

    rtol: float = 1e-9
    max_steps: int = 300
    coarsest: int = 8000

    def __post_init__(self) -> None:
        if not 0.0 < self.rtol < 1.0:
            raise InputError(f"rtol is {self.rtol}: give a number between 0 and 1 such as 1e-9")
        for name in ("max_steps", "coarsest"):
            if getattr(self, name) < 1:
                raise InputError(f"{name} is {getattr(self, name)}: give a positive whole number")

    def error_at(self, material: Material) -> float:
        """Return the relative error that `rtol` may leave in a solution.

        Of nearly incompressible bodies it is larger by 1 / (1 - 2 nu), the ratio of the stiffnesses against changes of
        volume and of shape; at nu = 1/2 an equation of its own keeps the volume.
        """
        return self.rtol if material.is_incompressible else self.rtol / (1.0 - 2.0 * material.effective_poisson_ratio)

    def factor(self, operator: DefiniteOperator, name: str) -> KrylovFactor:
        """Return the operator with its preconditioner."""
        from bemkit.operators.linear.multigrid import Multigrid

        coarse = Multigrid(operator.equivalent(), operator.neighbours(), coarsest=self.coarsest, name=name)
        return KrylovFactor(operator, coarse, self, name)


@dataclass(frozen=True, eq=False)
class KrylovFactor:
    """An operator and its preconditioner.

    Parameters
    ----------
    operator : DefiniteOperator
    preconditioner : Multigrid
    options : Krylov
    name : str
        What the operator stands for, for messages.
    """

    operator: DefiniteOperator
    preconditioner: Multigrid
    options: Krylov
    name: str
    _iterations: list[Iterations] = field(default_factory=list, init=False)

    @property
    def factorisations(self) -> tuple[Factorisation, ...]:
        """None of the operator itself."""
        return ()

    @property
    def iterations(self) -> tuple[Iterations, ...]:
        """One entry for each solution so far."""
        return tuple(self._iterations)

    def solve(self, right: FloatArray) -> FloatArray:
        """Return A^-1 right.

        Raises
        ------
        NotConvergedError
            If the steps do not suffice.
        """
        if not right.size:
            return np.zeros(right.shape)
        rtol, max_steps = self.options.rtol, self.options.max_steps
        apply, precondition = self.operator.apply, self.preconditioner.apply
        columns = right.reshape(len(right), -1)
        solution, iterations = block_cg(apply, precondition, columns, rtol=rtol, max_steps=max_steps, name=self.name)
        self._iterations.append(iterations)
        return solution.reshape(right.shape)


@dataclass(frozen=True, eq=False)
class MatrixOperator:
    """A definite operator given by its dense matrix (order, order)."""

    dense: FloatArray

    @property
    def order(self) -> int:
        """Number of unknowns."""
        return len(self.dense)

    def matrix(self) -> FloatArray:
        """Return the matrix."""
        return self.dense

    def apply(self, x: FloatArray) -> FloatArray:
        """Return A x."""
        return multiply(self.dense, x)

    def equivalent(self) -> FloatArray:
        """Return a copy of the matrix."""
        return np.array(self.dense, order="C")

    def neighbours(self) -> csr_matrix:
        """Return the matrix without its zeros."""
        from scipy.sparse import csr_matrix

        return csr_matrix(self.dense)


@dataclass(frozen=True)
class Automatic:
    """Factorisation or iteration, whichever takes less time and fits into memory; see `choose_linear_solver`."""


@dataclass(frozen=True)
class Hierarchical:
    """Boundary equations compressed over a tree and factored there: time and memory grow like the number of elements.

    For constant collocation, and for Galerkin's method of degree 1 and 2; elsewhere what `Automatic` takes is taken,
    and the plan says why.

    Parameters
    ----------
    tolerance : float
        Of the compression; tractions and displacements err by a few times that.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-12 and 1e-4; finer ones than that cannot be met in double precision.
    """

    tolerance: float = 1e-10

    def __post_init__(self) -> None:
        if not 1e-12 <= self.tolerance <= 1e-4:
            raise InputError(
                f"tolerance is {self.tolerance}: give 1e-12, finer ones cannot be met, to 1e-4, such as 1e-10"
            )

    @property
    def accuracy(self) -> float:
        """Largest error of tractions and displacements that is expected.

        Ten times the tolerance: two to four on bodies from a strip of 100 : 1 to a plate with a hole.
        """
        return 10.0 * self.tolerance


@dataclass(frozen=True)
class MatrixFree:
    """Boundary equations solved by iteration, with products by the fast multipole method: a tenth of the memory.

    For constant collocation on straight elements; elsewhere what `Automatic` takes is taken, and the plan says why.
    Every response takes about twenty products, whatever the number of elements.

    Parameters
    ----------
    tolerance : float
        Of the residual after preconditioning, in the mean of all elements.
    max_steps : int
        Steps allowed for a response.

    Raises
    ------
    ValueError
        If the tolerance is not between 1e-11 and 1e-4, or there is no step.
    """

    tolerance: float = 1e-9
    max_steps: int = 100

    def __post_init__(self) -> None:
        if not 1e-11 <= self.tolerance <= 1e-4:
            raise InputError(
                f"tolerance is {self.tolerance}: give 1e-11, finer ones cannot be met, to 1e-4, such as 1e-9"
            )
        if self.max_steps < 1:
            raise InputError(f"max_steps is {self.max_steps}: give a positive whole number")

    @property
    def accuracy(self) -> float:
        """Largest error of tractions and displacements that is expected: a hundred times the tolerance.

        That is by how much tractions where contact changes err more than those in the mean.
        """
        return 100.0 * self.tolerance


LinearSolverChoice: TypeAlias = Automatic | Hierarchical | MatrixFree | LinearSolver


@dataclass(frozen=True)
class ChosenLinearSolver:
    """A linear solver and why it was taken.

    Parameters
    ----------
    solver : LinearSolver
    reason : str
        Part of a sentence, for the plan.
    hierarchical : Hierarchical or MatrixFree, optional
        Given if the equations are compressed over a tree or not stored at all, and not solved by `solver`.
    """

    solver: LinearSolver
    reason: str
    hierarchical: Hierarchical | MatrixFree | None = None
