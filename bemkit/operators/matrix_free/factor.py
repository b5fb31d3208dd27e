"""The boundary equations of collocation solved by iteration: products by the fast multipole method, nothing dense."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import numpy as np

from bemkit.arrays import FloatArray, IntArray
from bemkit.errors import InputError, NoResultError
from bemkit.geometry.mesh import BoundaryMesh
from bemkit.operators.collocation.equations import CollocationEquations, collocation_border
from bemkit.operators.hierarchy.system import ElementLaws
from bemkit.operators.hierarchy.tree import ClusterTree
from bemkit.operators.linear.solvers import MatrixFree
from bemkit.operators.material import Material
from bemkit.operators.matrix_free.fast_multipole import LEAF_SIZE, FastMultipole
from bemkit.operators.matrix_free.preconditioner import Preconditioner
from bemkit.operators.rigid_modes import without_motion

_PRODUCTS = 1e-3
"""Error of a product by the tolerance of the iteration; tractions feel it by elements on which it oscillates."""
LARGEST_RESIDUAL = 2.5
"""Largest residual of an equation, by the largest displacement and the tolerance. Where the mean of all is small enough
it is mostly below that, but all of it may be on a few elements."""
_FINEST = 1e-13
"""Errors of products below that are round-off."""
_KEPT = 12
"""Directions of a round of GMRES, which the memory has to hold."""
_SHARE = 0.8
"""A round aims below this share of the target, because its own estimate of the residual differs from the true one."""


class NotConvergedError(NoResultError):
    """An iteration that did not reach its tolerance; the message says how far it came and what helps."""


class IterativeFactor:
    """(1/2 + T) u = U t with two conditions on each element, solved by GMRES [SaadSchultz1986]; see `BodyFactor`.

    Parameters
    ----------
    mesh : BoundaryMesh
        Of straight elements, without symmetry.
    material : Material
    options : MatrixFree
        Its tolerance is about the error of displacements, and of tractions by E' over the diameter.
    takes_slopes : bool
        Whether the double layer takes slopes.

    Attributes
    ----------
    steps : list of int
        Steps of all responses so far.

    Notes
    -----
    Between two responses it keeps the unknowns of the last one, with which the iteration begins. The preconditioner is
    made anew if on some element other quantities are unknown than before.
    """

    def __init__(self, mesh: BoundaryMesh, material: Material, options: MatrixFree, *, takes_slopes: bool) -> None:
        self.tree = ClusterTree.of(mesh.centres, LEAF_SIZE)
        # the elements by their positions in the tree
        self._mesh = BoundaryMesh(
            mesh.nodes, mesh.elements[self.tree.order], is_exterior=mesh.is_exterior, follows_outline=True
        )
        self._material, self._options = material, options
        every = np.arange(mesh.n_elements)
        border = collocation_border(self._mesh, material, every, takes_slopes=takes_slopes)
        self.equations = CollocationEquations.of(self._mesh, material, every, border, takes_slopes=takes_slopes)
        self._layers = FastMultipole(self.equations, material, self.tree, max(_PRODUCTS * options.tolerance, _FINEST))
        self._traction_unit = material.plane_modulus / mesh.diameter
        self._z, self._c = np.zeros((mesh.n_elements, 2)), np.zeros(len(border.own))
        self.laws: ElementLaws | None = None
        self.n_updates, self._is_solved = 0, False
        self._inverse: Preconditioner | None = None
        self.steps: list[int] = []

    def expect(self, given: Iterable[FloatArray]) -> None:
        """Nothing is prepared for loads: every response begins with the last one."""

    def update(self, laws: ElementLaws) -> None:
        """Take over the conditions on all elements; `unknowns` solves."""
        before, self.laws, self.n_updates = self.laws, laws, self.n_updates + 1
        if before is None or not np.array_equal(laws.factors, before.factors):
            if before is not None:
                self._begin_with(before, laws)
            self._inverse, self._is_solved = None, False
        elif not np.array_equal(laws.given, before.given):
            self._is_solved = False

    def unknowns(self, leaves: IntArray) -> FloatArray:
        """Return the unknowns z (n, 2) of the elements of some leaves, ascending.

        Raises
        ------
        NotConvergedError
            If the steps do not suffice.
        SingularMatrixError
            If the conditions do not hold the body.
        """
        if not self._is_solved:
            self._solve()
        parts = (self._z[self.tree.places(0, leaf)] for leaf in leaves.tolist())
        return np.concatenate([np.zeros((0, 2)), *parts])

    def errors(self) -> FloatArray:
        """Return the unknowns (n_border,) of the boundary as a whole, of the last `unknowns`."""
        return self._c

    def responses(self, leaf: int, given: FloatArray, leaves: IntArray) -> FloatArray:
        """Refuse to solve for one unit displacement after another.

        Raises
        ------
        InputError
            Always: every column of a stiffness would be an iteration.
        """
        raise InputError(
            "the linear solver MatrixFree forms no stiffness: condense this body with Hierarchical() or densely"
        )

    def _begin_with(self, before: ElementLaws, laws: ElementLaws) -> None:
        """Take over the unknowns of the last response: those nearest to its tractions and displacements."""
        units = np.array([1.0, 1.0, self._traction_unit, self._traction_unit])[:, None]
        state = (before.factors @ self._z[:, :, None] + before.given[:, :, None] - laws.given[:, :, None]) * units
        factors = laws.factors * units
        transposed = factors.transpose(0, 2, 1)
        self._z = np.linalg.solve(transposed @ factors, transposed @ state)[:, :, 0]

    def _state(self, z: FloatArray) -> FloatArray:
        """Return (t_x, t_y, u_x, u_y) of all elements if nothing is given."""
        assert self.laws is not None  # `update` comes first
        return np.asarray(np.einsum("nqz,nz->nq", self.laws.factors, z))

    def _left_by(self, state: FloatArray, c: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the residual of the equations (n_elements, 2), and that of the boundary as a whole (n_border,)."""
        border = self.equations.border
        equations = self._layers.product(state[:, :2], state[:, 2:])
        equations += (border.errors @ c).reshape(-1, 2)
        return equations, border.balances @ state.ravel()

    def _solve(self) -> None:
        """Find the unknowns that fulfil the equations, in the mean and each of them."""
        assert self.laws is not None  # `update` comes first
        inverse = self._inverse = self._inverse or Preconditioner.of(
            self._mesh, self._material, self.equations, self.laws, self._traction_unit
        )
        tolerance, most = self._options.tolerance, self._options.max_steps
        n_steps, target, before = 0, tolerance, np.inf

        def product(x: FloatArray) -> FloatArray:
            z, c = inverse.unknowns(x)
            return inverse.apply(*self._left_by(self._state(z), c))

        while True:
            state = self._state(self._z) + self.laws.given
            equations, balances = self._left_by(state, self._c)
            residual, largest = inverse.apply(equations, balances), float(np.abs(equations).max())
            left = float(np.linalg.norm(residual))
            size = np.hypot(np.linalg.norm(state[:, :2]) / self._traction_unit, np.linalg.norm(state[:, 2:]))
            scale = max(left, float(size))
            if left <= target * scale:
                strained = without_motion(self._mesh, self._mesh.centres, state[:, 2:])
                allowed = LARGEST_RESIDUAL * tolerance * float(np.abs(strained).max())
                if largest <= allowed:
                    break
                target = 0.5 * min(left / scale, target * allowed / largest)
            if not left < 0.5 * before or n_steps >= most:
                if target < tolerance:
                    break  # the mean is small enough, and round-off is all that is left
                raise self._not_converged(n_steps, left / scale)
            before = left
            correction, more = _gmres(product, residual, _SHARE * target * scale / left, most - n_steps)
            n_steps += more
            z, c = inverse.unknowns(correction)
            self._z, self._c = self._z - z, self._c - c
        self.steps.append(n_steps)
        self._is_solved = True

    def _not_converged(self, n_steps: int, left: float) -> NotConvergedError:
        is_cut = n_steps >= self._options.max_steps
        return NotConvergedError(
            f"{n_steps} steps of GMRES leave {left:.1e} of the solution, above the tolerance "
            f"{self._options.tolerance:.3g}: "
            + ("allow more max_steps" if is_cut else "further ones do not help, take a larger one")
            + ", or choose the linear solver 'hierarchical'"
        )


def _gmres(
    product: Callable[[FloatArray], FloatArray], right: FloatArray, tolerance: float, max_steps: int
) -> tuple[FloatArray, int]:
    """Return an approximate solution of ``product(x) = right`` and the number of steps."""
    from scipy.sparse.linalg import LinearOperator, gmres

    steps: list[float] = []
    operator = LinearOperator((right.size, right.size), matvec=product, dtype=float)
    x, _ = gmres(
        operator,
        right,
        rtol=tolerance,
        restart=min(_KEPT, max_steps),
        maxiter=max(1, max_steps // _KEPT),
        callback=steps.append,
        callback_type="pr_norm",
    )
    return x, len(steps)
